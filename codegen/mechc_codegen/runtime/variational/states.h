/* The states that derivatives are taken at, several in the lanes. */
#pragma once

#include "abi/run.h"
#include "singularities/crossing.h"
#include "singularities/fine_gap.h"
#include "singularities/generic_rank.h"
#include "dynamics/project.h"
#include "run/tableau.h"
#include "simd/bind_vector.h"
#include "variational/linearise.h"
#include "simd/unbind.h"
#include "simd/transpose.h"
#include "simd/vector.h"
#include "singularities/monitor.h"

#if MECHC_VARIATIONAL
typedef struct {
    mechc_scalar_given scalar;
    mechc_vector_given vector;
} mechc_given_twice;

MECHC_STATIC void mechc_give_twice(const mechc_trajectory *trajectory, const double *p,
                                   const mechc_inputs *inputs, mechc_given_twice *given)
{
    mechc_give_at(trajectory->t[0], trajectory->y, p, inputs, 0, &given->scalar);
    for (int i = 0; i < MECHC_NP; i++) given->vector.p[i] = mechc_spread(given->scalar.p[i]);
    for (int i = 0; i < MECHC_CONSTANTS; i++)
        given->vector.k[i] = mechc_spread(given->scalar.k[i]);
    for (int lane = 0; lane < MECHC_LANES; lane++) given->vector.inputs[lane] = inputs;
    given->vector.stop = 0;
}

/* Up to MECHC_LANES steps of a run from `first` on, side by side in the lanes. */
typedef struct {
    const mechc_trajectory *record;
    ptrdiff_t first;
    int count;
    const mechc_given_twice *given;
} mechc_steps;

/* A time at the fraction s of a step, strictly within it: inputs may jump at its ends. */
MECHC_INLINE double mechc_within(double before, double after, double s)
{
    if (s > 0.0 && s < 1.0) return before + (after - before) * s;
    return s > 0.0 ? nextafter(after, before) : nextafter(before, after);
}

#define MECHC_ALWAYS_KEPT(name, NUMBER, number, PART, degree, RULE, kept, lockstep) kept,

/* The lanes in which the method keeps a stage on the constraints. */
MECHC_INLINE mechc_mask mechc_keeps(int method, const mechc_vector *state, mechc_vector t,
                                    const mechc_given_twice *given)
{
#if MECHC_NC_MAX > 0
    static const unsigned char always[] = {MECHC_METHOD_TABLE(MECHC_ALWAYS_KEPT)};
    if (always[method]) return ~(mechc_mask){0};
    return ~(mechc_vector_conditioning_there(t, state, &given->vector) > MECHC_CLEAR * MECHC_CLEAR);
#else
    (void)method, (void)state, (void)t, (void)given;
    return (mechc_mask){0};
#endif
}

#if MECHC_NH_MAX > 0
/* Close loops that are closed to rounding once more: beside a crossing, to the rounding of q. */
MECHC_STATIC void mechc_close_further(double t, double *y, const mechc_scalar_given *given,
                                      mechc_scalar_place *place)
{
    mechc_weakest weakest;
    mechc_critical beside;
    mechc_weakest_of(place, 0, &weakest);
    if (mechc_is_fine(weakest.ratio * weakest.ratio)
        && mechc_find_critical(t, y, given, &weakest, mechc_beside(&weakest, place), &beside)
        && mechc_judge(&beside) == MECHC_CROSSING) {
        mechc_close_finely(t, y, given, &beside, weakest.ratio, place);
        return;
    }
    mechc_scalar_correct(t, y, given, place);
    mechc_locate(t, y, given, place);
}
#endif

/* One state moved onto the constraints, as the run moves its stages, and then until the gap is its
 * own rounding, beside a crossing until q is: derivatives there magnify what is left of it by the third
 * power of the conditioning. */
MECHC_STATIC void mechc_keep_state(const mechc_scalar_given *given, double t, double *y)
{
    double moved[2];
    if (mechc_project_state(t, y, given, moved) != MECHC_RUNNING) return;
#if MECHC_NH_MAX > 0
    mechc_scalar_place place;
    mechc_locate(t, y, given, &place);
    if (mechc_is_delicate(&place, given)) return;
    mechc_close_further(t, y, given, &place);
    mechc_scalar_steady(&place, y + MECHC_NQ);
#endif
}

/* Move states of `count` lanes, those of the mask, onto the constraints. */
MECHC_STATIC void mechc_keep_lanes(const mechc_given_twice *given, const double *t, int count,
                                   mechc_mask which, mechc_vector *state)
{
    double y[MECHC_LANES * MECHC_NX_MAX];
    mechc_empty_lanes(state, count, MECHC_NX, y);
    for (int n = 0; n < count; n++)
        if (which[n]) mechc_keep_state(&given->scalar, t[n], y + n * MECHC_NX);
    mechc_fill_lanes(y, count, MECHC_NX, state);
}

#if MECHC_NC_MAX > 0
/* Derivatives of the projection of the ends of the steps, at times that are written to t. */
MECHC_ONCE void mechc_tangents_in_lanes(const mechc_steps *steps, double *t, mechc_vector *tangents)
{
    const double *times = steps->record->t + steps->first;
    mechc_vector time, state[MECHC_NX_MAX];
    for (int n = 0; n < steps->count; n++) t[n] = mechc_within(times[n], times[n + 1], 1.0);
    mechc_fill_lanes(t, steps->count, 1, &time);
    mechc_fill_lanes(steps->record->y + (steps->first + 1) * MECHC_NX, steps->count, MECHC_NX, state);
    mechc_vector_tangent(time, state, &steps->given->vector, tangents);
}
#endif
#endif
