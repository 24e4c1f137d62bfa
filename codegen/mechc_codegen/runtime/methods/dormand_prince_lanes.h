/* The explicit pair of order 8 in lockstep: see lockstep/lanes_of_runs.h. */
#pragma once

#include "lockstep/advance.h"
#include "methods/dormand_prince_tableaus.h"
#include "simd/bind_vector.h"
#include "methods/explicit_step.h"
#include "simd/rough.h"
#include "simd/unbind.h"
#include "stepping/stiffness.h"

#if MECHC_LOCKSTEP_CODE
typedef struct {
    mechc_lockstep lanes;
    mechc_vector last_stage[MECHC_NX_MAX];
    mechc_vector bound; /* mechc_stiff_bound, squared */
} mechc_pair_lanes;

MECHC_STATIC void mechc_pair_lanes_load(mechc_lockstep *a, int lane, const mechc_integration *run)
{
    const double bound = mechc_stiff_bound(run, &mechc_dop853_tableau);
    ((mechc_pair_lanes *)a)->bound[lane] = bound * bound;
}

/* Compute the rates of stage i; those of the dense output, after the end, are not monitored. */
MECHC_INLINE int mechc_pair_lanes_stage(void *owner, int i, mechc_vector t, mechc_vector *state,
                                        mechc_vector *rates)
{
    mechc_pair_lanes *own = owner;
    mechc_lockstep *a = &own->lanes;
    const int stages = mechc_dop853_tableau.stages;
    if (i == stages) {
        mechc_lockstep_project(a, t, rates);
        return MECHC_RUNNING;
    }
    /* monitored is the conditioning of two: with both ends, no stage is far from one of them */
    if (MECHC_NC > 0 && (i == 5 || i == 8))
        mechc_lockstep_watched_rates(a, t, state, rates);
    else
        mechc_lockstep_rates(a, t, state, rates);
    if (i == stages - 1) memcpy(own->last_stage, state, MECHC_NX * sizeof *state);
    return MECHC_RUNNING;
}

MECHC_INLINE mechc_vector_explicit_data mechc_pair_lanes_data(mechc_lockstep *a)
{
    return (mechc_vector_explicit_data){
        a->t, a->h, a->y, a->compensation, a->next_compensation, a->rates,
    };
}

MECHC_ONCE void mechc_pair_lanes_step(mechc_lockstep *a)
{
    const mechc_vector_explicit_data step = mechc_pair_lanes_data(a);
    a->evaluations += mechc_dop853_tableau.stages + 1;
    mechc_vector_explicit_step(&mechc_dop853_tableau, &step, mechc_pair_lanes_stage, a, a->end);
}

/* Whether stability limits the step: see mechc_pair_limited. */
MECHC_INLINE mechc_mask mechc_pair_lanes_limited(const mechc_lockstep *a)
{
    const int stages = mechc_dop853_tableau.stages;
    const mechc_vector *last_stage = ((const mechc_pair_lanes *)a)->last_stage;
    mechc_vector rate = mechc_spread(0.0), state = rate;
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_vector weight = mechc_vector_rough_inverse(a->scale[i]);
        const mechc_vector change = weight * (a->rates[stages][i] - a->rates[stages - 1][i]);
        const mechc_vector apart = weight * (a->end[i] - last_stage[i]);
        MECHC_ADD(rate, change, change);
        MECHC_ADD(state, apart, apart);
    }
    return (state > 0.0) & (a->h * a->h * rate > ((const mechc_pair_lanes *)a)->bound * state);
}

/* Square of the step's error over what is tolerated: see mechc_pair_error. */
MECHC_INLINE mechc_vector mechc_pair_lanes_error(mechc_lockstep *a)
{
    mechc_vector first[MECHC_NX_MAX], second[MECHC_NX_MAX];
    mechc_vector squares = mechc_spread(0.0), second_squares = squares, change = squares;
    const mechc_tableau *tableau = &mechc_dop853_tableau;
    mechc_vector_explicit_sum(a->rates, tableau->error, tableau->stages, first);
    mechc_vector_explicit_sum(a->rates, tableau->second_error, tableau->stages, second);
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_vector weight = a->h * mechc_lockstep_weight(a, i);
        MECHC_ADD(squares, first[i] * weight, first[i] * weight);
        MECHC_ADD(second_squares, second[i] * weight, second[i] * weight);
        for (int end = 0; end <= tableau->stages; end += tableau->stages)
            MECHC_ADD(change, a->rates[end][i] * weight, a->rates[end][i] * weight);
    }
    const mechc_vector both = squares * squares / (squares + MECHC_DOP853_SECOND * second_squares);
    const mechc_vector least = mechc_greater(change, second_squares);
    const mechc_vector third = second_squares * (second_squares / least) * (second_squares / least);
    const mechc_vector error = mechc_choose(third > both, third, both) / MECHC_NX;
    /* where stability limits steps both are of the fast component; else a lane whose error may be rounding
     * continues alone */
    mechc_mask rounds = (second_squares <= MECHC_DOP853_ALIKE * squares)
                      & (error > MECHC_ALIKE_SHORTENS * MECHC_ALIKE_SHORTENS);
    if (mechc_any(rounds)) rounds &= ~mechc_pair_lanes_limited(a);
    return mechc_choose(squares > 0.0, mechc_choose(rounds, mechc_spread(HUGE_VAL), error), squares);
}

/* Compute the extra stages of the dense output, and its rows. */
MECHC_ONCE void mechc_pair_lanes_dense(mechc_lockstep *a, mechc_vector *rows)
{
    const mechc_tableau *tableau = &mechc_dop853_tableau;
    const mechc_vector_explicit_data step = mechc_pair_lanes_data(a);
    mechc_vector state[MECHC_NX_MAX];
    mechc_vector_explicit_stages(tableau, &step, tableau->stages + 1, tableau->rates - 1,
                                 mechc_pair_lanes_stage, a, state);
    mechc_vector_explicit_dense(tableau, &step, a->end, tableau->dense_rows, rows);
}

static const mechc_lockstep_method mechc_dop853_lanes = {
    .number = MECHC_DOP853,
    .last_rate = 12,
    .dense_rows = 7,
    .growth = 2.0,
    .load = mechc_pair_lanes_load,
    .step = mechc_pair_lanes_step,
    .error = mechc_pair_lanes_error,
    .limited = mechc_pair_lanes_limited,
    .dense = mechc_pair_lanes_dense,
};

MECHC_LOCKSTEP_TOGETHER(mechc_dop853_together, mechc_pair_lanes, mechc_dop853_lanes)
#else
#define mechc_dop853_together 0
#endif
