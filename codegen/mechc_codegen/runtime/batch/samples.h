/* Samples of the quantities that are reduced: their values within every step.
 *
 * Many steps are sampled together, so that parameters are prepared once and outputs are evaluated
 * in full lanes; quantities of the same output share its values.
 */
#pragma once

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "hybrid/contact/contacts.h"
#include "hybrid/events/search.h"

#define MECHC_SAMPLES 8 /* of a step, for extremes and means */
#define MECHC_MOST_AHEAD 16 /* steps that are sampled together, */
#define MECHC_MOST_VALUES 16384 /* and numbers of an output there, where it is wide */

/* One reduction of one quantity: a component of the state, or of an output. */
typedef struct {
    int reduction, form;
    int output, second; /* -1: the state; second: added to it, or -1 */
    int component;
    int of_motion;      /* whether it needs accelerations or multipliers */
    int direction;      /* of a crossing: 1 upwards, -1 downwards, 0 both */
    double level;
    double away; /* the time around each change point that does not count, of extremes */
} mechc_quantity;

/* Sets of fractions at which a step is sampled: for extremes, for means, and, as for events, for crossings.
 * The first sample of a block of steps is at its start. */
enum { MECHC_EVENLY, MECHC_AT_NODES, MECHC_AS_EVENTS, MECHC_SETS };
static const int mechc_samples_of[MECHC_SETS] = {MECHC_SAMPLES, MECHC_SAMPLES, MECHC_EVENT_SAMPLES};

typedef struct {
    double *values;  /* a row a quantity */
    ptrdiff_t first; /* of the steps that were sampled */
    int count;       /* how many; 0: none yet */
} mechc_samples;

typedef struct {
    const mechc_unit *unit;
    int width, widest, quantities;
    const mechc_quantity *quantity;
    mechc_motion *motion; /* whose steps are reduced */
    double t0;
    double *value;  /* a quantity each: the result so far, */
    double *last;   /* and its value where the steps reduced so far end, of crossings; NaN: none */
    int *known;
    int failed;        /* a quantity had no number where its crossing was searched */
    mechc_watch watch; /* the events that crossings are */
    int *shared;    /* for each quantity the first one with the same values */
    int looks_ahead; /* whether a step counts only when what follows is known */
    int ahead, rows; /* steps that are sampled together, and samples in them */
    mechc_samples samples[MECHC_SETS];
    double *t, *states, *outputs; /* at the samples of one set at a time, */
    double *forces;               /* and the generalized forces of contacts */
} mechc_reducer;

static int mechc_set_of(const mechc_quantity *quantity)
{
    if (quantity->reduction == MECHC_FIRST_CROSSING) return MECHC_AS_EVENTS;
    return quantity->reduction == MECHC_MEAN ? MECHC_AT_NODES : MECHC_EVENLY;
}

/* Whether two quantities need the same values as long as either needs any. */
static int mechc_sampled_alike(const mechc_quantity *a, const mechc_quantity *b)
{
    const int first = a->reduction == MECHC_FIRST_CROSSING;
    return mechc_set_of(a) == mechc_set_of(b) && a->form == b->form && a->output == b->output
        && a->second == b->second && a->component == b->component && !first && b->reduction != MECHC_LAST;
}

