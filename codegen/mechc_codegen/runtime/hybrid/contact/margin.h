/* The margin of a mode: the distance of its forces from their limits. */
#pragma once

#include "hybrid/contact/problem.h"

#define MECHC_SIMPLEX_ZERO 1e-12 /* of the largest entry: what is rounding in the tableau */

typedef enum { MECHC_LIFTS, MECHC_RELEASES } mechc_limit_kind;

/* A quantity that has to stay above 0: a x_i + b x_k + c; i or k is -1 where a term is missing. */
typedef struct {
    mechc_limit_kind kind;
    int contact, i, k;
    double a, b, c;
} mechc_limit;

MECHC_STATIC int mechc_unknown_of(const mechc_answer *answer, int contact, int friction)
{
    for (int i = 0; i < answer->count; i++)
        if (answer->contact[i] == contact && answer->friction[i] == friction) return i;
    return -1;
}

/* The limits of a mode, at most two for each contact: normal forces press, and sticking contacts
 * need no more than their friction.  Returns their number. */
MECHC_STATIC int mechc_limits_of(const mechc_answer *answer, mechc_limit *limit)
{
    const mechc_problem *of = answer->of;
    int count = 0;
    for (int k = 0; k < of->n; k++) {
        const int normal = mechc_unknown_of(answer, k, 0), friction = mechc_unknown_of(answer, k, 1);
        const double most = of->sticking[k];
        if (answer->mode[k] == MECHC_STICKS) {
            const double known = !of->has_gap[k] ? most : of->restored ? most * of->restored[k] : 0.0;
            limit[count++] = (mechc_limit){MECHC_RELEASES, k, normal, friction, most, -1.0, known};
            limit[count++] = (mechc_limit){MECHC_RELEASES, k, normal, friction, most, 1.0, known};
        } else if (answer->mode[k] != MECHC_OPEN && of->has_gap[k])
            limit[count++] = (mechc_limit){MECHC_LIFTS, k, normal, -1, 1.0, 0.0, 0.0};
    }
    return count;
}

MECHC_STATIC double mechc_limit_value(const mechc_answer *answer, const mechc_limit *limit)
{
    return limit->c + (limit->i >= 0 ? limit->a * answer->unknown[limit->i] : 0.0)
         + (limit->k >= 0 ? limit->b * answer->unknown[limit->k] : 0.0);
}

/* Exchange the basic column of a row for another column of the tableau. */
MECHC_STATIC void mechc_pivot(double *tableau, int rows, int columns, int row, int column)
{
    double *own = tableau + row * columns;
    const double by = own[column];
    for (int j = 0; j < columns; j++) own[j] /= by;
    for (int i = 0; i <= rows; i++) {
        double *other = tableau + i * columns;
        const double factor = other[column];
        if (i == row || factor == 0.0) continue;
        for (int j = 0; j < columns; j++) other[j] -= factor * own[j];
    }
}

/* Minimise the costs, the last row of the tableau, choosing columns of least number, so that no
 * basis repeats (Bland 1977, Math.  Oper.  Res.  2).  The last column is the right side; only the
 * first `allowed` columns enter. */
MECHC_STATIC void mechc_simplex(double *tableau, int rows, int columns, int allowed, int *basis, double zero)
{
    for (;;) {
        int enters = 0, leaves = -1;
        while (enters < allowed && !(tableau[rows * columns + enters] < -zero)) enters++;
        if (enters == allowed) return;
        for (int i = 0; i < rows; i++) {
            const double *row = tableau + i * columns, *best = tableau + leaves * columns;
            if (!(row[enters] > zero)) continue;
            const double step = row[columns - 1] / row[enters];
            const double least = leaves < 0 ? HUGE_VAL : best[columns - 1] / best[enters];
            if (step < least || (step == least && basis[i] < basis[leaves])) leaves = i;
        }
        if (leaves < 0) return;
        mechc_pivot(tableau, rows, columns, leaves, enters);
        basis[leaves] = enters;
    }
}

/* The least c^T w over w >= 0 with A w = b, b >= 0; HUGE_VAL if there is no such w.  The tableau
 * has rows A, 1 for each row's own column, b, and room for one more row. */
