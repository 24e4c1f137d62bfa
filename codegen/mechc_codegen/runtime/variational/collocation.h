/* The variational equations S' = A S + B over steps by collocation, on the nodes of the motion.
 *
 * Sizes are known at run time only: nothing here is compiled into scenes.  Matrices are stored row
 * by row.  The equations are linear, so the stages are solved for directly, all columns at once;
 * where q' = u the accelerations' columns are the only unknowns, as in the motion's own iteration.
 */
#pragma once

#include <math.h>
#include <stddef.h>
#include <string.h>
#include "simd/lanes.h"

typedef struct {
    int stages, states, columns;
    int coordinates;     /* where q' = u, as many as speeds; else 0 */
    const double *nodes; /* of a step */
    const double *first; /* integrals to each stage, then to the end: (stages + 1) x stages */
    const double *second; /* second integrals, likewise */
} mechc_collocation;

MECHC_INLINE int mechc_unknowns(const mechc_collocation *rule)
{
    return rule->stages * (rule->states - rule->coordinates);
}

/* Doubles of work space. */
MECHC_STATIC size_t mechc_collocation_work(const mechc_collocation *rule)
{
    const size_t size = (size_t)mechc_unknowns(rule);
    return size * (size + (size_t)rule->columns);
}

/* y += factor x */
MECHC_INLINE void mechc_add(double factor, const double *x, int count, double *y)
{
    for (int i = 0; i < count; i++) y[i] += factor * x[i];
}

/* Solve the rows [matrix | right sides] by elimination with row exchanges; the solution takes the
 * place of the right sides.  0 where a pivot vanishes. */
MECHC_STATIC int mechc_eliminate(double *rows, int size, int columns)
{
    const int width = size + columns;
    for (int j = 0; j < size; j++) {
        int best = j;
        for (int i = j + 1; i < size; i++)
            if (fabs(rows[i * width + j]) > fabs(rows[best * width + j])) best = i;
        double *row = rows + j * width, *other = rows + best * width;
        if (!(fabs(other[j]) > 0.0)) return 0;
        for (int k = j; best != j && k < width; k++) {
            const double kept = row[k];
            row[k] = other[k];
            other[k] = kept;
        }
        for (int i = j + 1; i < size; i++) {
            double *below = rows + i * width;
            const double factor = -below[j] / row[j];
            if (factor != 0.0) mechc_add(factor, row + j + 1, width - j - 1, below + j + 1);
        }
    }
    for (int j = size - 1; j >= 0; j--) {
        double *row = rows + j * width;
        for (int i = j + 1; i < size; i++)
            if (row[i] != 0.0) mechc_add(-row[i], rows + i * width + size, columns, row + size);
        for (int k = size; k < width; k++) row[k] /= row[j];
    }
    return 1;
}

/* Row i of stage a: its equation for the unknown rates of all stages. */
MECHC_STATIC void mechc_stage_row(const mechc_collocation *rule, double h, int a, int i,
                                  const double *jacobian, double *row)
{
    const int nq = rule->coordinates, size = rule->states - nq;
    const double *slopes = jacobian + (nq + i) * rule->states; /* of rate i by the state */
    for (int b = 0; b < rule->stages; b++) {
        double *block = row + b * size;
        const double once = h * rule->first[a * rule->stages + b];
        const double twice = nq ? h * h * rule->second[a * rule->stages + b] : 0.0;
        for (int k = 0; k < size; k++) block[k] = -once * slopes[nq + k];
        for (int k = 0; k < nq; k++) block[k] -= twice * slopes[k];
        if (a == b) block[i] += 1.0;
    }
}

/* The right sides of row i of stage a: its rate if no other rate moved the stage. */
MECHC_STATIC void mechc_stage_right(const mechc_collocation *rule, double h, int a, int i,
                                    const double *jacobian, const double *forced,
                                    const double *start, double *right)
{
    const int nq = rule->coordinates, columns = rule->columns;
    const double *slopes = jacobian + (nq + i) * rule->states;
    memcpy(right, forced + (nq + i) * columns, (size_t)columns * sizeof(double));
    for (int k = 0; k < rule->states; k++) mechc_add(slopes[k], start + k * columns, columns, right);
    for (int k = 0; k < nq; k++)
        mechc_add(h * rule->nodes[a] * slopes[k], start + (nq + k) * columns, columns, right);
}

/* Columns at node a (the end: a = stages) from the rates of the stages. */
MECHC_STATIC void mechc_stage_columns(const mechc_collocation *rule, double h, int a,
                                      const double *start, const double *rates, double *columns)
{
    const int wide = rule->columns, nq = rule->coordinates, size = rule->states - nq;
    const double node = a < rule->stages ? rule->nodes[a] : 1.0;
    memcpy(columns, start, (size_t)(rule->states * wide) * sizeof(double));
    mechc_add(h * node, start + nq * wide, nq * wide, columns);
    for (int b = 0; b < rule->stages; b++) {
        const double *of_stage = rates + b * size * wide;
        const double once = h * rule->first[a * rule->stages + b];
        const double twice = nq ? h * h * rule->second[a * rule->stages + b] : 0.0;
        mechc_add(once, of_stage, size * wide, columns + nq * wide);
        mechc_add(twice, of_stage, nq * wide, columns);
    }
}

/* One step: jacobian and forced are A and B at the stages, one after the other; start and end are
 * (states, columns).  rates: S' at the stages, (stages, states, columns).  0 where it is singular. */
MECHC_STATIC int mechc_collocate(const mechc_collocation *rule, double h, const double *jacobian,
                                 const double *forced, const double *start, double *work,
                                 double *rates, double *end)
{
    const int nx = rule->states, nq = rule->coordinates, size = nx - nq, wide = rule->columns;
    const int unknowns = mechc_unknowns(rule), width = unknowns + wide;
    for (int a = 0; a < rule->stages; a++)
        for (int i = 0; i < size; i++) {
            double *row = work + (a * size + i) * width;
            mechc_stage_row(rule, h, a, i, jacobian + a * nx * nx, row);
            mechc_stage_right(rule, h, a, i, jacobian + a * nx * nx, forced + a * nx * wide, start,
                              row + unknowns);
        }
    if (!mechc_eliminate(work, unknowns, wide)) return 0;
    for (int n = 0; n < unknowns; n++) /* the solution, without gaps */
        memmove(work + n * wide, work + n * width + unknowns, (size_t)wide * sizeof(double));
    for (int a = 0; a < rule->stages; a++) {
        double *of_stage = rates + a * nx * wide;
        memcpy(of_stage + nq * wide, work + a * size * wide, (size_t)(size * wide) * sizeof(double));
        if (!nq) continue;
        mechc_stage_columns(rule, h, a, start, work, end);
        memcpy(of_stage, end + nq * wide, (size_t)(nq * wide) * sizeof(double));
    }
    mechc_stage_columns(rule, h, rule->stages, start, work, end);
    return 1;
}
