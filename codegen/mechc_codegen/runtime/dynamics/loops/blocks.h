/* Rows of loops whose Jacobian is block-triangular: they are eliminated block by block, in an order
 * that is fixed when the scene is compiled (block_elimination.py); generic over `real`.
 *
 * With n the free directions and a any x on which the rows take the values v,
 *     x = a + n z,   n^T M n z = n^T (F - M a):
 * accelerations with the forces F, and with F = 0 the least change in the metric of the mass matrix.
 *
 * A set of dependent speeds may become a bad one along the motion though J is not, and near a
 * critical configuration every set is.  Lanes where this shows are solved by the orthogonal factors
 * of linear.h.  It shows in
 *     a row that is short beside the longest, or beside what that has at ordinary configurations,
 *     the sine between the columns of a square block, or between the rows of another one,
 *     the share of a free direction that lies in its own block: where this is small the blocks after
 *     it move far by a small move of its own, and a and n z cancel.
 * Rounding is magnified by the inverse of sine and share, three times at most.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_BLOCK_MOTION_VECTOR : !defined MECHC_BLOCK_MOTION_SCALAR
#if R_VECTOR
#define MECHC_BLOCK_MOTION_VECTOR
#else
#define MECHC_BLOCK_MOTION_SCALAR
#endif
#include "dynamics/linear.h"
#include "dynamics/motion.h"
#include "scene_program.h"

#if MECHC_BLOCKS_CODE
#define MECHC_DIRECTIONS_MAX (MECHC_AT_LEAST_ONE(MECHC_FREE_MAX) * MECHC_NU_MAX)

typedef struct {
    real kept[MECHC_AT_LEAST_ONE(MECHC_BLOCKS_KEPT_MAX)];
    real directions[MECHC_DIRECTIONS_MAX], momenta[MECHC_DIRECTIONS_MAX]; /* n and M n */
    FN(mass_factors) reduced; /* n^T M n */
    real longest;    /* squared length of the longest row, speeds weighted by the mass each moves */
    rmask apart;     /* the lanes in which rows are eliminated block by block */
    rmask clear;     /* of these, those far from all critical configurations */
    int together;    /* some other lane needs the factors */
    FN(factors) factors;
} FN(solver);

MECHC_ONCE void FN(factor_together)(const real *jacobian, const real *mass, real length, real rank,
                                    FN(factors) *f)
{
    FN(factor_rows)(jacobian, mass, length, MECHC_NC, rank, f);
}

/* The lanes in which no row is short; sets f->longest. */
MECHC_INLINE rmask FN(long_rows)(const real *lengths, real ordinary, FN(solver) *f)
{
    real shortest = f->longest = lengths[0];
    for (int i = 1; i < MECHC_NC; i++) {
        shortest = R_SELECT(R_MASK(lengths[i] < shortest), lengths[i], shortest);
        f->longest = FN(larger)(f->longest, lengths[i]);
    }
    return R_MASK(shortest > MECHC_SAFE_LENGTH * FN(larger)(f->longest, ordinary));
}

/* Factor n^T M n; returns the lanes in which enough of every direction lies in its own block. */
MECHC_INLINE rmask FN(reduce_mass)(const real *own, FN(solver) *f)
{
    rmask safe = R_MASK(R(0.0) == R(0.0));
    real reduced[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX * MECHC_FREE_MAX)];
    for (int i = 0; i < MECHC_FREE; i++) {
        FN(along)(f->momenta, f->directions + i * MECHC_NU, reduced + i * MECHC_FREE);
        safe &= R_MASK(own[i] > MECHC_SAFE_SINE * reduced[i * MECHC_FREE + i]);
    }
    FN(factor_mass)(reduced, MECHC_FREE, &f->reduced);
    return safe;
}

MECHC_INLINE void FN(prepare_rows)(const real *jacobian, const real *mass, real length,
                                   real rank, real ordinary, double least, FN(solver) *f)
{
    real weight[MECHC_NU_MAX], lengths[MECHC_NC_MAX], own[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX)];
    (void)least;
    if (MECHC_ROW_BLOCKS == 0) {
        FN(factor_rows)(jacobian, mass, length, MECHC_NC, rank, &f->factors);
        f->apart = R_MASK(R(0.0) > R(0.0));
        f->together = 1;
        return;
    }
    FN(speed_weights)(mass, length, weight);
    f->apart = FN(factor_blocks)(jacobian, mass, weight, f->kept, f->directions, f->momenta, own,
                                 lengths, &f->clear)
             & R_MASK(rank >= (double)MECHC_NC);
    f->apart &= FN(long_rows)(lengths, ordinary, f);
    f->apart &= FN(reduce_mass)(own, f);
    f->clear &= f->apart;
    f->together = R_ANY(~f->apart);
    if (__builtin_expect(f->together, 0)) FN(factor_together)(jacobian, mass, length, rank, &f->factors);
}