MECHC_STATIC double mechc_least_cost(double *tableau, int rows, int count, const double *cost, int *basis)
{
    const int columns = count + rows + 1;
    double *last = tableau + rows * columns, largest = 1.0;
    for (int i = 0; i < rows * columns; i++) largest = fmax(largest, fabs(tableau[i]));
    const double zero = MECHC_SIMPLEX_ZERO * largest;
    for (int j = 0; j < columns; j++) {
        last[j] = 0.0;
        for (int i = 0; i < rows && (j < count || j == columns - 1); i++)
            last[j] -= tableau[i * columns + j];
    }
    for (int i = 0; i < rows; i++) basis[i] = count + i;
    mechc_simplex(tableau, rows, columns, count, basis, zero);
    if (-last[columns - 1] > zero * (rows + 1)) return HUGE_VAL;
    for (int i = 0; i < rows; i++) { /* rows that depend on others keep their own columns, at 0 */
        int j = 0;
        while (basis[i] >= count && j < count && !(fabs(tableau[i * columns + j]) > zero)) j++;
        if (basis[i] < count || j == count) continue;
        mechc_pivot(tableau, rows, columns, i, j);
        basis[i] = j;
    }
    for (int j = 0; j < columns; j++) {
        last[j] = j < count ? cost[j] : 0.0;
        for (int i = 0; i < rows; i++)
            if (basis[i] < count) last[j] -= cost[basis[i]] * tableau[i * columns + j];
    }
    for (int i = 0; i < rows; i++) if (basis[i] < count) last[basis[i]] = 0.0;
    mechc_simplex(tableau, rows, columns, count, basis, zero);
    return -last[columns - 1];
}

/* The largest least limit over all forces with G x = aim, by the dual of this linear program: the least
 * weighted limit over weights that sum to 1 and along which no force of G x = 0 acts.  It is bounded by the
 * size, as forces may grow without bound in jammed contacts. -HUGE_VAL without memory. */
MECHC_STATIC double mechc_largest_margin(const mechc_answer *answer, const mechc_limit *limit, int count)
{
    const int n = answer->count, rows = n + 1, columns = count + rows + 1;
    double *kernel = calloc((size_t)(n * n + n + (rows + 1) * columns + count) + 1, sizeof *kernel);
    int *basis = calloc((size_t)rows, sizeof *basis);
    double *lengths = kernel + n * n, *tableau = lengths + n, *cost = tableau + (rows + 1) * columns;
    double least = -HUGE_VAL;
    if (kernel && basis) {
        memcpy(kernel, answer->matrix, (size_t)(n * n) * sizeof *kernel);
        mechc_orthogonal_rows(kernel, NULL, n, n, lengths);
        const double longest = mechc_largest(lengths, n);
        for (int j = 0; j < count; j++) {
            const mechc_limit *one = limit + j;
            const double newton = mechc_of_one_newton(answer->of, one->contact);
            cost[j] = newton * mechc_limit_value(answer, one);
            if (one->i >= 0) tableau[one->i * columns + j] = newton * one->a;
            if (one->k >= 0) tableau[one->k * columns + j] = newton * one->b;
            for (int i = 0; i < n; i++) { /* less what lies along the rows of G */
                const double *row = kernel + i * n;
                double share = 0.0;
                if (!(lengths[i] > MECHC_CONTACT_DEPENDENT * longest)) continue;
                for (int k = 0; k < n; k++) share += row[k] * tableau[k * columns + j];
                share /= lengths[i] * lengths[i];
                for (int k = 0; k < n; k++) tableau[k * columns + j] -= share * row[k];
            }
            tableau[n * columns + j] = 1.0;
        }
        for (int i = 0; i < rows; i++) tableau[i * columns + count + i] = 1.0;
        tableau[n * columns + columns - 1] = 1.0;
        least = fmin(mechc_least_cost(tableau, rows, count, cost, basis), answer->size);
    }
    free(kernel);
    free(basis);
    return least;
}

/* The least of the limits, m/s^2; its largest possible value if forces are not unique. */
MECHC_STATIC double mechc_answer_margin(const mechc_answer *answer, mechc_limit *limit)
{
    const int count = mechc_limits_of(answer, limit);
    double least = HUGE_VAL;
    if (count && mechc_answer_is_redundant(answer)) return mechc_largest_margin(answer, limit, count);
    for (int i = 0; i < count; i++) {
        const double newton = mechc_of_one_newton(answer->of, limit[i].contact);
        least = fmin(least, newton * mechc_limit_value(answer, limit + i));
    }
    return least;
}
