/* Trees of links: mass matrix, forcing and accelerations by recursion; generic over `real`.
 *
 * Vectors of motion are (omega; v) of a link's reference point, wrenches (moment; force) there, all
 * along the inertial axes, so that from link to link they are shifted and not turned.  In a plane
 * they are (omega_z; v_x, v_y).  Composite rigid bodies, recursive Newton-Euler and articulated
 * bodies: Featherstone 2008, chapters 5 to 7; accelerations are those of points, not spatial ones.
 * Columns are the speeds in the order of the links that they move; one that moves several has as many, and
 * then the mass matrix is factored: articulated bodies, and rows that are eliminated, have a column a speed.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_TREE_VECTOR : !defined MECHC_TREE_SCALAR
#if R_VECTOR
#define MECHC_TREE_VECTOR
#else
#define MECHC_TREE_SCALAR
#endif
#include "scene_program.h"

#if MECHC_WALKED
#define MECHC_DIM (MECHC_PLANAR ? 3 : 6)
#define MECHC_ARM (MECHC_PLANAR ? 2 : 3)
#define MECHC_MASSES (MECHC_PLANAR ? 4 : 10)
#define MECHC_SQUARE (MECHC_DIM * MECHC_DIM)
#if MECHC_GENERAL
#define MECHC_DIM_MAX 6
#define MECHC_ARM_MAX 3
#else
#define MECHC_DIM_MAX MECHC_DIM
#define MECHC_ARM_MAX MECHC_ARM
#endif
#define MECHC_SQUARE_MAX (MECHC_DIM_MAX * MECHC_DIM_MAX)

/* Where a link's data lie among what the configuration saves. */
#define MECHC_AT_SUBSPACE (MECHC_LINKS * MECHC_ARM)
#define MECHC_AT_INERTIA (MECHC_AT_SUBSPACE + MECHC_COLUMNS * MECHC_DIM)
#define MECHC_AT_REFERENCE (MECHC_AT_INERTIA + MECHC_LINKS * MECHC_MASSES)
#if MECHC_NC_MAX > 0
#define MECHC_AT_CUT (MECHC_AT_REFERENCE + MECHC_LINKS * MECHC_ARM)
/* Of a pair of opposite wrenches, as which a row acts: both ends, the force, and the moment where some
 * pairs have one. */
#define MECHC_CUT (3 * MECHC_ARM + (MECHC_MOMENTS ? MECHC_DIM - MECHC_ARM : 0))
#define MECHC_AT_SAVED (MECHC_AT_CUT + MECHC_PAIRS * MECHC_CUT)
#else
#define MECHC_AT_SAVED MECHC_AT_REFERENCE
#endif

MECHC_INLINE real FN(along_motion)(const real *a, const real *b)
{
    real sum = a[0] * b[0];
    for (int i = 1; i < MECHC_DIM; i++) R_ADD(sum, a[i], b[i]);
    return sum;
}

MECHC_INLINE void FN(times_inertia)(const real *inertia, const real *motion, real *out)
{
    for (int i = 0; i < MECHC_DIM; i++)
        out[i] = FN(along_motion)(inertia + i * MECHC_DIM, motion);
}

MECHC_INLINE void FN(add_cross)(const real *a, const real *b, real *out)
{
    out[0] += R_FMS(a[1], b[2], a[2] * b[1]);
    out[1] += R_FMS(a[2], b[0], a[0] * b[2]);
    out[2] += R_FMS(a[0], b[1], a[1] * b[0]);
}

/* The motion of a point at the end of an arm. */
MECHC_INLINE void FN(shift_motion)(const real *arm, const real *motion, real *out)
{
    for (int i = 0; i < MECHC_DIM; i++) out[i] = motion[i];
    if (MECHC_PLANAR) {
        R_SUB(out[1], motion[0], arm[1]);
        R_ADD(out[2], motion[0], arm[0]);
    } else {
        FN(add_cross)(motion, arm, out + 3);
    }
}

/* A wrench at the end of an arm, added to one at its beginning. */
MECHC_INLINE void FN(add_wrench)(const real *arm, const real *wrench, real *out)
{
    if (MECHC_PLANAR) {
        out[0] += R_FNMA(arm[1], wrench[1], R_FMA(arm[0], wrench[2], wrench[0]));
        out[1] += wrench[1];
        out[2] += wrench[2];
    } else {
        for (int i = 0; i < 6; i++) out[i] += wrench[i];
        FN(add_cross)(arm, wrench + 3, out);
    }
}

