/* A growing record of accepted states and of the dense output between them. */
#pragma once

#include <stdlib.h>
#include "abi/run.h"
#include "run/turns.h"

MECHC_STATIC int mechc_grow(double **array, ptrdiff_t doubles)
{
    double *larger = realloc(*array, (size_t)doubles * sizeof(double));
    if (!larger) return 0;
    *array = larger;
    return 1;
}

/* Make room for one more state and the dense rows before it; 0 without memory. */
MECHC_STATIC int mechc_make_room(mechc_trajectory *trajectory)
{
    if (trajectory->count < trajectory->capacity) return 1;
    const ptrdiff_t first = trajectory->last_only ? 2 : 64;
    const ptrdiff_t capacity = trajectory->capacity ? 2 * trajectory->capacity : first;
    const ptrdiff_t width = trajectory->width;
    if (!mechc_grow(&trajectory->t, capacity) || !mechc_grow(&trajectory->y, capacity * width))
        return 0;
    if (trajectory->dense_rows) {
        unsigned char *methods = realloc(trajectory->methods, (size_t)capacity);
        if (!methods) return 0;
        trajectory->methods = methods;
        if (!mechc_grow(&trajectory->dense, capacity * width * trajectory->dense_rows)) return 0;
    }
    trajectory->capacity = capacity;
    return 1;
}

/* Drop a state, except for its time. */
MECHC_STATIC void mechc_drop(mechc_trajectory *trajectory, double t)
{
    trajectory->dropped[1] = trajectory->dropped[0];
    trajectory->dropped[0] = t;
    trajectory->dropped_count = trajectory->dropped_count ? 2 : 1;
    trajectory->count = 0;
}

MECHC_STATIC int mechc_append(mechc_trajectory *trajectory, double t, const double *y)
{
    if (trajectory->last_only && trajectory->count) mechc_drop(trajectory, trajectory->t[0]);
    if (!mechc_make_room(trajectory)) return 0;
    trajectory->t[trajectory->count] = t;
    memcpy(trajectory->y + trajectory->count * trajectory->width, y,
           (size_t)trajectory->width * sizeof(double));
    trajectory->count++;
    return 1;
}

/* Append a crossing of a change point; q has `coordinates` of them. */
MECHC_STATIC int mechc_append_crossing(mechc_trajectory *trajectory, double t, double gap,
                                       const double *q, int coordinates)
{
    if (trajectory->crossing_count == trajectory->crossing_capacity) {
        const ptrdiff_t capacity = 2 * trajectory->crossing_capacity + 8;
        if (!mechc_grow(&trajectory->crossings, capacity * (coordinates + 2))) return 0;
        trajectory->crossing_capacity = capacity;
    }
    double *row = trajectory->crossings + trajectory->crossing_count++ * (coordinates + 2);
    row[0] = t;
    row[1] = gap;
    memcpy(row + 2, q, (size_t)coordinates * sizeof(double));
    return 1;
}

/* Append a state from whose angles turns were removed. */
MECHC_STATIC int mechc_append_turned(mechc_trajectory *trajectory, double t, const double *y,
                                     const double *turns)
{
    if (!mechc_append(trajectory, t, y)) return 0;
    mechc_give_turns(turns, trajectory->y + (trajectory->count - 1) * trajectory->width);
    return 1;
}

MECHC_STATIC void mechc_free(mechc_trajectory *trajectory)
{
    free(trajectory->t);
    free(trajectory->y);
    free(trajectory->dense);
    free(trajectory->methods);
    free(trajectory->crossings);
    trajectory->crossings = 0;
    trajectory->crossing_count = trajectory->crossing_capacity = 0;
    trajectory->t = trajectory->y = trajectory->dense = 0;
    trajectory->methods = 0;
    trajectory->count = trajectory->capacity = 0;
}

/* The step that holds t: largest i with t[i] before t in the direction of the run. */
MECHC_STATIC ptrdiff_t mechc_step_of(const mechc_trajectory *trajectory, double t)
{
    const double *times = trajectory->t;
    const double direction = times[trajectory->count - 1] >= times[0] ? 1.0 : -1.0;
    ptrdiff_t low = 0, high = trajectory->count - 1;
    while (high - low > 1) {
        const ptrdiff_t middle = low + (high - low) / 2;
        if (direction * (t - times[middle]) >= 0.0) low = middle;
        else high = middle;
    }
    return low;
}

/* Whether this step holds t. */
MECHC_STATIC int mechc_holds(const mechc_trajectory *trajectory, ptrdiff_t step, double t)
{
    const double *times = trajectory->t;
    const ptrdiff_t last = trajectory->count - 1;
    const double direction = times[last] >= times[0] ? 1.0 : -1.0;
    return step < last && direction * (t - times[step]) >= 0.0
        && (step + 1 == last || direction * (t - times[step + 1]) < 0.0);
}

/* The step that holds t, as of mechc_step_of, found at once if it is the step `near` or the next
 * one: requested times are mostly in order. */
MECHC_STATIC ptrdiff_t mechc_step_near(const mechc_trajectory *trajectory, ptrdiff_t near, double t)
{
    if (mechc_holds(trajectory, near, t)) return near;
    if (mechc_holds(trajectory, near + 1, t)) return near + 1;
    return mechc_step_of(trajectory, t);
}
