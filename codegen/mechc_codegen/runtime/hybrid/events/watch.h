/* The events of one motion: their functions, the zeros found, and work space. */
#pragma once

#include "hybrid/events/constraints.h"
#include "hybrid/events/functions.h"
#include "hybrid/motion.h"
#include "run/zeros.h"

#define MECHC_EVENT_SAMPLES 16 /* of a step, at least */
#define MECHC_EVENT_MOST_SAMPLES 4096
#define MECHC_EVENT_HALVINGS 64 /* towards the start of a piece: more than a double has */
#define MECHC_EVENT_GRID (MECHC_EVENT_SAMPLES + 1 + MECHC_EVENT_HALVINGS)
#define MECHC_EVENT_POINTS (4 * MECHC_EVENT_MOST_SAMPLES + 2 * MECHC_EVENT_GRID)
#define MECHC_RESETS_AT_ONCE 1000
#define MECHC_EVENT_LOCATED 2e-13   /* of a step: a zero in it is located so, or to four spacings of doubles */

/* An event as the caller defines it. */
typedef struct {
    double direction; /* positive: rising zeros only; negative: falling zeros only; 0: both */
    long terminal;    /* the motion ends at so many zeros; 0: never */
    int contact;      /* the contact whose gap it is; -1: none */
} mechc_event_policy;

/* The state of one event during the search. */
typedef struct {
    long count;       /* zeros so far */
    int idle;         /* it does not happen in this piece */
    double latest;    /* the last zero */
    double size;      /* largest magnitude met */
    double grazing;   /* the first time that it may only touch zero, or NaN */
    double too_fast;  /* time from which it changes too fast to follow, or NaN */
    double side;      /* its sign right after the start if it is zero there; else 0 */
    double near;      /* so long after the start its value may be rounding, s */
    double cleared;   /* it has just opened this far: no grazing before twice that; else 0 */
    double rounding;  /* of its value where its rates were taken last */
    mechc_point before; /* the last sample before the end of a step, */
    double ended;        /* and that end; NaN where there is none */
    double last, passed; /* times of its last reset, and of the last one that lets it cross again */
    double after;     /* its rate after its last reset */
    double fastest;   /* largest rate at a reset */
    double rate, later; /* before and after a reset */
    int done;         /* it has reset the state at the instant at hand */
    const double *line; /* of an end of a mode that is this y + constant, at least, along the dense
                           output, or NULL */
    double constant;
} mechc_event;

typedef struct {
    int event, piece; /* piece: in whose steps it is */
    double t;
} mechc_event_zero;

/* All events: those of the caller first, then the ends of a mode of contact. */
typedef struct {
    mechc_motion *motion;
    int own, count, most; /* most: that there is room for */
    mechc_event_functions *functions;
    mechc_event_policy *policy;
    mechc_event *event;
    /* The first zero in a step of an event without a function; returns as mechc_event_zeros.  NULL: none. */
    int (*search)(void *context, ptrdiff_t step, double *zero);
    void *context;
    double start; /* of the piece at hand */
    double step;  /* the one searched last, s: the unit of time */
    int stopped_by, searched;
    int keeps_states;
    mechc_event_zero *zero; /* zeros found so far; if states are kept they are in zero_state */
    double *zero_state;
    ptrdiff_t zeros, zero_room;
    int *cause, causes; /* events that made the last reset, in order */
    /* Work space. */
    double *grid, *on_grid; /* the times at which the step is sampled, and the states there */
    double *times; /* between samples; then of an event's zeros in a step */
    double *states, *rates, *slopes, *reset, *room;
    mechc_point *points, *spare;
} mechc_watch;

MECHC_STATIC void mechc_watch_free(mechc_watch *watch)
{
    free(watch->functions);
    free(watch->policy);
    free(watch->event);
    free(watch->zero);
    free(watch->zero_state);
    free(watch->cause);
    free(watch->grid);
    free(watch->points);
}