MECHC_INLINE void FN(add_planar_inertia)(const real *arm, const real *inertia, real *out)
{
    const real x = R_FMS(arm[0], inertia[5], arm[1] * inertia[4]); /* arm x the lines of the forces */
    const real y = R_FMS(arm[0], inertia[8], arm[1] * inertia[7]);
    const real coupling[2] = {inertia[1] + x, inertia[2] + y};
    out[0] += R_FNMA(arm[1], inertia[1] + coupling[0], R_FMA(arm[0], inertia[2] + coupling[1], inertia[0]));
    for (int j = 0; j < 2; j++) {
        out[1 + j] += coupling[j];
        out[3 * (1 + j)] += coupling[j];
        for (int i = 0; i < 2; i++) out[3 * (1 + j) + 1 + i] += inertia[3 * (1 + j) + 1 + i];
    }
}

/* With I = [A B; B^T C] and x K = x cross arm: B' = B + K^T C, A' = A + B K + (B' K)^T. */
MECHC_INLINE void FN(add_spatial_inertia)(const real *arm, const real *inertia, real *out)
{
    real coupling[9], moved[9];
    for (int j = 0; j < 3; j++) { /* column j of K^T C, C being symmetric */
        real column[3] = {inertia[3 + j], inertia[9 + j], inertia[15 + j]};
        FN(add_cross)(arm, inertia + 6 * (3 + j) + 3, column);
        for (int i = 0; i < 3; i++) coupling[3 * i + j] = column[i];
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) moved[3 * i + j] = inertia[6 * i + j];
        FN(add_cross)(arm, inertia + 6 * i + 3, moved + 3 * i);
    }
    for (int j = 0; j < 3; j++) {
        real column[3] = {moved[j], moved[3 + j], moved[6 + j]};
        FN(add_cross)(arm, coupling + 3 * j, column);
        for (int i = 0; i < 3; i++) {
            out[6 * i + j] += column[i];
            out[6 * i + 3 + j] += coupling[3 * i + j];
            out[6 * (3 + j) + i] += coupling[3 * i + j];
            out[6 * (3 + i) + 3 + j] += inertia[6 * (3 + i) + 3 + j];
        }
    }
}

/* An inertia about the end of an arm, added to one about its beginning. */
MECHC_INLINE void FN(add_inertia)(const real *arm, const real *inertia, real *out)
{
    if (MECHC_PLANAR) FN(add_planar_inertia)(arm, inertia, out);
    else FN(add_spatial_inertia)(arm, inertia, out);
}

/* masses: m, m c, and the lower half of the inertia about the reference point */
MECHC_INLINE void FN(rigid_inertia)(const real *masses, real *out)
{
    const real *c = masses + 1, *about = masses + (MECHC_PLANAR ? 3 : 4);
    if (MECHC_PLANAR) {
        const real rows[9] = {about[0], -c[1],  c[0],   -c[1],    masses[0],
                              R(0.0),   c[0],   R(0.0), masses[0]};
        for (int i = 0; i < 9; i++) out[i] = rows[i];
        return;
    }
    const real skew[9] = {R(0.0), -c[2], c[1], c[2], R(0.0), -c[0], -c[1], c[0], R(0.0)};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int row = i > j ? i : j, column = i > j ? j : i;
            out[6 * i + j] = about[row * (row + 1) / 2 + column];
            out[6 * i + 3 + j] = skew[3 * i + j];
            out[6 * (3 + j) + i] = skew[3 * i + j];
            out[6 * (3 + i) + 3 + j] = i == j ? masses[0] : R(0.0);
        }
}

MECHC_INLINE void FN(rigid_inertias)(const real *tree, real *out)
{
    for (int link = 0; link < MECHC_LINKS; link++)
        FN(rigid_inertia)(tree + MECHC_AT_INERTIA + link * MECHC_MASSES,
                          out + link * MECHC_SQUARE);
}

