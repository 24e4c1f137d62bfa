/* Accelerations from M u' + J^T lambda = F and J u' = gamma; generic over `real`.
 *
 * Where few directions are free and no row is redundant, the motion is solved in them alone: the
 * rows leave NU - NC directions v, and v^T M v z = v^T (F - M a) with a any accelerations that
 * satisfy the rows.  M is not factored, and with one degree of freedom there is one division.
 * Elsewhere Gauss's principle: the accelerations nearest to the free ones in the metric M.  With
 * M = L D L^T a row a of J becomes w = a L^-T there and two rows meet in sum_k w_k v_k / D_k.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_MOTION_VECTOR : !defined MECHC_MOTION_SCALAR
#if R_VECTOR
#define MECHC_MOTION_VECTOR
#else
#define MECHC_MOTION_SCALAR
#endif
#include "dynamics/linear.h"
#include "dynamics/loops/one_freedom.h"

#if !MECHC_WALKED
/* Beyond so many free directions it is cheaper to factor M. */
#define MECHC_MOST_FREE 3
#define MECHC_REDUCED (MECHC_FREE >= 0 && MECHC_FREE <= MECHC_MOST_FREE)

typedef struct {
    const real *mass, *jacobian, *forcing, *gamma;
    real rank;   /* rows that count */
    real length; /* see ordinary_rows.h */
} FN(motion_terms);

/* y <- y - M x */
MECHC_INLINE void FN(take_inertia)(const real *mass, const real *x, real *y)
{
    for (int i = 0; i < MECHC_NU; i++)
        for (int j = 0; j < MECHC_NU; j++) R_SUB(y[i], mass[i * MECHC_NU + j], x[j]);
}

#if MECHC_NC_MAX > 0
/* Solve M x = F and the rows with it; lambda may be NULL. */
MECHC_INLINE void FN(solve_in_mass_metric)(const FN(motion_terms) *terms, real *x, real *lambda)
{
    FN(mass_factors) mass;
    FN(factors) rows;
    FN(factor_in_mass_metric)(terms->jacobian, terms->mass, MECHC_NC, terms->rank, &mass, &rows);
    FN(solve_in_metric)(&rows, &mass, terms->jacobian, terms->forcing, terms->gamma, x, lambda);
}

#if !MECHC_ONE_FREEDOM
/* Beside a crossing, states and errors are projected in the metric of the mass matrix: there the
 * closure's rounding is magnified into reactions M^-1 J^T, and only this metric takes all of them
 * away again; any other turns a part of them into motion and energy. */
#define MECHC_BESIDE_CROSSING 0.2

MECHC_ONCE __attribute__((cold)) void FN(least_work)(const real *mass, const real *jacobian,
                                                     real rank, const real *values, real *step)
{
    real none[MECHC_NU_MAX];
    for (int i = 0; i < MECHC_NU; i++) none[i] = R(0.0);
    const FN(motion_terms) terms = {mass, jacobian, none, values, rank, R(1.0)};
    FN(solve_in_mass_metric)(&terms, step, 0);
}
#endif

MECHC_ONCE __attribute__((cold)) void FN(solve_redundant)(const real *terms, real *solution)
{
    const real *jacobian = terms + MECHC_NU * MECHC_NU, *forcing = jacobian + MECHC_NC * MECHC_NU;
    const real *gamma = forcing + MECHC_NU;
    const FN(motion_terms) split = {terms, jacobian, forcing, gamma, gamma[MECHC_NC], R(1.0)};
    FN(solve_in_mass_metric)(&split, solution, MECHC_MULTIPLIERS ? solution + MECHC_NU : 0);
}

/* Solve again in the given lanes.  Works on copies: an array whose address is passed on would be
 * kept in memory on the usual path too. */