/* a <- a + n z */
MECHC_INLINE void FN(add_free_part)(const FN(solver) *f, const real *forcing, real *x)
{
    real part[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX)], taken[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX)];
    FN(along)(f->momenta, x, taken);
    if (forcing) FN(along)(f->directions, forcing, part);
    for (int i = 0; i < MECHC_FREE; i++) part[i] = forcing ? part[i] - taken[i] : -taken[i];
    FN(forward)(&f->reduced, MECHC_FREE, part);
    FN(backward)(&f->reduced, MECHC_FREE, part);
    for (int i = 0; i < MECHC_FREE; i++)
        for (int k = 0; k < MECHC_NU; k++) R_ADD(x[k], part[i], f->directions[i * MECHC_NU + k]);
}

/* Make the free directions orthogonal in the metric of the masses D moved, as D n, with 1 / (n.D n). */
MECHC_INLINE void FN(free_axes)(const FN(solver) *f, const real *moved, real *axes, real *inverse)
{
    for (int i = 0; i < MECHC_FREE; i++) {
        const real *direction = f->directions + i * MECHC_NU;
        real *axis = axes + i * MECHC_NU;
        for (int k = 0; k < MECHC_NU; k++) axis[k] = direction[k] * moved[k];
        for (int j = 0; j < i; j++) {
            const real share = FN(dot)(direction, axes + j * MECHC_NU) * inverse[j];
            for (int k = 0; k < MECHC_NU; k++) R_SUB(axis[k], share, axes[j * MECHC_NU + k]);
        }
        inverse[i] = 1.0 / FN(dot)(direction, axis);
    }
}

/* Squared distance of the row nearest to the others' span over the longest row's length: a row's
 * distance is the inverse of the least change by which it alone takes the value 1. */
MECHC_INLINE real FN(conditioning_squared)(const real *jacobian, const real *mass, real length,
                                           real ordinary, const FN(solver) *f)
{
    if (MECHC_ROW_BLOCKS == 0) return FN(least_singular_squared)(&f->factors, ordinary);
    real moved[MECHC_NU_MAX], axes[MECHC_DIRECTIONS_MAX], inverse[MECHC_AT_LEAST_ONE(MECHC_FREE_MAX)];
    FN(moved_masses)(mass, length, moved);
    FN(free_axes)(f, moved, axes, inverse);
    const real answer = FN(longest_answer)(jacobian, f->kept, moved, axes, inverse);
    const real square = 1.0 / (answer * FN(larger)(f->longest, ordinary));
    if (!__builtin_expect(f->together, 0)) return square;
    return R_SELECT(f->apart, square, FN(least_singular_squared)(&f->factors, ordinary));
}

/* Solve the terms of a motion by the orthogonal factors, where blocks do not serve. */
MECHC_ONCE void FN(solve_together)(const FN(motion_terms) *terms, const FN(factors) *f, real *x,
                                   real *lambda)
{
    FN(solve_orthogonal)(terms, f, x, lambda);
}

MECHC_INLINE void FN(solve_motion)(const FN(motion_terms) *terms, const FN(solver) *f, real *x,
                                   real *lambda)
{
    if (MECHC_ROW_BLOCKS == 0) {
        FN(solve_orthogonal)(terms, &f->factors, x, lambda);
        return;
    }
    FN(solve_blocks)(terms->jacobian, f->kept, terms->gamma, x);
    FN(add_free_part)(f, terms->forcing, x);
    if (lambda) {
        real reaction[MECHC_NU_MAX];
        for (int k = 0; k < MECHC_NU; k++) reaction[k] = terms->forcing[k];
        FN(take_inertia)(terms->mass, x, reaction);
        FN(block_multipliers)(terms->jacobian, f->kept, reaction, lambda);
    }
    if (!__builtin_expect(f->together, 0)) return;
    real other[MECHC_NU_MAX], others[MECHC_NC_MAX];
    FN(solve_together)(terms, &f->factors, other, lambda ? others : 0);
    for (int k = 0; k < MECHC_NU; k++) x[k] = R_SELECT(f->apart, x[k], other[k]);
    for (int i = 0; lambda && i < MECHC_NC; i++)
        lambda[i] = R_SELECT(f->apart, lambda[i], others[i]);
}

MECHC_ONCE void FN(least_step_together)(const real *jacobian, const real *mass,
                                        const FN(factors) *f, const real *values, real *step)
{
    FN(least_orthogonal_step)(jacobian, mass, f, values, step);
}

/* The least change, in the metric of the mass matrix, that gives every row the value wanted. */
MECHC_INLINE void FN(least_step)(const real *jacobian, const real *mass, const FN(solver) *f,
                                 const real *values, real *step)
{
    if (MECHC_ROW_BLOCKS == 0) {
        FN(least_orthogonal_step)(jacobian, mass, &f->factors, values, step);
        return;
    }
    FN(solve_blocks)(jacobian, f->kept, values, step);
    FN(add_free_part)(f, 0, step);
    if (!__builtin_expect(f->together, 0)) return;
    real other[MECHC_NU_MAX];
    FN(least_step_together)(jacobian, mass, &f->factors, values, other);
    for (int k = 0; k < MECHC_NU; k++) step[k] = R_SELECT(f->apart, step[k], other[k]);
}
#endif
#endif