/* The mass matrix by composite bodies: each link with all its descendants. */
MECHC_ONCE void FN(composite_mass)(const real *tree, real *mass)
{
    real composite[MECHC_LINKS_MAX * MECHC_SQUARE_MAX];
    for (int i = 0; i < MECHC_NU * MECHC_NU; i++) mass[i] = R(0.0);
    FN(rigid_inertias)(tree, composite);
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        const real *inertia = composite + link * MECHC_SQUARE;
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            real wrench[MECHC_DIM_MAX], next[MECHC_DIM_MAX];
            const int speed = mechc_column_speed[c];
            FN(times_inertia)(inertia, tree + MECHC_AT_SUBSPACE + c * MECHC_DIM, wrench);
            for (int at = link; at >= 0; at = mechc_parent[at]) {
                for (int d = mechc_first_column[at]; d < mechc_first_column[at + 1]; d++) {
                    const int other = mechc_column_speed[d];
                    const real *axis = tree + MECHC_AT_SUBSPACE + d * MECHC_DIM;
                    const real entry = FN(along_motion)(axis, wrench);
                    if (!MECHC_SPEEDS_SHARED) {
                        mass[speed * MECHC_NU + other] = mass[other * MECHC_NU + speed] = entry;
                    } else if (at < link || d <= c) { /* each pair of columns once, and as two of one speed twice */
                        mass[speed * MECHC_NU + other] += entry;
                        if (d != c) mass[other * MECHC_NU + speed] += entry;
                    }
                }
                for (int i = 0; i < MECHC_DIM; i++) next[i] = R(0.0);
                FN(add_wrench)(tree + at * MECHC_ARM, wrench, next);
                for (int i = 0; i < MECHC_DIM; i++) wrench[i] = next[i];
            }
        }
        if (mechc_parent[link] >= 0)
            FN(add_inertia)(tree + link * MECHC_ARM, inertia,
                            composite + mechc_parent[link] * MECHC_SQUARE);
    }
}

/* Write the motion that a link has as a part of its parent to the link's own place. */
MECHC_INLINE real *FN(motion_of_parent)(const real *tree, int link, real *motion)
{
    const int parent = mechc_parent[link];
    real *own = motion + link * MECHC_DIM;
    for (int i = 0; i < MECHC_DIM; i++) own[i] = R(0.0);
    if (parent >= 0)
        FN(shift_motion)(tree + link * MECHC_ARM, motion + parent * MECHC_DIM, own);
    return own;
}

/* Subtract from each wrench the inertia force of the motion at u' = 0. */
MECHC_ONCE void FN(take_bias)(const real *tree, const real *bias, real *wrench)
{
    real motion[MECHC_LINKS_MAX * MECHC_DIM_MAX], rigid[MECHC_SQUARE_MAX], needed[MECHC_DIM_MAX];
    for (int link = 0; link < MECHC_LINKS; link++) {
        real *own = FN(motion_of_parent)(tree, link, motion);
        for (int i = 0; i < MECHC_DIM; i++) own[i] += bias[link * MECHC_DIM + i];
        FN(rigid_inertia)(tree + MECHC_AT_INERTIA + link * MECHC_MASSES, rigid);
        FN(times_inertia)(rigid, own, needed);
        for (int i = 0; i < MECHC_DIM; i++) wrench[link * MECHC_DIM + i] -= needed[i];
    }
}

/* Generalised forces of the wrenches, which are overwritten. */
MECHC_ONCE void FN(along_speeds)(const real *tree, real *wrench, real *forcing)
{
    for (int i = 0; MECHC_SPEEDS_SHARED && i < MECHC_NU; i++) forcing[i] = R(0.0);
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            const real along = FN(along_motion)(tree + MECHC_AT_SUBSPACE + c * MECHC_DIM,
                                                wrench + link * MECHC_DIM);
            real *const own = forcing + mechc_column_speed[c];
            *own = MECHC_SPEEDS_SHARED ? *own + along : along;
        }
        if (mechc_parent[link] >= 0)
            FN(add_wrench)(tree + link * MECHC_ARM, wrench + link * MECHC_DIM,
                           wrench + mechc_parent[link] * MECHC_DIM);
    }
}

/* Articulated inertias: each link with all its descendants, whose joints are free. */
typedef struct {
    real inertia[MECHC_LINKS_MAX * MECHC_SQUARE_MAX];
    real momentum[MECHC_NU_MAX * MECHC_DIM_MAX]; /* momentum of each column's motion */
    real inverse[MECHC_NU_MAX];              /* inverse of each column's inertia along itself */
} FN(articulated);

/* I <- I - U U^T / D */
MECHC_INLINE void FN(free_speed)(const real *momentum, real inverse, real *inertia)
{
    for (int i = 0; i < MECHC_DIM; i++) {
        const real part = momentum[i] * inverse;
        for (int j = 0; j < MECHC_DIM; j++) R_SUB(inertia[i * MECHC_DIM + j], part, momentum[j]);
    }
}

