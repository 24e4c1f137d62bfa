/* A state put onto the constraints by an impulse. */
#pragma once

#include <float.h>
#include "closing/least_change.h"
#include "closing/triangular.h"
#include "events/watch.h"

static void mechc_watch_evaluate(const mechc_watch *watch, int output, double t, const double *y,
                                 double *out)
{
    const mechc_rows times = {&t, 0}, states = {y, watch->width}, p = {watch->p, 0};
    watch->unit->outputs[output].evaluate(1, times, states, p, watch->inputs, out);
}

/* Move a state onto the constraints: coordinates to the nearest that close the loops; speeds by the
 * impulse p with M (u+ - u) = J^T p, J u+ + b = 0, which takes the least kinetic energy in the
 * difference.  0 where there is no such state. */
static int mechc_onto_constraints(mechc_watch *watch, double t, double *y)
{
    const int rows = watch->rows, n = watch->speeds, first = watch->coordinates;
    double *mass = watch->impulse, *weighted = mass + n * n, *missing = weighted + rows * n;
    double *lengths = missing + rows, *change = lengths + rows, moved[2];
    double *given = watch->rates + 3 * watch->width;
    if (!rows) return 1;
    memcpy(given, y, (size_t)watch->width * sizeof(double));
    if (watch->unit->project(t, y, watch->p, watch->inputs, moved) != MECHC_RUNNING) return 0;
    memcpy(y + first, given + first, (size_t)n * sizeof(double));
    mechc_watch_evaluate(watch, watch->residuals, t, y, missing);
    mechc_watch_evaluate(watch, watch->jacobian, t, y, weighted);
    mechc_watch_evaluate(watch, watch->mass, t, y, mass);
    if (!mechc_cholesky(mass, n)) return 0;
    for (int i = 0; i < rows; i++) mechc_solve_lower(mass, n, weighted + i * n);
    mechc_least_change(weighted, missing, rows, n, DBL_EPSILON * (n > rows ? n : rows), lengths,
                       change);
    mechc_solve_upper(mass, n, change);
    for (int i = 0; i < n; i++) y[first + i] -= change[i];
    watch->unit->project(t, y, watch->p, watch->inputs, moved);
    return 1;
}
