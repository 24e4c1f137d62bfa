/* The functions of a scene that the general unit calls, over `real`: result, name, parameters, arguments.
 *
 * Those that only scenes of some kinds have are in lists of their own. */
#pragma once

#define MECHC_WRITTEN_OUT(X) \
    X(void, configuration, \
      (real t, const real *q, const FN(given) *given, real *gap, real *jacobian, real *bias, real *mass, \
       real *saved, real *turns, int near), \
      (t, q, given, gap, jacobian, bias, mass, saved, turns, near)) \
    X(void, motion, \
      (real t, const real *q, const real *u, const FN(given) *given, const real *saved, real *forcing, \
       real *gamma), \
      (t, q, u, given, saved, forcing, gamma))

#define MECHC_TREES(X) \
    X(void, tree_configuration, \
      (real t, const real *q, const FN(given) *given, real *gap, real *offset, real *subspace, real *inertia, \
       real *saved, real *turns, int near), \
      (t, q, given, gap, offset, subspace, inertia, saved, turns, near)) \
    MECHC_MOTION_OF_TREES(X)
#define MECHC_TREES_WITH_ROWS(X) \
    X(void, tree_configuration, \
      (real t, const real *q, const FN(given) *given, real *gap, real *bias, real *offset, real *subspace, \
       real *inertia, real *reference, real *cut, real *saved, real *turns, int near), \
      (t, q, given, gap, bias, offset, subspace, inertia, reference, cut, saved, turns, near)) \
    MECHC_MOTION_OF_TREES(X)
#define MECHC_MOTION_OF_TREES(X) \
    X(void, tree_motion, \
      (real t, const real *q, const real *u, const FN(given) *given, const real *saved, real *bias, \
       real *wrench, real *gamma), \
      (t, q, u, given, saved, bias, wrench, gamma))
#if !MECHC_KIND_WALKED
#define MECHC_ALL_SCENES(X) MECHC_WRITTEN_OUT(X)
#elif MECHC_KIND_ROWS
#define MECHC_ALL_SCENES(X) MECHC_TREES_WITH_ROWS(X)
#else
#define MECHC_ALL_SCENES(X) MECHC_TREES(X)
#endif

#define MECHC_GAPS(X) \
    X(void, hoist, (const real *p, real *k), (p, k))

#define MECHC_GAPS_OF_LOOPS(X) MECHC_OF_STATE(X, constraints)

/* Y(X, name) of each function of a state, and of those with the accelerations and multipliers; all but the
 * first three are of scenes whose motions have derivatives. */
#define MECHC_FUNCTIONS_OF_STATE(Y, X) \
    Y(X, coordinate_rates) Y(X, kinematic_matrix) Y(X, switching) \
    Y(X, rate_by_state) Y(X, rate_by_parameters) Y(X, rate_by_inputs) \
    MECHC_ROWS_OF_STATE(Y, X) Y(X, velocity_gradient) Y(X, constraint_gradient) \
    Y(X, constraints_by_parameters) Y(X, constraints_by_inputs) \
    Y(X, velocity_constraints_by_parameters) Y(X, velocity_constraints_by_inputs)
#if MECHC_KIND_WALKED /* which finds them by the tree */
#define MECHC_ROWS_OF_STATE(Y, X)
#else
#define MECHC_ROWS_OF_STATE(Y, X) Y(X, constraint_jacobian)
#endif
#define MECHC_FUNCTIONS_OF_MOTION(Y, X) \
    Y(X, residual_by_state) Y(X, residual_by_parameters) Y(X, residual_by_inputs)
#define MECHC_OF_STATE(X, name) \
    X(void, output_##name, \
      (real t, const real *q, const real *u, const FN(given) *given, real *out), (t, q, u, given, out))
#define MECHC_OF_MOTION(X, name) \
    X(void, solved_##name, \
      (real t, const real *q, const real *u, const FN(given) *given, const real *a, const real *l, real *out), \
      (t, q, u, given, a, l, out))
#define MECHC_OF_STATES(X) \
    MECHC_FUNCTIONS_OF_STATE(MECHC_OF_STATE, X) MECHC_FUNCTIONS_OF_MOTION(MECHC_OF_MOTION, X) \
    X(void, solved_residual_adjoint, \
      (real t, const real *q, const real *u, const FN(given) *given, const real *a, const real *l, const real *c, \
       real *out), \
      (t, q, u, given, a, l, c, out))

#define MECHC_BLOCKS_OF_ROWS(X) \
    X(rmask, factor_blocks, \
      (const real *jacobian, const real *mass, const real *weight, real *kept, real *directions, \
       real *momenta, real *own, real *lengths, rmask *clear), \
      (jacobian, mass, weight, kept, directions, momenta, own, lengths, clear)) \
    X(void, solve_blocks, (const real *jacobian, const real *kept, const real *values, real *x), \
      (jacobian, kept, values, x)) \
    X(real, longest_answer, \
      (const real *jacobian, const real *kept, const real *moved, const real *axes, const real *inverse), \
      (jacobian, kept, moved, axes, inverse)) \
    X(void, block_multipliers, \
      (const real *jacobian, const real *kept, const real *reaction, real *lambda), \
      (jacobian, kept, reaction, lambda)) \
    X(void, rates_in_blocks, (const real *jacobian, const real *x, real *rates), (jacobian, x, rates))

#define MECHC_OF_SCENE __attribute__((visibility("hidden")))