MECHC_INLINE void FN(redundant_motion)(const FN(motion_terms) *terms, rmask lanes, real *x,
                                       real *lambda)
{
    real copy[(MECHC_NU_MAX + MECHC_NC_MAX) * (MECHC_NU_MAX + 1) + 1], *to = copy;
    real solution[MECHC_NU_MAX + MECHC_NC_MAX];
    for (int i = 0; i < MECHC_NU * MECHC_NU; i++) *to++ = terms->mass[i];
    for (int i = 0; i < MECHC_NC * MECHC_NU; i++) *to++ = terms->jacobian[i];
    for (int i = 0; i < MECHC_NU; i++) *to++ = terms->forcing[i];
    for (int i = 0; i < MECHC_NC; i++) *to++ = terms->gamma[i];
    *to = terms->rank;
    FN(solve_redundant)(copy, solution);
    for (int i = 0; i < MECHC_NU; i++) x[i] = R_SELECT(lanes, solution[i], x[i]);
    for (int i = 0; MECHC_MULTIPLIERS && lambda && i < MECHC_NC; i++)
        lambda[i] = R_SELECT(lanes, solution[MECHC_NU + i], lambda[i]);
}

/* A basis of all speeds' duals: the orthogonal rows, then unit vectors less their part in what
 * comes before them. */
typedef struct {
    real vectors[MECHC_NU_MAX * MECHC_NU_MAX], inverse_norm[MECHC_NU_MAX];
    real left[MECHC_NU_MAX]; /* squared share of each unit vector that is in none of them yet */
} FN(basis);

/* Put the unit vector of which most is left at place i; part[j] is its part in vector j < i. */
MECHC_INLINE void FN(pick)(const FN(factors) *f, FN(basis) *basis, int i, real *part)
{
    real *unit = basis->vectors + i * MECHC_NU, most = basis->left[0];
    for (int j = 0; j < i; j++) part[j] = basis->vectors[j * MECHC_NU] * f->weight[0];
    for (int k = 0; k < MECHC_NU; k++) unit[k] = R(k == 0);
    for (int k = 1; k < MECHC_NU; k++) {
        const rmask more = R_MASK(basis->left[k] > most);
        most = R_SELECT(more, basis->left[k], most);
        for (int j = 0; j < i; j++)
            part[j] = R_SELECT(more, basis->vectors[j * MECHC_NU + k] * f->weight[k], part[j]);
        for (int m = 0; m < k; m++) unit[m] = R_SELECT(more, R(0.0), unit[m]);
        unit[k] = R_SELECT(more, R(1.0), unit[k]);
    }
    for (int j = 0; j < i; j++) part[j] *= basis->inverse_norm[j];
}

MECHC_INLINE void FN(take_share)(const FN(factors) *f, FN(basis) *basis, int i)
{
    const real *vector = basis->vectors + i * MECHC_NU;
    for (int k = 0; k < MECHC_NU; k++)
        R_SUB(basis->left[k], vector[k] * vector[k], f->weight[k] * basis->inverse_norm[i]);
}

/* Directions in which no row changes. */
MECHC_INLINE void FN(free_directions)(const FN(factors) *f, real *directions)
{
    FN(basis) basis;
    real part[MECHC_NU_MAX];
    for (int k = 0; k < MECHC_NU; k++) basis.left[k] = R(1.0);
    for (int i = 0; i < MECHC_NC * MECHC_NU; i++) basis.vectors[i] = f->rows[i];
    for (int i = 0; i < MECHC_NC; i++) {
        basis.inverse_norm[i] = f->inverse_norm[i];
        FN(take_share)(f, &basis, i);
    }
    for (int i = MECHC_NC; i < MECHC_NU; i++) {
        real *vector = basis.vectors + i * MECHC_NU;
        FN(pick)(f, &basis, i, part);
        for (int j = 0; j < i; j++)
            for (int k = 0; k < MECHC_NU; k++)
                R_SUB(vector[k], part[j], basis.vectors[j * MECHC_NU + k]);
        for (int k = 0; k < MECHC_NU; k++)
            directions[(i - MECHC_NC) * MECHC_NU + k] = vector[k] * f->weight[k];
        if (i + 1 == MECHC_NU) break;
        basis.inverse_norm[i] = 1.0 / FN(inner)(f, vector, vector);
        FN(take_share)(f, &basis, i);
    }
}

/* values[i] = v_i . x */
MECHC_INLINE void FN(along)(const real *directions, const real *x, real *values)
{
    for (int i = 0; i < MECHC_FREE; i++) values[i] = FN(dot)(directions + i * MECHC_NU, x);
}