static int mechc_reducer_make(mechc_reducer *reducer, mechc_motion *motion, int quantities,
                              const mechc_quantity *quantity)
{
    const mechc_unit *unit = motion->unit;
    const int width = motion->width;
    const size_t some = (size_t)(quantities > 0 ? quantities : 1);
    reducer->unit = unit;
    reducer->motion = motion;
    reducer->width = width;
    reducer->quantities = quantities;
    reducer->quantity = quantity;
    reducer->widest = 1;
    reducer->looks_ahead = 0;
    for (int i = 0; i < quantities; i++) reducer->looks_ahead |= quantity[i].away > 0.0;
    for (int i = 0; i < unit->output_count; i++)
        if (unit->outputs[i].width > reducer->widest) reducer->widest = unit->outputs[i].width;
    const int fit = MECHC_MOST_VALUES / (MECHC_EVENT_SAMPLES * reducer->widest);
    reducer->ahead = fit < 1 ? 1 : fit < MECHC_MOST_AHEAD ? fit : MECHC_MOST_AHEAD;
    reducer->rows = 1 + MECHC_EVENT_SAMPLES * reducer->ahead;
    reducer->value = malloc(2 * some * sizeof(double));
    reducer->last = reducer->value ? reducer->value + some : 0;
    reducer->known = malloc(some * sizeof(int));
    reducer->shared = malloc(some * sizeof(int));
    const size_t rows = (size_t)reducer->rows * sizeof(double);
    reducer->t = malloc(rows);
    reducer->states = malloc(rows * (size_t)width);
    reducer->outputs = malloc(2 * rows * (size_t)reducer->widest);
    reducer->forces = malloc(rows * (size_t)motion->speeds);
    if (!mechc_watch_make(&reducer->watch, motion, (int)some, 0)) return 0;
    for (int i = 0; i < quantities; i++)
        reducer->watch.policy[i] = (mechc_event_policy){quantity[i].direction, 0, -1};
    int made = reducer->value && reducer->known && reducer->shared && reducer->t
            && reducer->states && reducer->outputs && reducer->forces;
    for (int set = 0; set < MECHC_SETS; set++) {
        reducer->samples[set].values = malloc(rows * some);
        made = made && reducer->samples[set].values;
    }
    for (int i = 0; made && i < quantities; i++) {
        reducer->shared[i] = i;
        for (int j = i - 1; j >= 0; j--)
            if (mechc_sampled_alike(quantity + i, quantity + j)) reducer->shared[i] = j;
    }
    return made;
}

static void mechc_reducer_free(mechc_reducer *reducer)
{
    free(reducer->value);
    free(reducer->known);
    free(reducer->shared);
    free(reducer->t);
    free(reducer->states);
    free(reducer->outputs);
    free(reducer->forces);
    mechc_watch_free(&reducer->watch);
    for (int set = 0; set < MECHC_SETS; set++) free(reducer->samples[set].values);
}

static void mechc_reducer_begin(mechc_reducer *reducer, double t0)
{
    reducer->t0 = reducer->watch.start = t0;
    reducer->failed = 0;
    mechc_watch_begin(&reducer->watch);
    for (int i = 0; i < reducer->quantities; i++) {
        reducer->known[i] = 0;
        reducer->value[i] = 0.0;
        reducer->last[i] = NAN;
    }
}

/* Evaluate an output at `count` states, with the forces of the contacts that last there. */
static void mechc_reduce_output(const mechc_reducer *reducer, int output, ptrdiff_t count,
                                const double *t, const double *states, double *out)
{
    const mechc_motion *motion = reducer->motion;
    const mechc_rows times = {t, 1}, rows = {states, reducer->width}, p = {motion->p, 0};
    mechc_rows forces = MECHC_NO_FORCES;
    if (mechc_is_in_contact(motion)) {
        for (ptrdiff_t i = 0; i < count; i++)
            mechc_contact_forces(motion->contacts, t[i], states + i * reducer->width,
                                 reducer->forces + i * motion->speeds);
        forces = (mechc_rows){reducer->forces, motion->speeds};
    }
    reducer->unit->outputs[output].evaluate(count, times, rows, p, motion->whole, forces, out);
}

/* The number that a quantity is, from the values of an output at one state. */
static double mechc_reduce_form(const mechc_quantity *quantity, const double *values, int width)
{
    double square = 0.0;
    if (quantity->form != MECHC_NORM) {
        const double value = values[quantity->component];
        return quantity->form == MECHC_ABSOLUTE ? fabs(value) : value;
    }
    for (int i = 0; i < width; i++) square += values[i] * values[i];
    return sqrt(square);
}

/* The quantity at `count` states, at most as many as there are rows. */
static void mechc_reduce_states(const mechc_reducer *reducer, const mechc_quantity *quantity,
                                ptrdiff_t count, const double *t, const double *states,
                                double *out)
{
    const double *values = states;
    int width = reducer->width;
    if (quantity->output >= 0) {
        width = reducer->unit->outputs[quantity->output].width;
        values = reducer->outputs;
        mechc_reduce_output(reducer, quantity->output, count, t, states, reducer->outputs);
    }
    for (ptrdiff_t i = 0; i < count; i++)
        out[i] = mechc_reduce_form(quantity, values + i * width, width);
    if (quantity->second < 0) return;
    double *others = reducer->outputs + (ptrdiff_t)reducer->rows * reducer->widest;
    width = reducer->unit->outputs[quantity->second].width;
    mechc_reduce_output(reducer, quantity->second, count, t, states, others);
    for (ptrdiff_t i = 0; i < count; i++) out[i] += others[i * width + quantity->component];
}