/* Returns a speed whose motion has no inertia, or -1. */
MECHC_ONCE int FN(articulate)(const real *tree, FN(articulated) *f)
{
    int bad = -1;
    FN(rigid_inertias)(tree, f->inertia);
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        real *inertia = f->inertia + link * MECHC_SQUARE;
        for (int c = mechc_first_column[link + 1] - 1; c >= mechc_first_column[link]; c--) {
            const real *axis = tree + MECHC_AT_SUBSPACE + c * MECHC_DIM;
            real *momentum = f->momentum + c * MECHC_DIM;
            FN(times_inertia)(inertia, axis, momentum);
            const real along = FN(along_motion)(axis, momentum);
            if (R_ANY(~R_MASK(along > 0.0))) bad = mechc_column_speed[c];
            f->inverse[c] = 1.0 / along;
            FN(free_speed)(momentum, f->inverse[c], inertia);
        }
        if (mechc_parent[link] >= 0)
            FN(add_inertia)(tree + link * MECHC_ARM, inertia,
                            f->inertia + mechc_parent[link] * MECHC_SQUARE);
    }
    return bad;
}

/* Accelerations of a tree without cuts; wrench is overwritten. */
MECHC_ONCE void FN(free_accelerations)(const real *tree, const FN(articulated) *f, const real *bias,
                                       real *wrench, real *accelerations)
{
    real left[MECHC_NU_MAX], motion[MECHC_LINKS_MAX * MECHC_DIM_MAX], taken[MECHC_DIM_MAX];
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        real *own = wrench + link * MECHC_DIM;
        for (int c = mechc_first_column[link + 1] - 1; c >= mechc_first_column[link]; c--) {
            left[c] = FN(along_motion)(tree + MECHC_AT_SUBSPACE + c * MECHC_DIM, own);
            const real part = left[c] * f->inverse[c];
            for (int i = 0; i < MECHC_DIM; i++) R_SUB(own[i], part, f->momentum[c * MECHC_DIM + i]);
        }
        FN(times_inertia)(f->inertia + link * MECHC_SQUARE, bias + link * MECHC_DIM, taken);
        for (int i = 0; i < MECHC_DIM; i++) own[i] -= taken[i];
        if (mechc_parent[link] >= 0)
            FN(add_wrench)(tree + link * MECHC_ARM, own, wrench + mechc_parent[link] * MECHC_DIM);
    }
    for (int link = 0; link < MECHC_LINKS; link++) {
        real *own = FN(motion_of_parent)(tree, link, motion);
        for (int i = 0; i < MECHC_DIM; i++) own[i] += bias[link * MECHC_DIM + i];
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            const real *momentum = f->momentum + c * MECHC_DIM;
            const real part = (left[c] - FN(along_motion)(momentum, own)) * f->inverse[c];
            for (int i = 0; i < MECHC_DIM; i++)
                R_ADD(own[i], part, tree[MECHC_AT_SUBSPACE + c * MECHC_DIM + i]);
            accelerations[mechc_column_speed[c]] = part;
        }
    }
}

#if MECHC_NC_MAX > 0
/* From a link's reference point to a point. */
MECHC_INLINE void FN(arm_to)(const real *tree, int link, const real *point, real *arm)
{
    for (int i = 0; i < MECHC_ARM; i++)
        arm[i] = point[i] - tree[MECHC_AT_REFERENCE + link * MECHC_ARM + i];
}

/* The wrench of a pair on one end, about the reference point there. */
MECHC_INLINE void FN(cut_wrench)(const real *tree, int pair, int end, real *wrench)
{
    const real *points = tree + MECHC_AT_CUT + pair * MECHC_CUT, *axis = points + 2 * MECHC_ARM;
    const real *turn = axis + MECHC_ARM;
    real arm[MECHC_ARM_MAX], force[MECHC_DIM_MAX];
    FN(arm_to)(tree, mechc_cut[2 * pair + end], points + end * MECHC_ARM, arm);
    for (int j = 0; j < MECHC_DIM; j++) force[j] = wrench[j] = R(0.0);
    for (int j = 0; j < MECHC_ARM; j++)
        force[MECHC_DIM - MECHC_ARM + j] = end ? -axis[j] : axis[j];
    for (int j = 0; MECHC_MOMENTS && j < MECHC_DIM - MECHC_ARM; j++) force[j] = end ? -turn[j] : turn[j];
    FN(add_wrench)(arm, force, wrench);
}

