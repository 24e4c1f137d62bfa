/* The constraints of one scene as functions of states, from compiled code or from a function. */
#ifndef MECHC_CLOSURE_H
#define MECHC_CLOSURE_H

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

/* `ask` evaluates output `what` of `count` states, row after row, with one set of parameters. */
typedef struct mechc_closure mechc_closure;
struct mechc_closure {
    void (*ask)(const mechc_closure *closure, int what, ptrdiff_t count, const double *y,
                const double *p, double *out);
    const mechc_unit *unit;
    const mechc_inputs *inputs;
    void *caller;                      /* of a function in place of a unit */
    int output[MECHC_CLOSURE_OUTPUTS]; /* its index in the unit; -1: there is none */
    int breadth[MECHC_CLOSURE_OUTPUTS]; /* numbers a state */
    int coordinates, width, parameters;
    double t;
};

static void mechc_ask_unit(const mechc_closure *closure, int what, ptrdiff_t count, const double *y,
                           const double *p, double *out)
{
    const mechc_rows t = {&closure->t, 0}, states = {y, closure->width}, parameters = {p, 0};
    closure->unit->outputs[closure->output[what]].evaluate(count, t, states, parameters,
                                                           closure->inputs, out);
}

static double mechc_square(const double *values, int count)
{
    double square = 0.0;
    for (int i = 0; i < count; i++) square += values[i] * values[i];
    return square;
}

#endif
