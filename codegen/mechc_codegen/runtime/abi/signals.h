/* Inputs of the kinds that the runtime makes: numbers, piecewise polynomials, callbacks.
 *
 * Nothing here is compiled into a scene, which knows inputs.h alone.
 */
#pragma once

#include <stddef.h>
#include "inputs.h"

/* A piecewise polynomial, piece by piece in powers of the time since its knot; pieces outside
 * first .. last are not used, the outer ones of these reach on. */
typedef struct {
    ptrdiff_t first, last;
    int degree;
    const double *knots, *coefficients;
} mechc_signal;

/* The source of one value: a signal or, if that is NULL, the callback. */
typedef struct {
    const mechc_signal *signal;
    int order; /* of the derivative by time */
} mechc_source;

typedef struct {
    mechc_inputs head;
    const mechc_source *sources;
    void *caller;
    double (*call)(void *caller, int value, double t, const double *q, const double *u);
} mechc_driven;

static inline const double *mechc_signal_piece(const mechc_signal *signal, double t, double *since)
{
    ptrdiff_t low = signal->first, high = signal->last;
    while (low < high) {
        const ptrdiff_t middle = high - (high - low) / 2;
        if (t >= signal->knots[middle]) low = middle;
        else high = middle - 1;
    }
    *since = t - signal->knots[low];
    return signal->coefficients + low * (signal->degree + 1);
}

/* The value of a derivative, by Horner's scheme: c_n n (n-1) .. (n-order+1) s^(n-order) + .. */
static inline double mechc_signal_value(const mechc_signal *signal, int order, double t)
{
    double since, value = 0.0;
    const double *piece = mechc_signal_piece(signal, t, &since);
    for (int n = signal->degree; n >= order; n--) {
        double weight = 1.0;
        for (int k = 0; k < order; k++) weight *= n - k;
        value = value * since + weight * piece[n];
    }
    return value;
}

static inline void mechc_driven_evaluate(const mechc_inputs *inputs, int first, int last, double t,
                                         const double *q, const double *u, double *values)
{
    const mechc_driven *driven = (const mechc_driven *)inputs;
    for (int i = first; i < last; i++) {
        const mechc_source *source = &driven->sources[i];
        values[i - first] = source->signal ? mechc_signal_value(source->signal, source->order, t)
                                           : driven->call(driven->caller, i, t, q, u);
    }
}
