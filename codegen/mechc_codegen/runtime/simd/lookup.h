/* Lookup tables: piecewise polynomials of one or two numbers. */
#pragma once

#include <math.h>
#include "simd/scalar.h"

typedef struct {
    const double *starts; /* of the pieces; the first one goes on downwards */
    int count;
    double period; /* 0: none */
} mechc_table_axis;

typedef struct {
    int axis_count, degree;
    mechc_table_axis axes[2];
    const double *coefficients; /* as TableData in description/tables.py has them */
} mechc_table;

/* The last piece that begins at x or below; the first one for all that is below. */
MECHC_ONCE int mechc_piece_at(const double *starts, int count, double x)
{
    int low = 0, high = count;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (x >= starts[middle])
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* The derivative of this order, at h, of the polynomial with these coefficients, by Horner's rule. */
MECHC_INLINE double mechc_piece_value(const double *c, int degree, int order, double h)
{
    double sum = 0.0;
    for (int n = degree; n >= order; n--) {
        double term = c[n];
        for (int k = 0; k < order; k++) term *= n - k;
        sum = n == degree ? term : mechc_scalar_fused(sum, h, term);
    }
    return sum;
}

/* A derivative of the table: of this order in x, and in y where it has two axes. */
MECHC_INLINE double mechc_lookup(const mechc_table *table, int order, int order_of_y, double x, double y)
{
    double h[2] = {x, y};
    int piece[2] = {0, 0};
    for (int i = 0; i < table->axis_count; i++) {
        const mechc_table_axis *axis = table->axes + i;
        if (axis->period > 0.0)
            h[i] = mechc_scalar_fused(-axis->period, floor((h[i] - axis->starts[0]) / axis->period), h[i]);
        piece[i] = mechc_piece_at(axis->starts, axis->count, h[i]);
        h[i] -= axis->starts[piece[i]];
    }
    const int terms = table->degree + 1;
    if (table->axis_count == 1)
        return mechc_piece_value(table->coefficients + piece[0] * terms, table->degree, order, h[0]);
    const double *c = table->coefficients + (piece[0] * table->axes[1].count + piece[1]) * terms * terms;
    double sum = 0.0;
    for (int n = table->degree; n >= order; n--) {
        double term = mechc_piece_value(c + n * terms, table->degree, order_of_y, h[1]);
        for (int k = 0; k < order; k++) term *= n - k;
        sum = n == table->degree ? term : mechc_scalar_fused(sum, h[0], term);
    }
    return sum;
}
