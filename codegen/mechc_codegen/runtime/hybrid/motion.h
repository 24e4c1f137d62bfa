/* The current piece of a motion as events and contacts read it: parameters, inputs, steps, and
 * states between the steps. */
#pragma once

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/codes.h"
#include "abi/model.h"
#include "abi/macros.h"

/* Flags of the state's components without a length and of the parameters that are lengths, and
 * bounds of parameters; NULL: none. */
typedef struct {
    const unsigned char *dimensionless;
    const int *lengths;
    int length_count;
    const double *lowest, *highest;
} mechc_sizes;

typedef struct mechc_motion mechc_motion;
struct mechc_motion {
    const mechc_unit *unit;
    int coordinates, speeds, width, rows, parameters;
    int jacobian, residuals; /* places of these outputs in the unit; -1: none */
    mechc_sizes sizes;
    double *p, *scale;          /* present parameters; sizes of components by them */
    const mechc_inputs *inputs; /* between two kinks, */
    const mechc_inputs *whole;  /* and over the whole span, with which results are read */
    mechc_given *given;         /* made of these */
    const mechc_trajectory *steps; /* of the piece at hand */
    double rtol, sense;            /* sense: 1 forwards, -1 backwards in time */
    double last;                   /* the end of the span */
    const double *atol;            /* a component each, or NULL */
    /* for the current piece: states on its constraints, and rates of a state */
    void (*states)(mechc_motion *motion, ptrdiff_t count, const double *t, double *y);
    void (*rates)(const mechc_motion *motion, double t, const double *y, double *rates);
    void *contacts; /* for these, where contacts last */
};

MECHC_STATIC int mechc_is_finite(const double *values, int count)
{
    int finite = 1;
    for (int i = 0; i < count; i++) finite &= fabs(values[i]) < HUGE_VAL;
    return finite;
}

MECHC_STATIC double mechc_inner_product(const double *a, const double *b, int n)
{
    double sum = 0.0;
    for (int j = 0; j < n; j++) sum += a[j] * b[j];
    return sum;
}

MECHC_STATIC int mechc_output_of(const mechc_unit *unit, const char *name)
{
    for (int i = 0; i < unit->output_count; i++)
        if (!strcmp(unit->outputs[i].name, name)) return i;
    return -1;
}

MECHC_STATIC void mechc_motion_free(mechc_motion *motion)
{
    free(motion->p);
    free(motion->given);
}

/* Allocate for a scene of known sizes; `prepared`: rates of states are needed.  0 without memory. */
MECHC_STATIC int mechc_motion_make(mechc_motion *motion, int prepared)
{
    motion->width = motion->coordinates + motion->speeds;
    motion->jacobian = mechc_output_of(motion->unit, "constraint_jacobian");
    motion->residuals = mechc_output_of(motion->unit, "velocity_constraints");
    motion->p = malloc((size_t)(motion->parameters + motion->width + 1) * sizeof *motion->p);
    motion->given = prepared ? malloc(motion->unit->given_size) : 0;
    motion->scale = motion->p + motion->parameters;
    return motion->p && (motion->given || !prepared);
}

/* Adopt changed parameters and inputs. */
MECHC_STATIC void mechc_motion_renew(mechc_motion *motion)
{
    const mechc_sizes *sizes = &motion->sizes;
    double length = 0.0;
    for (int i = 0; i < sizes->length_count; i++)
        length = fmax(length, fabs(motion->p[sizes->lengths[i]]));
    for (int i = 0; i < motion->width; i++)
        motion->scale[i] = sizes->dimensionless[i] || !(length > 0.0) ? 1.0 : length;
    if (motion->given) motion->unit->give(motion->p, motion->inputs, motion->given);
}

/* Whether parameters are finite and within their bounds. */
MECHC_STATIC int mechc_motion_may_have(const mechc_motion *motion, const double *p)
{
    const mechc_sizes *sizes = &motion->sizes;
    int within = 1;
    for (int i = 0; sizes->lowest && i < motion->parameters; i++)
        within &= sizes->lowest[i] <= p[i] && p[i] <= sizes->highest[i];
    return within && mechc_is_finite(p, motion->parameters);
}

/* States of a piece without lasting contacts. */
MECHC_STATIC void mechc_free_states(mechc_motion *motion, ptrdiff_t count, const double *t, double *y)
{
    motion->unit->interpolate(1, motion->steps, motion->p, motion->inputs, count, t, y);
}

/* States of the current piece, also across kinks of inputs. */
MECHC_STATIC void mechc_read_states(mechc_motion *motion, ptrdiff_t count, const double *t, double *y)
{
    if (motion->states != mechc_free_states) motion->states(motion, count, t, y);
    else motion->unit->interpolate(1, motion->steps, motion->p, motion->whole, count, t, y);
}

/* Rates of a state without contacts, not projected. */
MECHC_STATIC void mechc_free_rates(const mechc_motion *motion, double t, const double *y, double *rates)
{
    motion->unit->rates(t, y, motion->given, rates);
}

MECHC_STATIC void mechc_motion_evaluate(const mechc_motion *motion, int output, double t, const double *y,
                                  double *out)
{
    const mechc_rows times = {&t, 0}, states = {y, motion->width}, p = {motion->p, 0};
    motion->unit->outputs[output].evaluate(1, times, states, p, motion->inputs, MECHC_NO_FORCES, out);
}
