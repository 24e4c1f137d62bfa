/* Projection of a state onto the constraints by an impulse. */
#pragma once

#include "closing/least_change.h"
#include "closing/triangular.h"
#include "hybrid/motion.h"

/* The size of the work space, in numbers. */
MECHC_STATIC size_t mechc_impulse_room(const mechc_motion *motion)
{
    const size_t nu = (size_t)motion->speeds, nc = (size_t)motion->rows;
    return nu * nu + nc * (nu + 2) + nu + (size_t)motion->width;
}

/* Move a state onto the constraints: coordinates to the nearest that close the loops; speeds by the
 * impulse p with M (u+ - u) = J^T p, J u+ + b = 0, the change with the least kinetic energy.  0 if
 * there is no such state. */
MECHC_STATIC int mechc_onto_constraints(const mechc_motion *motion, double t, double *y, double *room)
{
    const int rows = motion->rows, n = motion->speeds, first = motion->coordinates;
    double *mass = room, *weighted = mass + n * n, *missing = weighted + rows * n;
    double *lengths = missing + rows, *change = lengths + rows, *given = change + n, moved[2];
    if (!rows) return 1;
    memcpy(given, y, (size_t)motion->width * sizeof(double));
    if (motion->unit->project(t, y, motion->p, motion->inputs, moved) != MECHC_RUNNING) return 0;
    memcpy(y + first, given + first, (size_t)n * sizeof(double));
    mechc_motion_evaluate(motion, motion->residuals, t, y, missing);
    mechc_motion_evaluate(motion, motion->jacobian, t, y, weighted);
    motion->unit->mass(t, y, motion->given, mass);
    if (!mechc_cholesky(mass, n)) return 0;
    for (int i = 0; i < rows; i++) mechc_solve_lower(mass, n, weighted + i * n);
    mechc_least_change(weighted, missing, rows, n, DBL_EPSILON * (n > rows ? n : rows), lengths,
                       change);
    mechc_solve_upper(mass, n, change);
    for (int i = 0; i < n; i++) y[first + i] -= change[i];
    motion->unit->project(t, y, motion->p, motion->inputs, moved);
    return 1;
}
