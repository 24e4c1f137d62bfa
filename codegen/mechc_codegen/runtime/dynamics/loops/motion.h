/* Motion of trees with cuts: M u' + J^T lambda = F and J u' = gamma; generic over `real`.
 *
 * Rows that are far from dependent are eliminated link by link (rows.h, and cuts.h where
 * a cut joins two links that both move).  Elsewhere they are solved together: with M = L D L^T a row a of J
 * becomes L^-1 a, rows are made orthogonal there, and sigma is not squared; so they are where a speed moves
 * several links.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_LOOP_MOTION_VECTOR : !defined MECHC_LOOP_MOTION_SCALAR
#if R_VECTOR
#define MECHC_LOOP_MOTION_VECTOR
#else
#define MECHC_LOOP_MOTION_SCALAR
#endif
#include "dynamics/linear.h"
#include "dynamics/loops/rows.h"
#include "dynamics/loops/cuts.h"
#include "dynamics/tree.h"

#if MECHC_WALKED && MECHC_NC_MAX > 0
#define MECHC_WALKED_ROWS (MECHC_CARRIED > 0 || MECHC_MOVING_CUTS)

typedef struct {
#if MECHC_CARRIED_CODE
    FN(eliminated) links;
#endif
#if MECHC_MOVING_CUTS_CODE
    FN(meeting_rows) meeting;
#endif
    rmask apart;         /* the lanes in which rows are eliminated link by link */
    int together;        /* some other lane needs the factors */
    FN(factors) factors;
} FN(solver);

/* Eliminate the rows link by link. */
MECHC_INLINE void FN(eliminate_apart)(const real *tree, FN(solver) *f)
{
#if MECHC_CARRIED_CODE
    if (MECHC_CARRIED > 0) FN(eliminate)(tree, &f->links);
#endif
#if MECHC_MOVING_CUTS_CODE
    if (MECHC_MOVING_CUTS) FN(meet)(tree, &f->meeting);
#endif
    (void)tree, (void)f;
}

MECHC_INLINE void FN(follow_apart)(const real *tree, const FN(solver) *f, real *wrench, const real *values,
                                   real *x)
{
#if MECHC_CARRIED_CODE
    if (MECHC_CARRIED > 0) FN(follow_rows)(tree, &f->links, wrench, values, x);
#endif
#if MECHC_MOVING_CUTS_CODE
    if (MECHC_MOVING_CUTS) FN(follow_meeting)(tree, &f->meeting, wrench, values, x);
#endif
    (void)tree, (void)f, (void)wrench, (void)values, (void)x;
}

/* The squared conditioning of the rows that are eliminated link by link. */
MECHC_INLINE real FN(conditioning_apart)(const FN(solver) *f)
{
#if MECHC_CARRIED_CODE
    if (MECHC_CARRIED > 0) return f->links.conditioning;
#endif
#if MECHC_MOVING_CUTS_CODE
    if (MECHC_MOVING_CUTS) return f->meeting.conditioning;
#endif
    (void)f;
    return R(0.0);
}

MECHC_ONCE void FN(factor_together)(const real *tree, real *jacobian, real *mass, real rank,
                                    FN(factors) *f)
{
    FN(cut_rows)(tree, jacobian);
    FN(composite_mass)(tree, mass);
    FN(factor_rows)(jacobian, mass, R(1.0), MECHC_NC, rank, f);
}

/* Factor the rows of which `rank` count; jacobian and mass are filled where some lane needs them. */
MECHC_INLINE void FN(prepare_rows)(const real *tree, real *jacobian, real *mass, real rank,
                                   FN(solver) *f)
{
    f->apart = R_MASK(R(0.0) > R(0.0));
    if (MECHC_WALKED_ROWS) {
        const double safe = MECHC_MOVING_CUTS ? MECHC_SAFE_SQUARED : MECHC_SAFE;
        FN(eliminate_apart)(tree, f);
        f->apart = R_MASK(FN(conditioning_apart)(f) > safe) & R_MASK(rank >= (double)MECHC_NC);
    }
    f->together = R_ANY(~f->apart);
    if (f->together) FN(factor_together)(tree, jacobian, mass, rank, &f->factors);
}

/* Squared length of the shortest orthogonal row over that of the longest. */
MECHC_INLINE real FN(conditioning_squared)(const FN(solver) *f)
{
    const real together = f->together ? FN(least_singular_squared)(&f->factors, R(0.0)) : R(1.0);
    return MECHC_WALKED_ROWS ? R_SELECT(f->apart, FN(conditioning_apart)(f), together) : together;
}

/* The x nearest to M^-1 forcing, in the metric of M, on which the rows take the values given; the
 * multipliers where lambda is not NULL. */
MECHC_ONCE void FN(solve_together)(const FN(factors) *f, const real *jacobian, const real *forcing,
                                   const real *values, real *x, real *lambda)
{
    FN(solve_in_metric)(f, &f->metric, jacobian, forcing, values, x, lambda);
}

/* Accelerations by the wrenches on the links, which are overwritten; lambda may be NULL. */
MECHC_ONCE void FN(solve_motion)(const real *tree, const FN(solver) *f, real *wrench,
                                 const real *gamma, real *x, real *lambda)
{
    real copy[MECHC_LINKS_MAX * MECHC_DIM_MAX], forcing[MECHC_NU_MAX], other[MECHC_NU_MAX];
    const int together = f->together || lambda;
    if (together) {
        for (int i = 0; i < MECHC_LINKS * MECHC_DIM; i++) copy[i] = wrench[i];
        FN(along_speeds)(tree, copy, forcing);
    }
    if (MECHC_WALKED_ROWS && R_ANY(f->apart)) FN(follow_apart)(tree, f, wrench, gamma, x);
    if (!together) return;
    real jacobian[MECHC_NC_MAX * MECHC_NU_MAX];
    if (lambda) FN(cut_rows)(tree, jacobian);
    if (f->together) {
        FN(solve_together)(&f->factors, jacobian, forcing, gamma, other, lambda);
    } else {
        FN(factors) factors;
        real mass[MECHC_NU_MAX * MECHC_NU_MAX];
        FN(factor_together)(tree, jacobian, mass, R((double)MECHC_NC), &factors);
        FN(solve_together)(&factors, jacobian, forcing, gamma, other, lambda);
    }
    for (int i = 0; i < MECHC_NU; i++) x[i] = R_SELECT(f->apart, x[i], other[i]);
}

/* The least change, in the metric of M, that gives every row the value wanted. */
MECHC_ONCE void FN(least_step)(const real *tree, const FN(solver) *f, const real *values,
                               real *step)
{
    real other[MECHC_NU_MAX];
    for (int i = 0; !MECHC_WALKED_ROWS && i < MECHC_NU; i++) step[i] = R(0.0);
    if (MECHC_WALKED_ROWS && R_ANY(f->apart)) {
        real none[MECHC_LINKS_MAX * MECHC_DIM_MAX];
        for (int i = 0; i < MECHC_LINKS * MECHC_DIM; i++) none[i] = R(0.0);
        FN(follow_apart)(tree, f, none, values, step);
    }
    if (!f->together) return;
    FN(least_change)(&f->factors, MECHC_NC, values, other);
    for (int i = 0; i < MECHC_NU; i++) step[i] = R_SELECT(f->apart, step[i], other[i]);
}
#endif
#endif
