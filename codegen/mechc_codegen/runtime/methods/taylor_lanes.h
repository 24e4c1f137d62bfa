/* Taylor series of several runs in lockstep: see lockstep/lanes_of_runs.h and taylor.h, which a run by
 * itself is left to: it has the same numbers there. */
#pragma once

#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES

#include "lockstep/advance.h"
#include "lockstep/lanes_of_runs.h"
#include "lockstep/step.h"
#include "methods/traits.h"
#include "dynamics/scalar_stage.h"
#include "simd/bind_scalar.h"
#include "dynamics/alone.h"
#include "simd/bind_vector.h"
#include "series/step.h"
#include "simd/unbind.h"
#include "series/first_zero.h"
#include "run/integration.h"

#if MECHC_LOCKSTEP_CODE
typedef struct {
    mechc_lockstep lanes;
    mechc_vector rows[(MECHC_TAYLOR_MOST + 1) * MECHC_SERIES_MAX];
    mechc_vector scale, sizes[MECHC_TAYLOR_JUDGED], weights[MECHC_NX_MAX];
    mechc_vector defect; /* of the step's end */
    mechc_mask first; /* the first step is not lengthened */
    mechc_mask bound; /* the series, and not the step before, limits the step */
    mechc_mask may_leave; /* lanes that another method takes over where stability does */
    mechc_mask leaves; /* lanes that continue alone, from their present state */
    double unstable;
    int order; /* of all runs, whose tolerance is one */
} mechc_taylor_lanes;

MECHC_STATIC void mechc_taylor_lanes_load(mechc_lockstep *a, int lane, const mechc_integration *run)
{
    mechc_taylor_lanes *own = (mechc_taylor_lanes *)a;
    own->order = mechc_taylor_rows(run);
    own->unstable = mechc_taylor_unstable(own->order);
    own->first[lane] = -(int64_t)(run->head.stats.steps == 0);
    own->may_leave[lane] = -(int64_t)(run->when_stiff != 0);
}

MECHC_STATIC void mechc_taylor_lanes_store(const mechc_lockstep *a, int lane, mechc_integration *run)
{
    (void)a, (void)lane;
    if (run->last_step > 0.0) run->step = run->last_step;
    if (!MECHC_SERIES_HIDES) mechc_scalar_rates(run->head.t, run->y, &run->given, MECHC_RATE(run, 0));
}

MECHC_INLINE void mechc_taylor_lanes_expand(mechc_taylor_lanes *own, mechc_vector step)
{
    mechc_lockstep *a = &own->lanes;
    own->scale = mechc_choose(a->t1 < a->t, -step, step);
    mechc_vector_series(a->t, a->y, &a->given, own->scale, own->order, MECHC_ROWS(own));
    mechc_vector_taylor_weights(a->y, a->scale, a->floor, a->of_scale, a->of_size, a->part, own->weights);
    mechc_vector_taylor_sizes(MECHC_ROWS(own), own->order, own->weights, own->sizes);
    own->leaves = ~(own->sizes[0] < HUGE_VAL);
    for (int k = 1; k < MECHC_TAYLOR_JUDGED; k++) own->leaves |= ~(own->sizes[k] < HUGE_VAL);
    a->evaluations += own->order;
}

/* Mark the lanes in whose step a root changes its branch; they leave. */
MECHC_INLINE void mechc_taylor_lanes_watch(mechc_taylor_lanes *own)
{
#if MECHC_SERIES_ROOTS_MAX
    mechc_lockstep *a = &own->lanes;
    const mechc_vector size = mechc_size_of(own->scale), part = a->step / size;
    const mechc_vector kept = mechc_vector_branches_kept(MECHC_ROWS(own), own->order, part);
    if (!mechc_any(~(kept > 0.0))) return;
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        const double *rows = (const double *)own->rows + lane;
        if (kept[lane] > 0.0) continue;
        const double past = mechc_just_past(a->t[lane], own->scale[lane], part[lane]);
        int zero;
        const double end =
            mechc_branches_end(rows, MECHC_LANES, own->order, part[lane], past, &zero);
        own->leaves[lane] |= -(int64_t)(end < part[lane]);
    }
#else
    (void)own;
#endif
}

