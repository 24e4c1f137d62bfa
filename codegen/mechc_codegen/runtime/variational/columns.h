/* Columns of derivatives, MECHC_LANES of them in a vector, and derivatives at states along them. */
#pragma once

#include <stdlib.h>
#include "abi/variation.h"
#include "run/memory.h"
#include "variational/states.h"

#if MECHC_VARIATIONAL
typedef struct {
    int place, column; /* of parameters and then inputs; of the columns */
    double value;
} mechc_change;

/* How parameters and inputs change along the columns.  Derivatives at a state along them take
 * `block` doubles: NX x NX by the state, and from MECHC_BY_STATE on NX rows of `width` vectors. */
typedef struct {
    int columns, width; /* width: in vectors */
    int count;
    size_t block;
    mechc_change *changes;
    mechc_vector *lanes; /* of several states */
    const mechc_shapes *shapes; /* or NULL */
    mechc_vector *factors; /* of the shapes, at several times */
} mechc_directions;

#define MECHC_BY_STATE ((MECHC_NX * MECHC_NX + MECHC_LANES - 1) / MECHC_LANES * MECHC_LANES)

MECHC_STATIC void mechc_free_directions(mechc_directions *d)
{
    free(d->changes);
    mechc_free_aligned(d->lanes);
    mechc_free_aligned(d->factors);
}

MECHC_STATIC mechc_vector *mechc_new_vectors(size_t count)
{
    return mechc_new_aligned((count + 1) * sizeof(mechc_vector));
}

/* Allocate and set the directions; 0 without memory. */
MECHC_STATIC int mechc_take_directions(const double *given, int columns,
                                       const mechc_shapes *shapes, mechc_directions *d)
{
    d->columns = columns;
    d->width = (columns + MECHC_LANES - 1) / MECHC_LANES;
    d->block = MECHC_BY_STATE + (size_t)(MECHC_NX * d->width * MECHC_LANES);
    d->count = 0;
    d->changes = malloc((size_t)(MECHC_NB * columns + 1) * sizeof(mechc_change));
    d->lanes = mechc_new_vectors(d->block);
    d->shapes = shapes;
    d->factors = mechc_new_vectors(shapes ? (size_t)shapes->count : 0);
    if (!d->changes || !d->lanes || !d->factors) return 0;
    for (int i = 0; i < MECHC_NB; i++)
        for (int k = 0; k < columns; k++)
            if (given[i * columns + k] != 0.0)
                d->changes[d->count++] = (mechc_change){i, k, given[i * columns + k]};
    memset(d->lanes, 0, d->block * sizeof(mechc_vector));
    return 1;
}

/* Copy a row of numbers into vectors padded with zeros, and back. */
MECHC_INLINE void mechc_pad(const double *row, int columns, int width, mechc_vector *to)
{
    for (int v = 0; v < width; v++) {
        double lanes[MECHC_LANES] = {0.0};
        for (int k = 0; k < MECHC_LANES && v * MECHC_LANES + k < columns; k++)
            lanes[k] = row[v * MECHC_LANES + k];
        memcpy(&to[v], lanes, sizeof lanes);
    }
}

MECHC_INLINE void mechc_unpad(const mechc_vector *from, int columns, double *row)
{
    memcpy(row, from, (size_t)columns * sizeof(double));
}

/* Store groups `first` ... last - 1 of MECHC_LANES numbers of each state in its block. */
MECHC_INLINE void mechc_empty_groups(const mechc_directions *d, int first, int last, int count,
                                     double *out)
{
    for (int group = first; group < last; group++) {
        double rows[MECHC_LANES * MECHC_LANES];
        double *to = out + group * MECHC_LANES;
        mechc_scatter_block(d->lanes + group * MECHC_LANES, MECHC_LANES, rows);
        for (int lane = 0; lane < count; lane++)
            memcpy(to + lane * d->block, rows + lane * MECHC_LANES, sizeof(mechc_vector));
    }
}

/* The factors of the shapes at `count` <= MECHC_LANES times. */
MECHC_STATIC void mechc_take_factors(const mechc_directions *d, const double *t, int count)
{
    const mechc_shapes *shapes = d->shapes;
    double *const factors = (double *)d->factors;
    for (int lane = 0; lane < MECHC_LANES; lane++)
        for (int n = 0; n < shapes->count; n++)
            shapes->factors->evaluate(shapes->factors, n, n + 1, t[lane < count ? lane : count - 1],
                                      0, 0, factors + n * MECHC_LANES + lane);
}

/* Derivatives at `count` <= MECHC_LANES times and states, rows `first` ... NX - 1 of MECHC_SLOPES, along the
 * columns; without times those of the shapes are left out. */