/* v^T M v */
MECHC_INLINE void FN(reduced_mass)(const real *mass, const real *directions, real *reduced)
{
    for (int i = 0; i < MECHC_FREE; i++) {
        real momentum[MECHC_NU_MAX];
        for (int k = 0; k < MECHC_NU; k++)
            momentum[k] = FN(dot)(mass + k * MECHC_NU, directions + i * MECHC_NU);
        FN(along)(directions, momentum, reduced + i * MECHC_FREE);
    }
}

/* The multiples of the orthogonal rows whose sum is the reaction F - M u'. */
MECHC_INLINE void FN(reactions)(const FN(motion_terms) *terms, const FN(factors) *f, const real *x,
                                real *lambda)
{
    real reaction[MECHC_NU_MAX], multiples[MECHC_NC_MAX];
    for (int k = 0; k < MECHC_NU; k++) reaction[k] = terms->forcing[k];
    FN(take_inertia)(terms->mass, x, reaction);
    for (int i = 0; i < MECHC_NC; i++)
        multiples[i] = FN(inner)(f, f->rows + i * MECHC_NU, reaction) * f->inverse_norm[i];
    FN(multipliers)(f, multiples, lambda);
}

#if !MECHC_ONE_FREEDOM
MECHC_INLINE void FN(solve_reduced)(const FN(motion_terms) *terms, const FN(factors) *f, real *x,
                                    real *lambda)
{
    real directions[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX) * MECHC_NU_MAX];
    real reduced[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX * MECHC_FREE_MAX)], free_part[MECHC_NU_MAX];
    real forces[MECHC_NU_MAX];
    FN(mass_factors) mass;
    FN(free_directions)(f, directions);
    FN(reduced_mass)(terms->mass, directions, reduced);
    FN(factor_mass)(reduced, MECHC_FREE, &mass);
    FN(least_change)(f, MECHC_NC, terms->gamma, x);
    for (int k = 0; k < MECHC_NU; k++) forces[k] = terms->forcing[k];
    FN(take_inertia)(terms->mass, x, forces);
    FN(along)(directions, forces, free_part);
    FN(forward)(&mass, MECHC_FREE, free_part);
    FN(backward)(&mass, MECHC_FREE, free_part);
    for (int i = 0; i < MECHC_FREE; i++)
        for (int k = 0; k < MECHC_NU; k++) R_ADD(x[k], free_part[i], directions[i * MECHC_NU + k]);
    if (lambda) FN(reactions)(terms, f, x, lambda);
}
#endif
#endif

#if MECHC_ONE_FREEDOM
typedef FN(freedom) FN(solver);

/* The factors with which the rows of a configuration are solved, of which `rank` count; those
 * below the squared share `least` of the longest are redundant, 0: none are. */
MECHC_INLINE void FN(prepare_rows)(const real *jacobian, const real *mass, real length,
                                   real rank, real ordinary, double least, FN(solver) *f)
{
    (void)ordinary;
    FN(find_freedom)(jacobian, mass, length, rank, least, f);
}

/* Squared length of the shortest orthogonal row over that of the longest: 0 where rows are
 * dependent. */
MECHC_INLINE real FN(conditioning_squared)(const real *jacobian, const real *mass, real length,
                                           real ordinary, const FN(solver) *f)
{
    (void)jacobian;
    return FN(freedom_conditioning_squared)(f, mass, length, ordinary);
}

MECHC_INLINE void FN(solve_motion)(const FN(motion_terms) *terms, const FN(solver) *f, real *x,
                                   real *lambda)
{
    FN(along_freedom)(f, terms->gamma, FN(dot)(f->direction, terms->forcing), x);
    if (lambda) {
        FN(factors) rows;
        FN(factor_rows)(terms->jacobian, terms->mass, terms->length, MECHC_NC, terms->rank, &rows);
        FN(reactions)(terms, &rows, x, lambda);
    }
    if (__builtin_expect(R_ANY(f->redundant), 0))
        FN(redundant_motion)(terms, f->redundant, x, lambda);
}

