/* The events of one run: their functions, what was found of them, and room to work in. */
#pragma once

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/codes.h"
#include "abi/model.h"
#include "events/functions.h"

#define MECHC_EVENT_SAMPLES 16 /* of a step, at least */
#define MECHC_EVENT_MOST_SAMPLES 4096
#define MECHC_EVENT_HALVINGS 64 /* towards the start of a motion: more than a double has */
#define MECHC_EVENT_GRID (MECHC_EVENT_SAMPLES + 1 + MECHC_EVENT_HALVINGS)
#define MECHC_EVENT_POINTS (4 * MECHC_EVENT_MOST_SAMPLES + 2 * MECHC_EVENT_GRID)

typedef struct {
    double t, value;
} mechc_event_point;

/* What is known of one event. */
typedef struct {
    double direction; /* positive: where it grows alone; negative: where it falls; 0: both */
    long terminal;    /* the run ends at so many zeros; 0: never */
    long count;       /* zeros so far */
    double latest;    /* the last of them */
    double size;      /* largest magnitude met */
    double grazing;   /* the first time that it may only touch zero, or NaN */
    double too_fast;  /* time from which it changes too fast to follow, or NaN */
    double side;      /* the sign that it has right after the start, where it is zero; else 0 */
    double rounding;  /* of its value where its rates were taken last */
    double near;      /* so long after the start its value may be rounding, s */
    double last, passed; /* times of its last reset, and of one that let it be crossed, or NaN */
    double after;     /* its rate after its last reset */
    double fastest;   /* largest rate at a reset */
    double rate, later; /* before and after the reset at hand */
    int done;         /* whether it has reset the state at this instant */
} mechc_event;

typedef struct {
    int event;
    double t;
} mechc_event_zero;

typedef struct {
    const mechc_unit *unit;
    const mechc_event_functions *functions;
    int count;
    mechc_event *event;
    int coordinates, speeds, width, rows;
    int mass, jacobian, residuals; /* places of these outputs in the unit; -1: none */
    int method;
    const mechc_trajectory *steps; /* of the motion at hand */
    const double *p;
    const mechc_inputs *inputs;
    const double *scale; /* of each component */
    double rtol, sense;  /* sense: 1 forwards, -1 backwards in time */
    double start;        /* of the motion at hand */
    int stopped_by;
    mechc_event_zero *zero; /* found since they were last read, */
    ptrdiff_t zeros, room;
    int *cause; /* events that made the last reset, in order, */
    double *caused_at; /* and the state before each */
    int causes, cause_room;
    int *touching; /* stops that an impact acts on, and room for sets of them */
    /* Work space. */
    double *grid, *states, *rates, *slopes, *prepared, *impulse, *contacts;
    mechc_event_point *points, *spare;
} mechc_watch;

static int mechc_watch_output(const mechc_unit *unit, const char *name)
{
    for (int i = 0; i < unit->output_count; i++)
        if (!strcmp(unit->outputs[i].name, name)) return i;
    return -1;
}

static void mechc_watch_free(mechc_watch *watch)
{
    free(watch->event);
    free(watch->zero);
    free(watch->cause);
    free(watch->caused_at);
    free(watch->grid);
    free(watch->states);
    free(watch->rates);
    free(watch->slopes);
    free(watch->prepared);
    free(watch->impulse);
    free(watch->contacts);
    free(watch->touching);
    free(watch->points);
    free(watch->spare);
}

