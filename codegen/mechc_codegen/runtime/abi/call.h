/* An output with its parameters bound, which C code can call without knowledge of the scene.
 *
 * A bound output lies in one block of memory from malloc and is released by free.  Calls keep
 * nothing and change nothing in it, so threads may share it. */
#pragma once

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model.h"

typedef struct {
    const mechc_unit *unit;
    mechc_evaluate *evaluate; /* NULL: the state rates */
    int states, width;        /* lengths of y and of out */
    const double *p;
    const mechc_inputs *inputs;
    const mechc_given *given;
    void *owner; /* of the inputs, for the program that binds */
} mechc_bound;

/* `output` is an index of unit->outputs, or -1 for the state rates; `inputs` may be NULL where it
 * holds none.  Returns NULL where memory is out. */
static inline mechc_bound *mechc_bind(const mechc_model *model, const mechc_unit *unit, int output,
                                      const double *p, const mechc_inputs *inputs)
{
    const size_t np = (size_t)model->parameters;
    mechc_bound *bound = malloc(sizeof *bound + np * sizeof(double) + unit->given_size);
    if (bound == NULL) return NULL;
    double *values = (double *)(bound + 1);
    mechc_given *given = (mechc_given *)(values + np);
    if (np > 0) memcpy(values, p, np * sizeof(double));
    unit->give(values, inputs, given);
    bound->unit = unit;
    bound->evaluate = output < 0 ? NULL : unit->outputs[output].evaluate;
    bound->states = model->coordinates + model->speeds;
    bound->width = output < 0 ? bound->states : unit->outputs[output].width;
    bound->p = values;
    bound->inputs = inputs;
    bound->given = given;
    bound->owner = NULL;
    return bound;
}

/* out = the bound output at (t, y). */
static inline void mechc_call(double t, const double *y, double *out, void *data)
{
    const mechc_bound *bound = data;
    if (bound->evaluate == NULL) {
        bound->unit->rates(t, y, bound->given, out);
    } else {
        const mechc_rows time = {&t, 0}, state = {y, 0}, parameters = {bound->p, 0};
        bound->evaluate(1, time, state, parameters, bound->inputs, MECHC_NO_FORCES, out);
    }
}

/* One component of a bound output along some of its arguments. */
typedef struct {
    const mechc_bound *of;
    int component, count;
    const int *places; /* in y; -1 is the time */
    const double *y;
    double t;
} mechc_along;

/* Create a component from `of`, which it then owns; mechc_let_go releases it.  NULL without memory. */
static inline mechc_along *mechc_follow(mechc_bound *of, int component, int count,
                                        const int *places, const double *y, double t)
{
    const size_t ny = (size_t)of->states, nplaces = (size_t)count;
    mechc_along *along = malloc(sizeof *along + ny * sizeof(double) + nplaces * sizeof(int));
    if (along == NULL) return NULL;
    double *state = (double *)(along + 1);
    int *kept = (int *)(state + ny);
    memcpy(state, y, ny * sizeof(double));
    memcpy(kept, places, nplaces * sizeof(int));
    *along = (mechc_along){of, component, count, kept, state, t};
    return along;
}

static inline void mechc_let_go(mechc_along *along)
{
    free((void *)along->of);
    free(along);
}

/* The component with the arguments at `places` set to x; NaN if their number is another. */
static inline double mechc_call_along(int count, double *x, void *data)
{
    const mechc_along *along = data;
    const mechc_bound *of = along->of;
    double t = along->t, y[of->states], out[of->width];
    if (count != along->count) return NAN;
    memcpy(y, along->y, sizeof y);
    for (int i = 0; i < count; i++) *(along->places[i] < 0 ? &t : &y[along->places[i]]) = x[i];
    mechc_call(t, y, out, (void *)of);
    return out[along->component];
}