MECHC_INLINE void mechc_along_columns(const mechc_vector *slopes, int first, const double *t,
                                      int count, const mechc_directions *d, double *out)
{
    const int wide = d->width * MECHC_LANES, square = MECHC_BY_STATE / MECHC_LANES;
    const int shaped = d->shapes && t ? d->shapes->count : 0;
    if (shaped) mechc_take_factors(d, t, count);
    for (int i = first; i < MECHC_NX; i++) {
        mechc_vector *const row = d->lanes + MECHC_BY_STATE + i * wide;
        const mechc_vector *const from = slopes + i * MECHC_SLOPES + MECHC_NX;
        for (int k = 0; k < MECHC_NX; k++)
            d->lanes[i * MECHC_NX + k] = slopes[i * MECHC_SLOPES + k];
        for (int k = 0; k < d->columns; k++) row[k] = mechc_spread(0.0);
        for (const mechc_change *c = d->changes; c < d->changes + d->count; c++)
            row[c->column] += c->value * from[c->place];
        for (int n = 0; n < shaped; n++)
            row[d->shapes->columns[n]] += d->factors[n] * from[d->shapes->places[n]];
    }
    mechc_empty_groups(d, first * MECHC_NX / MECHC_LANES, square, count, out);
    mechc_empty_groups(d, square + first * d->width, square + MECHC_NX * d->width, count, out);
}

/* The states among `count` <= MECHC_LANES that the method keeps on the constraints. */
MECHC_STATIC mechc_mask mechc_kept_states(int method, const mechc_given_twice *given, int count,
                                          const double *t, const double *y)
{
    mechc_vector time, state[MECHC_NX_MAX];
    mechc_fill_lanes(t, count, 1, &time);
    mechc_fill_lanes(y, count, MECHC_NX, state);
    return mechc_keeps(method, state, time, given);
}

/* Rates at `count` states and their derivatives along the columns; states in lanes of the mask are
 * first moved onto the constraints, and their derivatives are those of the rates of the projected
 * state. */
MECHC_ONCE void mechc_linearise_states(mechc_mask along, const mechc_given_twice *given, int count,
                                       const double *t, const double *y,
                                       const mechc_directions *d, double *rates, double *slopes)
{
    mechc_vector time, state[MECHC_NX_MAX], rate[MECHC_NX_MAX], block[MECHC_NX_MAX * MECHC_SLOPES_MAX];
    const int kept = mechc_any(along);
    const int first = MECHC_IDENTITY_KINEMATICS && !kept ? MECHC_NQ : 0; /* q' = u is known */
    mechc_fill_lanes(t, count, 1, &time);
    mechc_fill_lanes(y, count, MECHC_NX, state);
    if (kept) mechc_keep_lanes(given, t, count, along, state);
    mechc_vector_linearise(time, state, &given->vector, along, rate, block);
    if (rates) mechc_empty_lanes(rate, count, MECHC_NX, rates);
    mechc_along_columns(block, first, t, count, d, slopes);
}

/* Derivatives of the projection of the ends of the steps. */
MECHC_STATIC void mechc_end_tangents(const mechc_steps *steps, const mechc_directions *d, double *tangents)
{
#if MECHC_NC_MAX > 0
    mechc_vector block[MECHC_NX_MAX * MECHC_SLOPES_MAX];
    double t[MECHC_LANES];
    mechc_tangents_in_lanes(steps, t, block);
    mechc_along_columns(block, 0, t, steps->count, d, tangents);
#else
    (void)steps, (void)d, (void)tangents;
#endif
}

/* One vector of row i: along the columns `at`, `stride` from component to component. */
MECHC_INLINE mechc_vector mechc_row_along(const double *slopes, int i, int width, int block,
                                          const mechc_vector *at, int stride)
{
    const double *row = slopes + i * MECHC_NX;
    mechc_vector sum = ((const mechc_vector *)(slopes + MECHC_BY_STATE))[i * width + block];
    for (int k = 0; k < MECHC_NX; k++) sum += row[k] * at[k * stride];
    return sum;
}

/* Move a vector of columns onto the tangent space. */
MECHC_INLINE void mechc_onto_tangent(const double *tangent, int width, int block,
                                     mechc_vector *columns)
{
    mechc_vector before[MECHC_NX_MAX];
    if (MECHC_NC == 0) return;
    memcpy(before, columns, MECHC_NX * sizeof *before);
    for (int i = 0; i < MECHC_NX; i++)
        columns[i] = mechc_row_along(tangent, i, width, block, before, 1);
}
#endif
