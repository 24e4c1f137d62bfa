/* The constraints of one scene as functions of states, and the lengths of quaternions that may move.
 *
 * All multiples of a joint's quaternion are one attitude: its length is no freedom, and is one.
 */
#pragma once

#include <math.h>
#include <stddef.h>
#include <string.h>
#include "abi/macros.h"
#include "abi/model.h"

#define MECHC_ALIGNED 0.5 /* between axes that point the right way, 1, and others, 0 or -1 */

typedef enum {
    MECHC_GAPS,       /* of the configuration constraints */
    MECHC_GRADIENT,   /* of these over the coordinates */
    MECHC_RESIDUALS,  /* J u + b of all constraints */
    MECHC_JACOBIAN,   /* J, over the speeds */
    MECHC_PREFERENCE, /* the larger the better */
    MECHC_DIRECTIONS, /* of axes that cut joints hold: 1 where they point the right way */
    MECHC_CLOSURE_OUTPUTS
} mechc_closure_output;

typedef struct {
    const mechc_unit *unit;
    const mechc_inputs *inputs;
    int rows, columns;         /* of the gradient; the first `rows` count */
    int quaternions;           /* the last of these rows: |x|^2 = 1 */
    const int *component;      /* (quaternions, 4): places of x */
    const unsigned char *kind; /* of every coordinate */
    const int *alike; /* (rows,): the first row that is known to have the same unit */
    int output[MECHC_CLOSURE_OUTPUTS]; /* its index in the unit; -1: there is none */
    int breadth[MECHC_CLOSURE_OUTPUTS]; /* numbers a state */
    int of_scene[2];                    /* of gaps and gradient without quaternions */
    int coordinates, width, parameters;
    double t;
} mechc_closure;

/* Let the lengths of quaternions count, whose components are all unknown, after the scene's rows. */
MECHC_STATIC void mechc_close_with_lengths(mechc_closure *closure, int quaternions, const int *component)
{
    closure->quaternions = quaternions;
    closure->component = component;
    closure->rows += quaternions;
    for (int i = 0; i < 2; i++) closure->of_scene[i] = closure->breadth[i];
    closure->breadth[MECHC_GAPS] += quaternions;
    closure->breadth[MECHC_GRADIENT] += quaternions * closure->columns;
}

/* Add the rows |x|^2 / 2 - 1 / 2, or their gradients, to those of the scene, which lie dense. */
static void mechc_add_lengths(const mechc_closure *closure, mechc_closure_output what,
                              ptrdiff_t count, const double *y, double *out)
{
    const int breadth = closure->breadth[what], each = what == MECHC_GAPS ? 1 : closure->columns;
    const int first = (closure->rows - closure->quaternions) * each;
    for (ptrdiff_t k = count; k-- > 0;) {
        double *to = out + k * breadth, *row = to + first;
        memmove(to, out + k * closure->of_scene[what], (size_t)first * sizeof(double));
        memset(row, 0, (size_t)(breadth - first) * sizeof(double));
        for (int i = 0; i < closure->quaternions; i++, row += each) {
            if (what == MECHC_GAPS) *row = -0.5;
            for (int j = 0; j < 4; j++) {
                const int at = closure->component[4 * i + j];
                const double x = y[k * closure->width + at];
                if (what == MECHC_GAPS) *row += 0.5 * x * x;
                else row[at] = x;
            }
        }
    }
}

/* Evaluate an output of `count` states, row after row, with one set of parameters. */
static void mechc_ask(const mechc_closure *closure, mechc_closure_output what, ptrdiff_t count,
                      const double *y, const double *p, double *out)
{
    const mechc_rows t = {&closure->t, 0}, states = {y, closure->width}, parameters = {p, 0};
    closure->unit->outputs[closure->output[what]].evaluate(count, t, states, parameters,
                                                           closure->inputs, MECHC_NO_FORCES, out);
    if (closure->quaternions && what <= MECHC_GRADIENT)
        mechc_add_lengths(closure, what, count, y, out);
}

/* Whether axes that cut joints hold point against the right way, or across it: rows that keep axes
 * perpendicular are zero there too.  `cosine` has room for this output. */
static int mechc_is_turned(const mechc_closure *closure, const double *y, const double *p,
                           double *cosine)
{
    if (closure->output[MECHC_DIRECTIONS] < 0) return 0;
    mechc_ask(closure, MECHC_DIRECTIONS, 1, y, p, cosine);
    for (int i = 0; i < closure->breadth[MECHC_DIRECTIONS]; i++)
        if (!(cosine[i] > MECHC_ALIGNED)) return 1;
    return 0;
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
