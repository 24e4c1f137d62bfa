/* Trees with cuts that join two moving links: the rows of J by articulated bodies.
 *
 * Generic over `real`.
 * A unit of force along each row, on the links of its pairs, accelerates the free tree by M^-1 J^T
 * (Featherstone 2008, section 7.2), one pass over the links for each row.  The rows meet in
 * J M^-1 J^T, whose size is that of the rows alone: neither J nor M is formed, and the cost grows
 * with the links times the rows.
 *
 * This squares the singular values of the rows.  A second solution for what the first leaves of the
 * rows' values takes the error back to that of the rows themselves; where rows are so far from
 * independent that this is in doubt, below MECHC_SAFE_SQUARED, they are solved by the orthogonal factors
 * of linear.h.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_MOVING_CUTS_VECTOR : !defined MECHC_MOVING_CUTS_SCALAR
#if R_VECTOR
#define MECHC_MOVING_CUTS_VECTOR
#else
#define MECHC_MOVING_CUTS_SCALAR
#endif
#include "dynamics/linear.h"
#include "dynamics/tree.h"

#if MECHC_MOVING_CUTS_CODE
typedef struct {
    FN(articulated) links;
    real changes[MECHC_NC_MAX * MECHC_NU_MAX]; /* M^-1 J^T, row by row of J */
    FN(mass_factors) meeting;          /* J M^-1 J^T */
    real conditioning;                 /* squared */
} FN(meeting_rows);

/* Accelerations of the free tree by wrenches on the links, which are overwritten. */
MECHC_ONCE void FN(free_answer)(const real *tree, const FN(articulated) *f, real *wrench, real *x)
{
    real left[MECHC_NU_MAX], motion[MECHC_LINKS_MAX * MECHC_DIM_MAX];
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        real *own = wrench + link * MECHC_DIM;
        for (int c = mechc_first_column[link + 1] - 1; c >= mechc_first_column[link]; c--) {
            left[c] = FN(along_motion)(tree + MECHC_AT_SUBSPACE + c * MECHC_DIM, own)
                    * f->inverse[c];
            for (int i = 0; i < MECHC_DIM; i++) R_SUB(own[i], left[c], f->momentum[c * MECHC_DIM + i]);
        }
        if (mechc_parent[link] >= 0)
            FN(add_wrench)(tree + link * MECHC_ARM, own, wrench + mechc_parent[link] * MECHC_DIM);
    }
    for (int link = 0; link < MECHC_LINKS; link++) {
        real *own = FN(motion_of_parent)(tree, link, motion);
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            const real *axis = tree + MECHC_AT_SUBSPACE + c * MECHC_DIM;
            const real part =
                left[c] - FN(along_motion)(f->momentum + c * MECHC_DIM, own) * f->inverse[c];
            for (int i = 0; i < MECHC_DIM; i++) R_ADD(own[i], part, axis[i]);
            x[mechc_column_speed[c]] = part;
        }
    }
}

/* A unit of force along a row, on the links of its pairs. */
MECHC_INLINE void FN(force_along_row)(const real *tree, int row, real *wrench)
{
    for (int i = 0; i < MECHC_LINKS * MECHC_DIM; i++) wrench[i] = R(0.0);
    for (int end = 2 * mechc_first_pair[row]; end < 2 * mechc_first_pair[row + 1]; end++) {
        const int link = mechc_cut[end];
        real one[MECHC_DIM_MAX];
        if (link < 0) continue;
        FN(cut_wrench)(tree, end / 2, end % 2, one);
        for (int j = 0; j < MECHC_DIM; j++) wrench[link * MECHC_DIM + j] += one[j];
    }
}

/* Squared distance of the row nearest to the span of the others, over the longest row's length: a
 * distance is the inverse of an entry of the inverse's diagonal. */
MECHC_INLINE real FN(meeting_conditioning)(const FN(mass_factors) *f, real longest)
{
    real most = R(0.0), unit[MECHC_NC_MAX];
    for (int i = 0; i < MECHC_NC; i++) {
        real entry = R(0.0);
        for (int k = 0; k < MECHC_NC; k++) unit[k] = R(k == i);
        FN(forward)(f, MECHC_NC, unit);
        for (int k = i; k < MECHC_NC; k++) R_ADD(entry, unit[k] * unit[k], f->inverse[k]);
        most = FN(larger)(most, entry);
    }
    return 1.0 / (most * longest);
}

MECHC_ONCE void FN(meet)(const real *tree, FN(meeting_rows) *f)
{
    real meeting[MECHC_NC_MAX * MECHC_NC_MAX], wrench[MECHC_LINKS_MAX * MECHC_DIM_MAX], longest = R(0.0);
    meeting[0] = R(1.0); /* of no row */
    FN(articulate)(tree, &f->links);
    for (int i = 0; i < MECHC_NC; i++) {
        real *change = f->changes + i * MECHC_NU;
        FN(force_along_row)(tree, i, wrench);
        FN(free_answer)(tree, &f->links, wrench, change);
        FN(cut_rates)(tree, change, meeting + i * MECHC_NC);
        longest = FN(larger)(meeting[i * MECHC_NC + i], longest);
    }
    const int bad = FN(factor_mass)(meeting, MECHC_NC, &f->meeting);
    f->conditioning = FN(meeting_conditioning)(&f->meeting, longest);
    for (int i = 0; bad >= 0 && i < MECHC_NC; i++) /* rounding of dependent rows */
        f->conditioning =
            R_SELECT(R_MASK(f->meeting.inverse[i] > 0.0), f->conditioning, R(0.0));
}

/* The x nearest to M^-1 S^T wrench, in the metric of M, on which the rows take the values given;
 * wrench, which is overwritten, holds one on each link. */
MECHC_ONCE void FN(follow_meeting)(const real *tree, const FN(meeting_rows) *f, real *wrench,
                                   const real *values, real *x)
{
    real part[MECHC_NC_MAX];
    FN(free_answer)(tree, &f->links, wrench, x);
    for (int again = 0; again < 2; again++) {
        FN(cut_rates)(tree, x, part);
        for (int i = 0; i < MECHC_NC; i++) part[i] = values[i] - part[i];
        FN(forward)(&f->meeting, MECHC_NC, part);
        FN(backward)(&f->meeting, MECHC_NC, part);
        for (int i = 0; i < MECHC_NC; i++)
            for (int k = 0; k < MECHC_NU; k++) R_ADD(x[k], part[i], f->changes[i * MECHC_NU + k]);
    }
}
#endif
#endif
