/* The functions that the general unit calls of a scene, by its tapes; generic over `real`. */
#include "simd/real.h"
#if R_EXTENDED ? !defined MECHC_TAPE_FUNCTIONS_EXTENDED \
    : R_VECTOR ? !defined MECHC_TAPE_FUNCTIONS_VECTOR : !defined MECHC_TAPE_FUNCTIONS_SCALAR
#if R_EXTENDED
#define MECHC_TAPE_FUNCTIONS_EXTENDED
#elif R_VECTOR
#define MECHC_TAPE_FUNCTIONS_VECTOR
#else
#define MECHC_TAPE_FUNCTIONS_SCALAR
#endif
#include "general/called.h"
#if !R_EXTENDED
#include "dynamics/given.h"
#endif
#include "tape/run.h"
#if MECHC_TAPES_OF_SERIES
#include "tape/series.h"
#endif

/* The head of a function of the scene. */
#define MECHC_TAPE_DECLARE(result, name, parameters, arguments) \
    extern MECHC_OF_SCENE result FN(scene_##name) parameters;
MECHC_GAPS(MECHC_TAPE_DECLARE)
MECHC_GAPS_OF_LOOPS(MECHC_TAPE_DECLARE)

#define MECHC_TAPE_CALLED(name) mechc_of_tapes.called[MECHC_TAPE_OF_##name]
#define MECHC_TAPE_BY_NAME(name) mechc_of_tapes.named[MECHC_TAPE_NAMED_##name]

/* A function of a state into `out`, by a tape of the scene's outputs. */
MECHC_INLINE void FN(tape_output)(int tape, real t, const real *q, const real *u, const FN(given) *given,
                                  const real *a, const real *l, real *out)
{
    real *arrays[] = {(real *)q, (real *)u, (real *)given->p, (real *)given->k, out, (real *)a, (real *)l};
    FN(run_tape)(&mechc_of_tapes.code, tape, arrays, &t, given, 0, 0);
}

void FN(scene_hoist)(const real *p, real *k)
{
    real *arrays[] = {(real *)p, k}, none = R(0.0);
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(hoist), arrays, &none, 0, 0, 0);
}

/* A function of the scene that is one of its outputs by name. */
#define MECHC_TAPE_OF_STATE(_, name)                                                                   \
    void FN(scene_output_##name)(real t, const real *q, const real *u, const FN(given) *given, real *out) \
    {                                                                                                 \
        FN(tape_output)(MECHC_TAPE_BY_NAME(name), t, q, u, given, 0, 0, out);                         \
    }
#define MECHC_TAPE_OF_MOTION(_, name)                                                                  \
    void FN(scene_solved_##name)(real t, const real *q, const real *u, const FN(given) *given,        \
                                 const real *a, const real *l, real *out)                             \
    {                                                                                                 \
        FN(tape_output)(MECHC_TAPE_BY_NAME(name), t, q, u, given, a, l, out);                         \
    }
MECHC_TAPE_OF_STATE(, constraints)

#if !R_EXTENDED
MECHC_ALL_SCENES(MECHC_TAPE_DECLARE)
MECHC_OF_STATES(MECHC_TAPE_DECLARE)

#if MECHC_KIND_WALKED
void FN(scene_tree_configuration)(real t, const real *q, const FN(given) *given, real *gap,
#if MECHC_KIND_ROWS
                                  real *bias,
#endif
                                  real *offset, real *subspace, real *inertia,
#if MECHC_KIND_ROWS
                                  real *reference, real *cut,
#endif
                                  real *saved, real *turns, int near)
{
#if !MECHC_KIND_ROWS
    real *const bias = 0, *const reference = 0, *const cut = 0;
#endif
    real *arrays[] = {(real *)q, (real *)given->p, (real *)given->k, gap, bias, offset, subspace, inertia,
                      reference, cut, saved};
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(tree_configuration), arrays, &t, given, turns, near);
}

void FN(scene_tree_motion)(real t, const real *q, const real *u, const FN(given) *given, const real *saved,
                           real *bias, real *wrench, real *gamma)
{
    real *arrays[] = {(real *)q, (real *)u, (real *)given->p, (real *)given->k, (real *)saved, bias, wrench,
                      gamma};
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(tree_motion), arrays, &t, given, 0, 0);
}
#else
void FN(scene_configuration)(real t, const real *q, const FN(given) *given, real *gap, real *jacobian,
                             real *bias, real *mass, real *saved, real *turns, int near)
{
    real *arrays[] = {(real *)q, (real *)given->p, (real *)given->k, gap, jacobian, bias, mass, saved};
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(configuration), arrays, &t, given, turns, near);
}