/* Whether a quantity is a component of the state, evaluated by the polynomial of a step. */
static int mechc_is_component(const mechc_quantity *quantity)
{
    return quantity->output < 0 && quantity->form != MECHC_NORM;
}

/* Whether a quantity still needs samples of a set. */
static int mechc_needs_samples(const mechc_reducer *reducer, int i, int set)
{
    const mechc_quantity *quantity = reducer->quantity + i;
    const int over = quantity->reduction == MECHC_FIRST_CROSSING && reducer->known[i];
    return reducer->shared[i] == i && mechc_set_of(quantity) == set && !over
        && quantity->reduction != MECHC_LAST && !mechc_is_component(quantity);
}

/* The fractions of a step in a set of eight. */
static const double *mechc_fractions(int set)
{
    static const double fractions[][MECHC_SAMPLES] = {
        {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0},
        {0.019855071751231884, 0.10166676129318664, 0.2372337950418355, 0.4082826787521751,
         0.5917173212478249, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681}};
    return fractions[set];
}

static double mechc_time_in(const mechc_trajectory *steps, ptrdiff_t step, double s)
{
    const double *t = steps->t + step;
    return s <= 0.0 ? t[0] : s >= 1.0 ? t[1] : t[0] + s * (t[1] - t[0]);
}

/* The accepted state at the end of a step, whether or not the run has gone on from it. */
static void mechc_take_end(const mechc_trajectory *steps, ptrdiff_t step, double *state)
{
    memcpy(state, steps->y + (step + 1) * steps->width, (size_t)steps->width * sizeof(double));
}

/* Sample all quantities of this set in the steps from `first` on. */
static void mechc_sample(mechc_reducer *reducer, const mechc_trajectory *steps, ptrdiff_t first,
                         int set)
{
    mechc_samples *samples = reducer->samples + set;
    const int each = mechc_samples_of[set];
    const ptrdiff_t left = steps->count - 1 - first, width = reducer->width;
    samples->first = first;
    samples->count = left < reducer->ahead ? (int)left : reducer->ahead;
    const ptrdiff_t rows = 1 + each * (ptrdiff_t)samples->count;
    reducer->t[0] = steps->t[first];
    for (int row = 0; row + 1 < rows; row++) {
        const int i = row % each;
        const double s = set == MECHC_AS_EVENTS ? mechc_event_fraction(i + 1) : mechc_fractions(set)[i];
        reducer->t[row + 1] = mechc_time_in(steps, first + row / each, s);
    }
    if (set != MECHC_AS_EVENTS) mechc_read_states(reducer->motion, rows, reducer->t, reducer->states);
    else reducer->unit->interpolate(0, steps, reducer->motion->p, reducer->motion->whole, rows, reducer->t,
                                    reducer->states); /* a zero is searched on the constraints */
    if (set != MECHC_AT_NODES)
        mechc_take_end(steps, first + samples->count - 1, reducer->states + (rows - 1) * width);
    for (int i = 0; i < reducer->quantities; i++)
        if (mechc_needs_samples(reducer, i, set))
            mechc_reduce_states(reducer, reducer->quantity + i, rows, reducer->t, reducer->states,
                                samples->values + i * (ptrdiff_t)reducer->rows);
}

/* The samples of a quantity in a step; if they include the step's end, its value at the start
 * precedes them. */
static const double *mechc_seen(mechc_reducer *reducer, const mechc_trajectory *steps,
                                ptrdiff_t step, int i)
{
    const int set = mechc_set_of(reducer->quantity + i);
    const mechc_samples *samples = reducer->samples + set;
    if (step < samples->first || step >= samples->first + samples->count)
        mechc_sample(reducer, steps, step, set);
    const ptrdiff_t row = mechc_samples_of[set] * (step - samples->first) + (set == MECHC_AT_NODES);
    return samples->values + reducer->shared[i] * (ptrdiff_t)reducer->rows + row;
}