MECHC_ONCE __attribute__((cold)) void FN(least_redundant_step)(const real *jacobian,
                                                               const real *mass, real length,
                                                               real rank, const real *values,
                                                               real *step)
{
    FN(factors) rows;
    FN(factor_rows)(jacobian, mass, length, MECHC_NC, rank, &rows);
    FN(least_change)(&rows, MECHC_NC, values, step);
}

/* The least change, in the metric of the mass matrix, that gives every row the value wanted. */
MECHC_INLINE void FN(least_step)(const real *jacobian, const real *mass, const FN(solver) *f,
                                 const real *values, real *step)
{
    FN(along_freedom)(f, values, R(0.0), step);
    if (__builtin_expect(R_ANY(f->redundant), 0)) {
        real copy[(MECHC_NC_MAX + MECHC_NU_MAX) * MECHC_NU_MAX + MECHC_NC_MAX], other[MECHC_NU_MAX];
        memcpy(copy, jacobian, MECHC_NC * MECHC_NU * sizeof *copy);
        memcpy(copy + MECHC_NC * MECHC_NU, mass, MECHC_NU * MECHC_NU * sizeof *copy);
        memcpy(copy + (MECHC_NC + MECHC_NU) * MECHC_NU, values, MECHC_NC * sizeof *copy);
        FN(least_redundant_step)(copy, copy + MECHC_NC * MECHC_NU, f->length, f->rank,
                                 copy + (MECHC_NC + MECHC_NU) * MECHC_NU, other);
        for (int i = 0; i < MECHC_NU; i++) step[i] = R_SELECT(f->redundant, other[i], step[i]);
    }
}
#elif MECHC_NC_MAX > 0
/* The least change by the orthogonal factors. */
MECHC_INLINE void FN(solve_orthogonal)(const FN(motion_terms) *terms, const FN(factors) *f, real *x,
                                       real *lambda)
{
    if (!MECHC_REDUCED) {
        FN(solve_in_mass_metric)(terms, x, lambda);
        return;
    }
    const rmask redundant = FN(redundant)(f);
    FN(solve_reduced)(terms, f, x, lambda);
    if (__builtin_expect(R_ANY(redundant), 0)) FN(redundant_motion)(terms, redundant, x, lambda);
}

/* The least change that gives every row the value wanted. */
MECHC_INLINE void FN(least_orthogonal_step)(const real *jacobian, const real *mass,
                                            const FN(factors) *f, const real *values, real *step)
{
    const rmask beside =
        R_MASK(FN(least_singular_squared)(f, R(0.0)) < MECHC_BESIDE_CROSSING * MECHC_BESIDE_CROSSING)
        & ~FN(lost_rank)(f);
    FN(least_change)(f, MECHC_NC, values, step);
    if (__builtin_expect(R_ANY(beside), 0)) {
        real other[MECHC_NU_MAX];
        FN(least_work)(mass, jacobian, f->rank, values, other);
        for (int i = 0; i < MECHC_NU; i++) step[i] = R_SELECT(beside, other[i], step[i]);
    }
}

#if !MECHC_BLOCKS_CODE
typedef FN(factors) FN(solver);

MECHC_INLINE void FN(prepare_rows)(const real *jacobian, const real *mass, real length,
                                   real rank, real ordinary, double least, FN(solver) *f)
{
    (void)ordinary, (void)least;
    FN(factor_rows)(jacobian, mass, length, MECHC_NC, rank, f);
}

MECHC_INLINE real FN(conditioning_squared)(const real *jacobian, const real *mass, real length,
                                           real ordinary, const FN(solver) *f)
{
    (void)jacobian, (void)mass, (void)length;
    return FN(least_singular_squared)(f, ordinary);
}

MECHC_INLINE void FN(solve_motion)(const FN(motion_terms) *terms, const FN(solver) *f, real *x,
                                   real *lambda)
{
    FN(solve_orthogonal)(terms, f, x, lambda);
}

MECHC_INLINE void FN(least_step)(const real *jacobian, const real *mass, const FN(solver) *f,
                                 const real *values, real *step)
{
    FN(least_orthogonal_step)(jacobian, mass, f, values, step);
}
#endif
#endif
#endif
#endif