void FN(scene_motion)(real t, const real *q, const real *u, const FN(given) *given, const real *saved,
                      real *forcing, real *gamma)
{
    real *arrays[] = {(real *)q, (real *)u, (real *)given->p, (real *)given->k, (real *)saved, forcing, gamma};
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(motion), arrays, &t, given, 0, 0);
}

#endif

MECHC_FUNCTIONS_OF_STATE(MECHC_TAPE_OF_STATE, )
MECHC_FUNCTIONS_OF_MOTION(MECHC_TAPE_OF_MOTION, )

void FN(scene_solved_residual_adjoint)(real t, const real *q, const real *u, const FN(given) *given, const real *a,
                                       const real *l, const real *c, real *out)
{
    real *arrays[] = {(real *)q, (real *)u, (real *)given->p, (real *)given->k, out, (real *)a, (real *)l, (real *)c};
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_BY_NAME(residual_adjoint), arrays, &t, given, 0, 0);
}

#if MECHC_BLOCKS_CODE
MECHC_BLOCKS_OF_ROWS(MECHC_TAPE_DECLARE)

rmask FN(scene_factor_blocks)(const real *jacobian, const real *mass, const real *weight, real *kept,
                              real *directions, real *momenta, real *own, real *lengths, rmask *clear)
{
    real cleared = R(0.0), none = R(0.0);
    real *arrays[] = {(real *)jacobian, (real *)mass, (real *)weight, kept, directions, momenta, own, lengths,
                      &cleared};
    const real safe = FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(factor_blocks), arrays, &none, 0, 0, 0);
    *clear = R_BITS(cleared);
    return R_BITS(safe);
}

void FN(scene_solve_blocks)(const real *jacobian, const real *kept, const real *values, real *x)
{
    real *arrays[] = {(real *)jacobian, (real *)kept, (real *)values, x}, none = R(0.0);
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(solve_blocks), arrays, &none, 0, 0, 0);
}

real FN(scene_longest_answer)(const real *jacobian, const real *kept, const real *moved, const real *axes,
                              const real *inverse)
{
    real *arrays[] = {(real *)jacobian, (real *)kept, (real *)moved, (real *)axes, (real *)inverse};
    const real none = R(0.0);
    return FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(longest_answer), arrays, &none, 0, 0, 0);
}

void FN(scene_block_multipliers)(const real *jacobian, const real *kept, const real *reaction, real *lambda)
{
    real *arrays[] = {(real *)jacobian, (real *)kept, (real *)reaction, lambda}, none = R(0.0);
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(block_multipliers), arrays, &none, 0, 0, 0);
}

void FN(scene_rates_in_blocks)(const real *jacobian, const real *x, real *rates)
{
    real *arrays[] = {(real *)jacobian, (real *)x, rates}, none = R(0.0);
    FN(run_tape)(&mechc_of_tapes.code, MECHC_TAPE_CALLED(rates_in_blocks), arrays, &none, 0, 0, 0);
}
#endif

#if MECHC_TAPES_OF_SERIES && !R_VECTOR
void mechc_scalar_series_start(double t, const double *q, const double *u, const mechc_scalar_given *given,
                               double *kept, double *row, double *rates)
{
    double *arrays[] = {(double *)q, (double *)u, (double *)given->p, (double *)given->k, kept, row, rates};
    mechc_scalar_run_tape(&mechc_of_tapes.code, MECHC_TAPE_CALLED(series_start), arrays, &t, given, 0, 0);
}

void mechc_scalar_series_next(double order, double inverse, double time, const mechc_scalar_given *given,
                              const double *kept, const double *sums, double *row, double *rates)
{
    const double scalars[] = {order, inverse, time};
    double *arrays[] = {(double *)given->p, (double *)given->k, (double *)kept, (double *)sums, row, rates};
    mechc_scalar_run_tape(&mechc_of_tapes.code, MECHC_TAPE_CALLED(series_next), arrays, scalars, given, 0, 0);
}

void mechc_scalar_series_solve(const mechc_scalar_given *given, const double *kept, const double *sums,
                               double *row)
{
    const double none = 0.0;
    double *arrays[] = {(double *)given->p, (double *)given->k, (double *)kept, (double *)sums, row};
    mechc_scalar_run_tape(&mechc_of_tapes.code, MECHC_TAPE_CALLED(series_solve), arrays, &none, given, 0, 0);
}
#endif
#endif
#undef MECHC_TAPE_DECLARE
#undef MECHC_TAPE_CALLED
#undef MECHC_TAPE_BY_NAME
#undef MECHC_TAPE_OF_STATE
#undef MECHC_TAPE_OF_MOTION
#endif