/* 0 without memory. */
static int mechc_watch_make(mechc_watch *watch, const mechc_unit *unit,
                            const mechc_event_unit *events, int coordinates, int speeds, int rows)
{
    const size_t width = (size_t)(coordinates + speeds), nu = (size_t)speeds, nc = (size_t)rows;
    const size_t k = (size_t)events->count;
    watch->unit = unit;
    watch->functions = events->functions;
    watch->count = events->count;
    watch->coordinates = coordinates;
    watch->speeds = speeds;
    watch->width = (int)width;
    watch->rows = rows;
    watch->mass = mechc_watch_output(unit, "mass_matrix");
    watch->jacobian = mechc_watch_output(unit, "constraint_jacobian");
    watch->residuals = mechc_watch_output(unit, "velocity_constraints");
    watch->event = calloc((size_t)events->count, sizeof *watch->event);
    watch->grid = malloc(MECHC_EVENT_POINTS * sizeof(double));
    watch->states = malloc(MECHC_EVENT_GRID * width * sizeof(double));
    watch->rates = malloc(4 * width * sizeof(double));
    watch->slopes = malloc((width + 1) * sizeof(double));
    watch->prepared = malloc(unit->given_size + sizeof(double));
    watch->impulse = malloc((nu * nu + 2 * nc * nu + 3 * nc + nu + 1) * sizeof(double));
    watch->contacts = malloc((k * (nu + 2 * k + 10) + nu + 1) * sizeof(double));
    watch->touching = malloc((3 * k + 1) * sizeof *watch->touching);
    watch->points = malloc(MECHC_EVENT_POINTS * sizeof *watch->points);
    watch->spare = malloc(MECHC_EVENT_POINTS * sizeof *watch->spare);
    return watch->event && watch->grid && watch->states && watch->rates && watch->slopes
        && watch->prepared && watch->impulse && watch->contacts && watch->touching && watch->points && watch->spare;
}

/* Of a new run; directions and numbers of zeros that end it stay. */
static void mechc_watch_begin(mechc_watch *watch, const mechc_options *options)
{
    watch->method = options->method;
    watch->p = options->p;
    watch->inputs = options->inputs;
    watch->scale = options->scale;
    watch->rtol = options->rtol;
    watch->sense = options->t1 >= options->t0 ? 1.0 : -1.0;
    watch->zeros = 0;
    watch->stopped_by = -1;
    for (int k = 0; k < watch->count; k++) {
        const mechc_event kept = watch->event[k];
        mechc_event *event = watch->event + k;
        memset(event, 0, sizeof *event);
        event->direction = kept.direction;
        event->terminal = kept.terminal;
        event->latest = event->grazing = event->too_fast = event->last = event->passed = NAN;
    }
}

/* How exactly a zero near t is located, s. */
static double mechc_located(double t)
{
    const double size = fabs(t);
    return fmax(2e-13, 4.0 * (nextafter(size, INFINITY) - size));
}

/* Whether an event changes the state. */
static int mechc_event_resets(const mechc_watch *watch, int event)
{
    return watch->functions[event].reset || watch->functions[event].restitution;
}

static double mechc_event_value(const mechc_watch *watch, int event, double t, const double *y)
{
    return watch->functions[event].value(t, y, watch->p);
}

/* States at `count` times of the motion at hand, into watch->states. */
static void mechc_watch_states(mechc_watch *watch, ptrdiff_t count, const double *t)
{
    watch->unit->interpolate(watch->method, watch->steps, watch->p, watch->inputs, count, t,
                             watch->states);
}

static double mechc_event_at(mechc_watch *watch, int event, double t)
{
    mechc_watch_states(watch, 1, &t);
    return mechc_event_value(watch, event, t, watch->states);
}

/* 0 without memory. */
static int mechc_watch_keep(mechc_watch *watch, int event, double t)
{
    if (watch->zeros == watch->room) {
        const ptrdiff_t room = 2 * watch->room + 16;
        mechc_event_zero *more = realloc(watch->zero, (size_t)room * sizeof *more);
        if (!more) return 0;
        watch->zero = more;
        watch->room = room;
    }
    watch->zero[watch->zeros++] = (mechc_event_zero){event, t};
    watch->event[event].count++;
    return 1;
}

/* One more event made the reset at hand, of the state y.  0 without memory. */
static int mechc_reset_note(mechc_watch *watch, int number, const double *y)
{
    const size_t width = (size_t)watch->width;
    if (watch->causes == watch->cause_room) {
        const int room = 2 * watch->cause_room + 8;
        int *more = realloc(watch->cause, (size_t)room * sizeof *more);
        if (more) watch->cause = more;
        double *states = realloc(watch->caused_at, (size_t)room * width * sizeof *states);
        if (states) watch->caused_at = states;
        if (!more || !states) return 0;
        watch->cause_room = room;
    }
    memcpy(watch->caused_at + (size_t)watch->causes * width, y, width * sizeof *y);
    watch->cause[watch->causes++] = number;
    return 1;
}
