/* Steps of an explicit pair, backwards: the transposed of variational/explicit.h, stage by
 * stage.  The stages of several steps are taken again in the lanes.
 */
#pragma once

#include "adjoint/covector.h"

#if MECHC_VARIATIONAL
/* Compute the states at the stages of the steps. */
MECHC_STATIC void mechc_take_stages_back(mechc_covarying *w, const mechc_tableau *tableau, int method,
                                         const mechc_steps *steps)
{
    const int count = steps->count;
    mechc_pair_stages stages;
    w->kept = (mechc_mask){0};
    for (int i = 0; i < tableau->stages; i++) {
        mechc_vector time, state[MECHC_NX_MAX], rates[MECHC_NX_MAX];
        double *t = w->t + i * MECHC_LANES, *y = w->y + i * MECHC_LANES * MECHC_NX;
        mechc_pair_states(tableau, steps, i, &stages);
        if (mechc_keeps_more(method, steps, &stages, &w->kept)) {
            i = -1;
            continue;
        }
        mechc_fill_lanes(stages.t, count, 1, &time);
        mechc_fill_lanes(stages.y, count, MECHC_NX, state);
        if (mechc_any(w->kept)) mechc_keep_lanes(&w->given, stages.t, count, w->kept, state);
        mechc_vector_solve_state(time, state, &w->given.vector, &w->lanes[0], rates);
        mechc_empty_lanes(rates, count, MECHC_NX, stages.rates[i]);
        mechc_empty_lanes(state, count, MECHC_NX, y);
        memcpy(t, stages.t, sizeof stages.t);
    }
}

/* Go back over stage i of step n of the current ones. */
MECHC_INLINE void mechc_stage_back(mechc_covarying *w, int i, int n, const double *z,
                                   double *slopes)
{
    const int place = i * MECHC_LANES + n;
    double rates[MECHC_NX_MAX];
    mechc_scalar_solve_state(w->t[place], w->y + place * MECHC_NX, &w->given.scalar, &w->one,
                             rates);
    mechc_scalar_prepare_pullback(&w->given.scalar, w->kept[n] != 0, &w->one);
    mechc_scalar_pull_back(&w->one, &w->given.scalar, z, slopes);
}

MECHC_STATIC void mechc_pair_back(mechc_covarying *w, const mechc_covariation *v,
                                  const mechc_tableau *tableau, int n, double h)
{
    const int count = tableau->stages;
    const double *weights = tableau->matrix + count * MECHC_MOST_RATES;
    double rates[MECHC_MOST_RATES][MECHC_NX_MAX], slopes[MECHC_SLOPES_MAX];
    for (int i = 0; i < count; i++)
        for (int k = 0; k < MECHC_NX; k++) rates[i][k] = h * weights[i] * v->covector[k];
    for (int i = count - 1; i >= 0; i--) {
        const double *row = tableau->matrix + i * MECHC_MOST_RATES;
        mechc_stage_back(w, i, n, rates[i], slopes);
        for (int k = 0; k < MECHC_NX; k++) v->covector[k] += slopes[k];
        mechc_add_slopes(v, w->t[i * MECHC_LANES + n], slopes + MECHC_NX);
        for (int j = 0; j < i; j++)
            for (int k = 0; row[j] != 0.0 && k < MECHC_NX; k++)
                rates[j][k] += h * row[j] * slopes[k];
    }
}
#endif