/* What a pair's force and moment make of a motion. */
MECHC_INLINE real FN(along_cut)(const real *axis, const real *moved)
{
    const real *turn = axis + MECHC_ARM;
    real part = R(0.0);
    for (int i = 0; i < MECHC_ARM; i++) R_ADD(part, axis[i], moved[MECHC_DIM - MECHC_ARM + i]);
    for (int i = 0; MECHC_MOMENTS && i < MECHC_DIM - MECHC_ARM; i++) R_ADD(part, turn[i], moved[i]);
    return part;
}

/* Partial velocities of a point along an axis, by the speeds of all links down to the ground. */
MECHC_INLINE void FN(add_partials)(const real *tree, int link, const real *point, const real *axis,
                                   double sign, real *row)
{
    for (; link >= 0; link = mechc_parent[link]) {
        real arm[MECHC_ARM_MAX], moved[MECHC_DIM_MAX];
        FN(arm_to)(tree, link, point, arm);
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            FN(shift_motion)(arm, tree + MECHC_AT_SUBSPACE + c * MECHC_DIM, moved);
            R_ADD(row[mechc_column_speed[c]], R(sign), FN(along_cut)(axis, moved));
        }
    }
}

/* The rows of J: what each pair makes of the partial velocities of its ends. */
MECHC_ONCE void FN(cut_rows)(const real *tree, real *jacobian)
{
    for (int i = 0; i < MECHC_NC * MECHC_NU; i++) jacobian[i] = R(0.0);
    for (int i = 0; i < MECHC_NC; i++)
        for (int pair = mechc_first_pair[i]; pair < mechc_first_pair[i + 1]; pair++) {
            const real *point = tree + MECHC_AT_CUT + pair * MECHC_CUT;
            const real *target = point + MECHC_ARM, *axis = target + MECHC_ARM;
            real *row = jacobian + i * MECHC_NU;
            FN(add_partials)(tree, mechc_cut[2 * pair], point, axis, 1.0, row);
            FN(add_partials)(tree, mechc_cut[2 * pair + 1], target, axis, -1.0, row);
        }
}

/* J x, from link to link. */
MECHC_ONCE void FN(cut_rates)(const real *tree, const real *x, real *rates)
{
    real motion[MECHC_LINKS_MAX * MECHC_DIM_MAX], arm[MECHC_ARM_MAX], moved[MECHC_DIM_MAX];
    for (int link = 0; link < MECHC_LINKS; link++) {
        real *own = FN(motion_of_parent)(tree, link, motion);
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++)
            for (int i = 0; i < MECHC_DIM; i++)
                R_ADD(own[i], x[mechc_column_speed[c]], tree[MECHC_AT_SUBSPACE + c * MECHC_DIM + i]);
    }
    for (int i = 0; i < MECHC_NC; i++) {
        rates[i] = R(0.0);
        for (int pair = mechc_first_pair[i]; pair < mechc_first_pair[i + 1]; pair++) {
            const real *point = tree + MECHC_AT_CUT + pair * MECHC_CUT;
            const real *axis = point + 2 * MECHC_ARM;
            for (int end = 0; end < 2; end++, point += MECHC_ARM) {
                const int link = mechc_cut[2 * pair + end];
                if (link < 0) continue;
                FN(arm_to)(tree, link, point, arm);
                FN(shift_motion)(arm, motion + link * MECHC_DIM, moved);
                const real part = FN(along_cut)(axis, moved);
                rates[i] += end ? -part : part;
            }
        }
    }
}

MECHC_INLINE real FN(sum_of_sizes)(const real *x, int count)
{
    real sum = R(0.0);
    for (int i = 0; i < count; i++) sum += R_SELECT(R_MASK(x[i] < 0.0), -x[i], x[i]);
    return sum;
}

/* A bound on the sum of a row's partial velocities, without walking its path: a column's arm is no
 * longer than what lies between on the way. */
