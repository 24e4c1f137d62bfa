/* The inputs of one motion, restricted to the interval between two kinks.
 *
 * No step crosses a kink or a jump of a signal.  Signals that a motion was given have all their pieces;
 * it works with copies that are narrowed to the pieces between two kinks, and with numbers of its own.
 */
#pragma once

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/macros.h"
#include "abi/signals.h"

#define MECHC_KNOT_TICKS 4 /* ulps: a time so near to a kink is the kink */
#define MECHC_INSIDE 0.25  /* of a segment: farther from its ends no knot is looked for */

/* Inputs as motions are given them. `due`, or NULL, is called at the start and at each kink, before
 * the inputs from there on are read. */
typedef struct {
    const mechc_driven *driven;    /* NULL: the scene has no inputs */
    const mechc_signal *signals;   /* those that `driven` is made of */
    const ptrdiff_t *knots;        /* how many each has */
    int signal_count, source_count;
    const double *kinks;           /* within the span, in its direction */
    ptrdiff_t kink_count;
    void (*due)(void *context, double t, const double *y);
    void *context;
} mechc_given_inputs;

typedef struct {
    mechc_driven now, whole; /* between two kinks; over the whole span */
    mechc_signal *signals;   /* of both, those of `now` first */
    mechc_source *sources;
    ptrdiff_t segment;       /* kinks that are passed */
} mechc_motion_inputs;

MECHC_STATIC void mechc_motion_inputs_free(mechc_motion_inputs *inputs)
{
    free(inputs->signals);
    free(inputs->sources);
}

MECHC_STATIC void mechc_copy_driven(const mechc_given_inputs *given, mechc_signal *signals,
                              mechc_source *sources, mechc_driven *copy)
{
    memcpy(signals, given->signals, (size_t)given->signal_count * sizeof *signals);
    for (int i = 0; i < given->source_count; i++) {
        sources[i] = given->driven->sources[i];
        if (sources[i].signal) sources[i].signal = signals + (sources[i].signal - given->signals);
    }
    *copy = *given->driven;
    copy->sources = sources;
}

/* Allocate and copy the inputs of one motion; 0 without memory. */
MECHC_STATIC int mechc_motion_inputs_make(const mechc_given_inputs *given, mechc_motion_inputs *inputs)
{
    const size_t signals = (size_t)given->signal_count, sources = (size_t)given->source_count;
    if (!given->driven) return 1;
    inputs->signals = malloc((2 * signals + 1) * sizeof *inputs->signals);
    inputs->sources = malloc((2 * sources + 1) * sizeof *inputs->sources);
    if (!inputs->signals || !inputs->sources) return 0;
    mechc_copy_driven(given, inputs->signals, inputs->sources, &inputs->now);
    mechc_copy_driven(given, inputs->signals + signals, inputs->sources + sources, &inputs->whole);
    return 1;
}

/* Replace constant signals by these numbers. */
MECHC_STATIC void mechc_motion_inputs_own(const mechc_given_inputs *given, mechc_motion_inputs *inputs,
                                    int count, const int *place, const double *numbers)
{
    for (int i = 0; i < count; i++)
        inputs->signals[place[i]].coefficients =
            inputs->signals[given->signal_count + place[i]].coefficients = numbers + i;
}

MECHC_STATIC double mechc_ticks(double t, double count)
{
    const double size = fabs(t);
    return count * (nextafter(size, HUGE_VAL) - size);
}

MECHC_STATIC ptrdiff_t mechc_last_knot(const mechc_signal *signal, ptrdiff_t knots, double t)
{
    ptrdiff_t low = 0, high = knots - 1;
    while (low < high) {
        const ptrdiff_t middle = high - (high - low) / 2;
        if (t >= signal->knots[middle]) low = middle;
        else high = middle - 1;
    }
    return low;
}

/* Restrict signals to their pieces between two times, a little inside them, so that a kink at an
 * end is left out. */
MECHC_STATIC void mechc_narrow_inputs(const mechc_given_inputs *given, mechc_motion_inputs *inputs, double t0,
                                double t1)
{
    const double inside = MECHC_INSIDE * fabs(t1 - t0);
    const double low = fmin(t0, t1) + fmin(inside, mechc_ticks(fmin(t0, t1), 2 * MECHC_KNOT_TICKS));
    const double high = fmax(t0, t1) - fmin(inside, mechc_ticks(fmax(t0, t1), 2 * MECHC_KNOT_TICKS));
    for (int i = 0; i < given->signal_count; i++) {
        inputs->signals[i].first = mechc_last_knot(given->signals + i, given->knots[i], low);
        inputs->signals[i].last = mechc_last_knot(given->signals + i, given->knots[i], high);
    }
}

/* The end of the present segment; beyond `end`, the end of the motion, there may be more kinks. */
MECHC_STATIC double mechc_segment_end(const mechc_given_inputs *given, const mechc_motion_inputs *inputs,
                                double end, double sense)
{
    const double kink = inputs->segment < given->kink_count ? given->kinks[inputs->segment] : end;
    return sense * (kink - end) < 0.0 ? kink : end;
}

/* Go to the segment that begins at time t or contains it, at the state y. */
MECHC_STATIC void mechc_enter_segment(const mechc_given_inputs *given, mechc_motion_inputs *inputs, double t,
                                const double *y, double end, double sense)
{
    if (!given->driven) return;
    while (inputs->segment < given->kink_count
           && sense * (given->kinks[inputs->segment] - t) <= mechc_ticks(t, MECHC_KNOT_TICKS))
        inputs->segment++;
    if (given->due) given->due(given->context, t, y);
    mechc_narrow_inputs(given, inputs, t, mechc_segment_end(given, inputs, end, sense));
}