MECHC_ONCE void mechc_taylor_lanes_step(mechc_lockstep *a)
{
    mechc_taylor_lanes *own = (mechc_taylor_lanes *)a;
    const mechc_vector before = mechc_choose(a->last_step > 0.0, a->last_step, a->step);
    mechc_taylor_lanes_expand(own, before);
    const mechc_mask stays = a->refused | (own->first & ~(a->last_step > 0.0));
    const mechc_vector most = mechc_choose(stays, before, MECHC_TAYLOR_GROWTH * before);
    const mechc_vector reach =
        mechc_size_of(own->scale) * mechc_vector_taylor_reach(own->sizes, own->order);
    own->bound = reach < most;
    a->step = mechc_choose(own->bound, reach, most);
    mechc_taylor_lanes_watch(own);
    a->step = mechc_choose(own->leaves, before, a->step);
    mechc_lockstep_next_step(a);
    const mechc_vector part = a->h / own->scale;
    mechc_vector_taylor_end(MECHC_ROWS(own), own->order, part, a->compensation, a->next_compensation, a->end);
    a->conditioning = mechc_spread(1.0);
    a->closed = ~(mechc_mask){0};
    own->defect = mechc_spread(0.0);
    if (!MECHC_SERIES_HIDES) return;
    mechc_lockstep_rates(a, a->t + a->h, a->end, a->rates[1]);
    own->defect =
        mechc_vector_taylor_defect(MECHC_ROWS(own), own->order, part, own->scale, a->rates[1], own->weights);
}

/* The error for which the step was planned; runs continue alone whose series does not lead to its end. */
MECHC_INLINE mechc_vector mechc_taylor_lanes_error(mechc_lockstep *a)
{
    const mechc_taylor_lanes *own = (const mechc_taylor_lanes *)a;
    mechc_vector sum = mechc_size_of(a->end[0]);
    for (int i = 1; i < MECHC_NX; i++) sum += mechc_size_of(a->end[i]);
    const mechc_mask leads = (sum < HUGE_VAL) & (own->defect <= 1.0) & ~own->leaves;
    return mechc_choose(leads, mechc_spread(0.25), mechc_spread(HUGE_VAL));
}

/* Whether stability limits the step. */
MECHC_INLINE mechc_mask mechc_taylor_lanes_limited(const mechc_lockstep *a)
{
    mechc_taylor_lanes *own = (mechc_taylor_lanes *)a;
    mechc_vector moved[MECHC_NX_MAX], rates[MECHC_NX_MAX];
    const mechc_mask looks = (a->steps % MECHC_TAYLOR_LOOK == 0) | (a->stiff > 0);
    const mechc_mask asked = own->bound & own->may_leave & looks;
    if (!mechc_any(asked)) return asked;
    mechc_vector_taylor_moved(a->y, MECHC_ROWS(own), own->order, own->sizes, moved);
    mechc_lockstep_rates((mechc_lockstep *)a, a->t, moved, rates);
    return asked
         & (mechc_vector_taylor_stiffness(rates, MECHC_ROWS(own), own->scale, own->weights, a->h)
            > own->unstable);
}

MECHC_ONCE void mechc_taylor_lanes_dense(mechc_lockstep *a, mechc_vector *rows)
{
    mechc_taylor_lanes *own = (mechc_taylor_lanes *)a;
    mechc_vector_taylor_dense(MECHC_ROWS(own), own->order, a->h / own->scale, a->end, own->order,
                              rows);
}

static const mechc_lockstep_method mechc_taylor_in_lanes = {
    .number = MECHC_TAYLOR,
    .last_rate = 1,
    .dense_rows = MECHC_TAYLOR_MOST,
    .growth = MECHC_TAYLOR_GROWTH,
    .load = mechc_taylor_lanes_load,
    .store = mechc_taylor_lanes_store,
    .step = mechc_taylor_lanes_step,
    .error = mechc_taylor_lanes_error,
    .plans = 1,
    .limited = mechc_taylor_lanes_limited,
    .dense = mechc_taylor_lanes_dense,
};

MECHC_LOCKSTEP_TOGETHER(mechc_taylor_together, mechc_taylor_lanes, mechc_taylor_in_lanes)
#else
#define mechc_taylor_together 0
#endif
#endif