MECHC_ONCE real FN(most_partials)(const real *tree, real unit)
{
    real length[MECHC_LINKS_MAX], turning[MECHC_LINKS_MAX], sliding[MECHC_LINKS_MAX], most = R(0.0);
    (void)unit;
    for (int link = 0; link < MECHC_LINKS; link++) {
        const int parent = mechc_parent[link];
        length[link] = FN(sum_of_sizes)(tree + link * MECHC_ARM, MECHC_ARM);
        if (parent >= 0) length[link] += length[parent];
        turning[link] = parent >= 0 ? turning[parent] : R(0.0);
        sliding[link] = parent >= 0 ? sliding[parent] : R(0.0);
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            const real *column = tree + MECHC_AT_SUBSPACE + c * MECHC_DIM;
            const real turn = FN(sum_of_sizes)(column, MECHC_DIM - MECHC_ARM);
            const real slide = FN(sum_of_sizes)(column + MECHC_DIM - MECHC_ARM, MECHC_ARM);
            turning[link] += turn;
            sliding[link] += (MECHC_SLIDES_AT(MECHC_NQ + mechc_column_speed[c]) ? slide * unit : slide)
                           - turn * length[link];
        }
    }
    for (int i = 0; i < MECHC_NC; i++) {
        real sum = R(0.0);
        for (int pair = mechc_first_pair[i]; pair < mechc_first_pair[i + 1]; pair++) {
            const real *const ends = tree + MECHC_AT_CUT + pair * MECHC_CUT, *point = ends;
            const real force = FN(sum_of_sizes)(ends + 2 * MECHC_ARM, MECHC_ARM);
            const real moment = MECHC_MOMENTS
                                  ? FN(sum_of_sizes)(ends + 3 * MECHC_ARM, MECHC_DIM - MECHC_ARM)
                                  : R(0.0);
            for (int end = 0; end < 2; end++, point += MECHC_ARM) {
                const int link = mechc_cut[2 * pair + end];
                real arm[MECHC_ARM_MAX];
                if (link < 0) continue;
                FN(arm_to)(tree, link, point, arm);
                const real moves = sliding[link]
                                 + turning[link] * (length[link] + FN(sum_of_sizes)(arm, MECHC_ARM));
                sum += R_FMA(moves, force, turning[link] * moment);
            }
        }
        most = R_SELECT(R_MASK(sum > most), sum, most);
    }
    return most;
}
#endif

/* The functions that other scenes have as written-out equations; jacobian and mass may be NULL. */
MECHC_INLINE void FN(configuration)(real t, const real *q, const FN(given) *given, real *gap,
                                    real *jacobian, real *bias, real *mass, real *saved,
                                    real *turns, int near)
{
#if MECHC_NC_MAX > 0
    FN(tree_configuration)(t, q, given, gap, bias, saved, saved + MECHC_AT_SUBSPACE,
                           saved + MECHC_AT_INERTIA, saved + MECHC_AT_REFERENCE,
                           saved + MECHC_AT_CUT, saved + MECHC_AT_SAVED, turns, near);
    if (jacobian) FN(cut_rows)(saved, jacobian);
#else
    (void)jacobian, (void)bias;
    FN(tree_configuration)(t, q, given, gap, saved, saved + MECHC_AT_SUBSPACE,
                           saved + MECHC_AT_INERTIA, saved + MECHC_AT_SAVED, turns, near);
#endif
    if (mass) FN(composite_mass)(saved, mass);
}

MECHC_INLINE void FN(motion)(real t, const real *q, const real *u, const FN(given) *given,
                             const real *saved, real *forcing, real *gamma)
{
    real bias[MECHC_LINKS_MAX * MECHC_DIM_MAX], wrench[MECHC_LINKS_MAX * MECHC_DIM_MAX];
    FN(tree_motion)(t, q, u, given, saved + MECHC_AT_SAVED, bias, wrench, gamma);
    FN(take_bias)(saved, bias, wrench);
    FN(along_speeds)(saved, wrench, forcing);
}

/* Rows, mass matrix and forcing of the tree; any of the three may be NULL. */
MECHC_ONCE void FN(tree_terms)(real t, const real *q, const real *u, const FN(given) *given,
                               real *rows, real *mass, real *forcing)
{
    real saved[MECHC_SAVED_MAX], gap[MECHC_AT_LEAST_ONE(MECHC_NH_MAX)];
    real bias[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];
    real gamma[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];
    FN(configuration)(t, q, given, gap, rows, bias, mass, saved, 0, 0);
    if (forcing) FN(motion)(t, q, u, given, saved, forcing, gamma);
}

MECHC_INLINE void FN(output_mass_matrix)(real t, const real *q, const real *u,
                                         const FN(given) *given, real *out)
{
    FN(tree_terms)(t, q, u, given, 0, out, 0);
}

MECHC_INLINE void FN(output_forcing)(real t, const real *q, const real *u, const FN(given) *given,
                                     real *out)
{
    FN(tree_terms)(t, q, u, given, 0, 0, out);
}

#if MECHC_NC_MAX > 0
MECHC_INLINE void FN(output_constraint_jacobian)(real t, const real *q, const real *u,
                                                 const FN(given) *given, real *out)
{
    FN(tree_terms)(t, q, u, given, out, 0, 0);
}
#endif
#endif
#endif