/* Allocate the memory for `own` events and `ends` of modes; 0 without memory. */
MECHC_STATIC int mechc_watch_make(mechc_watch *watch, mechc_motion *motion, int own, int ends)
{
    const size_t most = (size_t)(own + ends), width = (size_t)motion->width;
    const size_t after = width + (size_t)motion->parameters;
    const size_t sampled = MECHC_EVENT_GRID * (1 + width);
    const size_t numbers = 2 * sampled + MECHC_EVENT_POINTS + 5 * width + 1 + after
                         + mechc_impulse_room(motion);
    watch->motion = motion;
    watch->own = watch->count = own;
    watch->most = (int)most;
    watch->functions = calloc(most, sizeof *watch->functions);
    watch->policy = calloc(most, sizeof *watch->policy);
    watch->event = calloc(most, sizeof *watch->event);
    watch->cause = malloc(MECHC_RESETS_AT_ONCE * sizeof *watch->cause);
    watch->grid = malloc(numbers * sizeof *watch->grid);
    watch->points = malloc(2 * MECHC_EVENT_POINTS * sizeof *watch->points);
    if (!watch->functions || !watch->policy || !watch->event || !watch->cause || !watch->grid
        || !watch->points)
        return 0;
    watch->spare = watch->points + MECHC_EVENT_POINTS;
    watch->on_grid = watch->grid + MECHC_EVENT_GRID;
    watch->states = watch->grid + sampled;
    watch->times = watch->states + sampled;
    watch->rates = watch->times + MECHC_EVENT_POINTS;
    watch->slopes = watch->rates + 4 * width;
    watch->reset = watch->slopes + 1 + width;
    watch->room = watch->reset + after;
    return 1;
}

/* Reset the state of an event. */
MECHC_STATIC void mechc_event_forget(mechc_event *event)
{
    memset(event, 0, sizeof *event);
    event->latest = event->grazing = event->too_fast = event->last = event->passed = event->ended = NAN;
}

/* Begin a motion. */
MECHC_STATIC void mechc_watch_begin(mechc_watch *watch)
{
    watch->zeros = 0;
    watch->step = 0.0;
    watch->causes = 0;
    watch->stopped_by = -1;
    for (int k = 0; k < watch->own; k++) mechc_event_forget(watch->event + k);
}

/* The accuracy of a zero's time near t, s. */
MECHC_STATIC double mechc_located(const mechc_watch *watch, double t)
{
    const double size = fabs(t);
    return fmax(MECHC_EVENT_LOCATED * watch->step, 4.0 * (nextafter(size, INFINITY) - size));
}

/* Whether an event changes the state. */
MECHC_STATIC int mechc_event_resets(const mechc_watch *watch, int event)
{
    return watch->functions[event].reset || watch->policy[event].contact >= 0;
}

MECHC_STATIC double mechc_event_value(const mechc_watch *watch, int event, double t, const double *y)
{
    const mechc_event_functions *functions = watch->functions + event;
    return functions->value(functions->context, t, y, watch->motion->p);
}

/* The value of the event that is searched. */
MECHC_STATIC double mechc_event_at(void *context, double t)
{
    mechc_watch *watch = context;
    watch->motion->states(watch->motion, 1, &t, watch->states);
    return mechc_event_value(watch, watch->searched, t, watch->states);
}

/* Record a zero and its state; 0 without memory. */
MECHC_STATIC int mechc_watch_keep(mechc_watch *watch, int event, double t, int piece, const double *y)
{
    const size_t width = watch->keeps_states ? (size_t)watch->motion->width : 0;
    if (watch->zeros == watch->zero_room) {
        const ptrdiff_t room = 2 * watch->zero_room + 16;
        mechc_event_zero *zero = realloc(watch->zero, (size_t)room * sizeof *zero);
        if (zero) watch->zero = zero;
        double *state = realloc(watch->zero_state, (size_t)room * (width + 1) * sizeof *state);
        if (state) watch->zero_state = state;
        if (!zero || !state) return 0;
        watch->zero_room = room;
    }
    watch->zero[watch->zeros] = (mechc_event_zero){event, piece, t};
    memcpy(watch->zero_state + (size_t)watch->zeros * width, y, width * sizeof *y);
    watch->zeros++;
    watch->event[event].count++;
    return 1;
}
