/* A covector on its way back over the steps of a run. */
#pragma once

#include "variational/vary.h"
#include "simd/bind_scalar.h"
#include "adjoint/pullback.h"
#include "simd/bind_vector.h"
#include "adjoint/pullback.h"
#include "simd/unbind.h"

#if MECHC_VARIATIONAL
/* Of the steps at hand: their method's rule, their states at the stages. */
typedef struct {
    mechc_given_twice given;
    mechc_rule rules[2]; /* of Gauss and Radau */
    mechc_varying *blocks; /* work space where Jacobians are needed, or NULL */
    double t[MECHC_MOST_RATES * MECHC_LANES], y[MECHC_MOST_RATES * MECHC_LANES * MECHC_NX];
    mechc_nodes_at_hand nodes;
    mechc_mask kept[MECHC_MOST_RATES];
    mechc_vector tangents[MECHC_AT_LEAST_ONE(MECHC_NC > 0 ? MECHC_NX * MECHC_SLOPES : 0)];
    mechc_scalar_solved_state one;
    mechc_vector_solved_state lanes[MECHC_BLOCKS];
    mechc_vector gathered[MECHC_AT_LEAST_ONE(MECHC_NB)]; /* of all steps, by parameters and inputs */
} mechc_covarying;

/* From behind the projection of the end of step n of those at hand to before it. */
MECHC_STATIC void mechc_before_projection(const mechc_covarying *w, int n, double *covector,
                                          double *gradient)
{
#if MECHC_NC > 0
    double after[MECHC_NX];
    memcpy(after, covector, sizeof after);
    memset(covector, 0, sizeof after);
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_vector *row = w->tangents + i * MECHC_SLOPES;
        for (int k = 0; k < MECHC_NX; k++) covector[k] += after[i] * row[k][n];
        for (int k = 0; k < MECHC_NB; k++) gradient[k] += after[i] * row[MECHC_NX + k][n];
    }
#else
    (void)w, (void)n, (void)covector, (void)gradient;
#endif
}
#endif
