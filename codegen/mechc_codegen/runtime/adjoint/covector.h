/* A covector on its way back over the steps of a run. */
#pragma once

#include "variational/vary.h"
#include "simd/bind_scalar.h"
#include "adjoint/pullback.h"
#include "simd/bind_vector.h"
#include "adjoint/pullback.h"
#include "simd/unbind.h"

#if MECHC_VARIATIONAL
/* Data of the current steps: the rule of their method, and the states at their stages. */
typedef struct {
    mechc_given_twice given;
    mechc_rule rules[2]; /* by their numbers */
    mechc_varying *blocks; /* work space where Jacobians are needed, or NULL */
    double t[MECHC_MOST_RATES * MECHC_LANES], y[MECHC_MOST_RATES * MECHC_LANES * MECHC_NX_MAX];
    mechc_nodes_at_hand nodes;
    mechc_mask kept; /* of the steps of a pair */
    double ends[MECHC_LANES]; /* times */
    mechc_vector tangents[MECHC_AT_LEAST_ONE(MECHC_NC_MAX > 0 ? MECHC_NX_MAX * MECHC_SLOPES_MAX : 0)];
    mechc_scalar_solved_state one;
    mechc_vector_solved_state lanes[MECHC_BLOCKS];
    mechc_vector gathered[MECHC_AT_LEAST_ONE(MECHC_NB_MAX)][MECHC_EIGHT]; /* by parameters and inputs */
} mechc_covarying;

/* Add the derivatives of the shapes by parameters and inputs at a state at time t. */
MECHC_STATIC void mechc_gather_shapes(const mechc_covariation *v, double t, const double *slopes)
{
    const mechc_shapes *shapes = v->shapes;
    for (int n = 0; shapes && n < shapes->count; n++) {
        double factor;
        shapes->factors->evaluate(shapes->factors, n, n + 1, t, 0, 0, &factor);
        v->gradient[shapes->columns[n]] += factor * slopes[shapes->places[n]];
    }
}

MECHC_INLINE void mechc_add_slopes(const mechc_covariation *v, double t, const double *slopes)
{
    for (int k = 0; k < MECHC_NB; k++) v->gradient[k] += slopes[k];
    mechc_gather_shapes(v, t, slopes);
}

#if MECHC_SWITCHES_MAX
/* Move the covector back over the jumps of laws in a step. */
MECHC_STATIC void mechc_before_jumps(const mechc_covarying *w, const mechc_covariation *v, ptrdiff_t step)
{
    double map[MECHC_NX_MAX * MECHC_SLOPES_MAX], slopes[MECHC_SLOPES_MAX] = {0.0};
    if (!mechc_jumps_of_step(&w->given, v->trajectory, step, map)) return;
    for (int i = 0; i < MECHC_NX; i++)
        for (int k = 0; k < MECHC_SLOPES; k++) slopes[k] += v->covector[i] * map[i * MECHC_SLOPES + k];
    memcpy(v->covector, slopes, MECHC_NX * sizeof *slopes);
    mechc_add_slopes(v, v->trajectory->t[step + 1], slopes + MECHC_NX);
}
#endif

#if MECHC_NC_MAX > 0
/* Move the covector from behind the projection of a step's end to before it; step n of the current ones. */
MECHC_STATIC void mechc_before_projection(const mechc_covarying *w, const mechc_covariation *v,
                                          int n)
{
    double after[MECHC_NX_MAX], slopes[MECHC_SLOPES_MAX] = {0.0};
    memcpy(after, v->covector, MECHC_NX * sizeof *after);
    for (int i = 0; i < MECHC_NX; i++)
        for (int k = 0; k < MECHC_SLOPES; k++)
            slopes[k] += after[i] * w->tangents[i * MECHC_SLOPES + k][n];
    memcpy(v->covector, slopes, MECHC_NX * sizeof *slopes);
    mechc_add_slopes(v, w->ends[n], slopes + MECHC_NX);
}
#endif
#endif
