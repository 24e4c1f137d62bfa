/* Inputs of the members of a batch: signals that are the same for all, and numbers that differ.
 *
 * Runs restart where signals have kinks or jumps, so there are values for every segment between
 * these times, and for the whole span, with which results are read.  A slot whose members have
 * numbers of their own has copies, in which these are exchanged.
 */
#pragma once

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/signals.h"

#define MECHC_KNOT_TICKS 4 /* ulps: a kink nearer to the start of a piece is none of it */

typedef struct {
    int segments;       /* 0: the scene has no inputs */
    const double *ends; /* of the segments */
    const mechc_driven *const *driven; /* of the segments, and of the whole span */
    const mechc_signal *const *signals; /* those that `driven` are made of */
    int signal_count, source_count;
    int own;            /* numbers that differ between members */
    const int *place;   /* the signals that they are */
    const double *numbers; /* (members, own) */
} mechc_batch_inputs;

typedef struct {
    const mechc_driven **driven; /* as of the batch */
    mechc_driven *copies;
    mechc_signal *signals;
    mechc_source *sources;
} mechc_slot_inputs;

static void mechc_slot_inputs_free(mechc_slot_inputs *slot)
{
    free(slot->driven);
    free(slot->copies);
    free(slot->signals);
    free(slot->sources);
}

static void mechc_slot_inputs_copy(const mechc_batch_inputs *batch, int segment,
                                   mechc_slot_inputs *slot)
{
    mechc_signal *signals = slot->signals + (ptrdiff_t)segment * batch->signal_count;
    mechc_source *sources = slot->sources + (ptrdiff_t)segment * batch->source_count;
    const mechc_driven *given = batch->driven[segment];
    memcpy(signals, batch->signals[segment], (size_t)batch->signal_count * sizeof *signals);
    for (int i = 0; i < batch->source_count; i++) {
        sources[i] = given->sources[i];
        if (sources[i].signal)
            sources[i].signal = signals + (sources[i].signal - batch->signals[segment]);
    }
    slot->copies[segment] = *given;
    slot->copies[segment].sources = sources;
    slot->driven[segment] = slot->copies + segment;
}

/* 0 without memory. */
static int mechc_slot_inputs_make(const mechc_batch_inputs *batch, mechc_slot_inputs *slot)
{
    const size_t parts = (size_t)batch->segments + 1;
    if (!batch->segments) return 1;
    slot->driven = malloc(parts * sizeof *slot->driven);
    slot->copies = malloc(parts * sizeof *slot->copies);
    slot->signals = malloc(parts * (size_t)batch->signal_count * sizeof *slot->signals + 1);
    slot->sources = malloc(parts * (size_t)batch->source_count * sizeof *slot->sources + 1);
    if (!slot->driven || !slot->copies || !slot->signals || !slot->sources) return 0;
    for (int segment = 0; segment <= batch->segments; segment++)
        mechc_slot_inputs_copy(batch, segment, slot);
    return 1;
}

/* Take the numbers of a member. */
static void mechc_slot_inputs_of(const mechc_batch_inputs *batch, ptrdiff_t member,
                                 mechc_slot_inputs *slot)
{
    for (int segment = 0; batch->own && segment <= batch->segments; segment++)
        for (int i = 0; i < batch->own; i++)
            slot->signals[(ptrdiff_t)segment * batch->signal_count + batch->place[i]].coefficients =
                batch->numbers + member * batch->own + i;
}

/* In one segment; `segments`: in the whole span.  NULL where the scene has none. */
static const mechc_inputs *mechc_slot_inputs_in(const mechc_batch_inputs *batch,
                                                const mechc_slot_inputs *slot, int segment)
{
    return batch->segments ? &slot->driven[segment]->head : 0;
}

/* The segment in which a piece lies that begins at time t. */
static int mechc_segment_from(const mechc_batch_inputs *batch, double t, double direction)
{
    int segment = 0;
    while (segment + 1 < batch->segments) {
        const double size = fabs(direction > 0.0 ? batch->ends[segment] : t);
        const double near = MECHC_KNOT_TICKS * (nextafter(size, HUGE_VAL) - size);
        if (direction * (batch->ends[segment] - t) > near) break;
        segment++;
    }
    return segment;
}
