/* The variational equations S' = A S + B over steps of an explicit pair, stage by stage: the
 * derivative of the step as it was taken.
 *
 * Sizes are known at run time only: nothing here is compiled into scenes.
 */
#pragma once

#include <string.h>
#include "simd/lanes.h"
#include "variational/collocation.h"

typedef struct {
    int rates, end, states, columns; /* rate `end` is taken at the step's end */
    const double *matrix;            /* rates x rates */
} mechc_explicit;

/* columns <- P columns + Q, where P and Q are not NULL; `moved` is work space. */
MECHC_STATIC void mechc_onto(const double *tangent, const double *offset, int states, int wide,
                             double *columns, double *moved)
{
    const size_t bytes = (size_t)(states * wide) * sizeof(double);
    if (!tangent) return;
    memcpy(moved, offset, bytes);
    for (int i = 0; i < states; i++)
        for (int k = 0; k < states; k++)
            mechc_add(tangent[i * states + k], columns + k * wide, wide, moved + i * wide);
    memcpy(columns, moved, bytes);
}

/* One step: A, B, P and Q at its rates, one after the other; P and Q may be NULL.  rates: S' there,
 * (rates, states, columns).  work: two matrices of columns. */
MECHC_STATIC void mechc_explicit_columns(const mechc_explicit *pair, double h,
                                         const double *jacobian, const double *forced,
                                         const double *tangents, const double *offsets,
                                         const double *start, double *work, double *rates,
                                         double *end)
{
    const int nx = pair->states, wide = pair->columns, whole = nx * wide;
    double *at = work, *moved = work + whole;
    for (int i = 0; i < pair->rates; i++) {
        const double *slopes = jacobian + i * nx * nx;
        double *own = rates + i * whole;
        memcpy(at, start, (size_t)whole * sizeof(double));
        for (int j = 0; j < i; j++)
            mechc_add(h * pair->matrix[i * pair->rates + j], rates + j * whole, whole, at);
        mechc_onto(tangents ? tangents + i * nx * nx : 0, offsets ? offsets + i * whole : 0, nx,
                   wide, at, moved);
        memcpy(own, forced + i * whole, (size_t)whole * sizeof(double));
        for (int row = 0; row < nx; row++)
            for (int k = 0; k < nx; k++)
                mechc_add(slopes[row * nx + k], at + k * wide, wide, own + row * wide);
        if (i == pair->end) memcpy(end, at, (size_t)whole * sizeof(double));
    }
}
