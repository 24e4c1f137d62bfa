/* The constraints of one scene as functions of states. */
#pragma once

#include <math.h>
#include <stddef.h>
#include "abi/model.h"

typedef enum {
    MECHC_GAPS,       /* of the configuration constraints */
    MECHC_GRADIENT,   /* of these over the coordinates */
    MECHC_RESIDUALS,  /* J u + b of all constraints */
    MECHC_JACOBIAN,   /* J, over the speeds */
    MECHC_PREFERENCE, /* the larger the better */
    MECHC_CLOSURE_OUTPUTS
} mechc_closure_output;

typedef struct {
    const mechc_unit *unit;
    const mechc_inputs *inputs;
    int rows, columns;         /* of the gradient; the first `rows` count */
    const unsigned char *kind; /* of every coordinate */
    const int *alike; /* (rows,): the first row that is known to have the same unit */
    int output[MECHC_CLOSURE_OUTPUTS]; /* its index in the unit; -1: there is none */
    int breadth[MECHC_CLOSURE_OUTPUTS]; /* numbers a state */
    int coordinates, width, parameters;
    double t;
} mechc_closure;

/* Evaluate an output of `count` states, row after row, with one set of parameters. */
static void mechc_ask(const mechc_closure *closure, mechc_closure_output what, ptrdiff_t count,
                      const double *y, const double *p, double *out)
{
    const mechc_rows t = {&closure->t, 0}, states = {y, closure->width}, parameters = {p, 0};
    closure->unit->outputs[closure->output[what]].evaluate(count, t, states, parameters,
                                                           closure->inputs, MECHC_NO_FORCES, out);
}

static void mechc_close_swap(double *a, double *b, int count)
{
    for (int i = 0; i < count; i++) {
        const double kept = a[i];
        a[i] = b[i];
        b[i] = kept;
    }
}

static double mechc_square(const double *values, int count)
{
    double square = 0.0;
    for (int i = 0; i < count; i++) square += values[i] * values[i];
    return square;
}
