/* The least x with A x = b, for rows that may be dependent. */
#pragma once

#include <float.h>
#include <math.h>

#define MECHC_JACOBI_SWEEPS 30

/* Rotate rows i and j of A, and of b if there is one, until they are orthogonal; tells whether they were. */
static int mechc_turn_rows(double *a, double *b, int columns, int i, int j)
{
    double *first = a + i * columns, *second = a + j * columns;
    double one = 0.0, two = 0.0, both = 0.0;
    for (int k = 0; k < columns; k++) {
        one += first[k] * first[k];
        two += second[k] * second[k];
        both += first[k] * second[k];
    }
    if (!(fabs(both) > 4.0 * DBL_EPSILON * sqrt(one * two))) return 1;
    const double slope = (two - one) / (2.0 * both);
    const double tangent = copysign(1.0, slope) / (fabs(slope) + sqrt(1.0 + slope * slope));
    const double cosine = 1.0 / sqrt(1.0 + tangent * tangent), sine = cosine * tangent;
    for (int k = 0; k < columns; k++) {
        const double kept = first[k];
        first[k] = cosine * kept - sine * second[k];
        second[k] = sine * kept + cosine * second[k];
    }
    if (b) {
        const double kept = b[i];
        b[i] = cosine * kept - sine * b[j];
        b[j] = sine * kept + cosine * b[j];
    }
    return 0;
}

/* Make the rows of A orthogonal by rotations of rows: their lengths are then the singular values
 * (one-sided Jacobi method, Hestenes 1958), which are written to `lengths`. */
static void mechc_orthogonal_rows(double *a, double *b, int rows, int columns, double *lengths)
{
    int settled = 0;
    for (int sweep = 0; !settled && sweep < MECHC_JACOBI_SWEEPS; sweep++) {
        settled = 1;
        for (int i = 0; i < rows; i++)
            for (int j = i + 1; j < rows; j++) settled &= mechc_turn_rows(a, b, columns, i, j);
    }
    for (int i = 0; i < rows; i++) {
        lengths[i] = 0.0;
        for (int k = 0; k < columns; k++)
            lengths[i] += a[i * columns + k] * a[i * columns + k];
        lengths[i] = sqrt(lengths[i]);
    }
}

static double mechc_largest(const double *values, int count)
{
    double largest = 0.0;
    for (int i = 0; i < count; i++) largest = fmax(largest, fabs(values[i]));
    return largest;
}

/* The shortest x with A x nearest to b; singular values below `cut` times the largest count as
 * zero.  A and b are overwritten; lengths: work space, one number a row. */
static void mechc_least_change(double *a, double *b, int rows, int columns, double cut,
                               double *lengths, double *x)
{
    mechc_orthogonal_rows(a, b, rows, columns, lengths);
    const double least = cut * mechc_largest(lengths, rows);
    for (int k = 0; k < columns; k++) x[k] = 0.0;
    for (int i = 0; i < rows; i++) {
        if (!(lengths[i] > least)) continue;
        const double share = b[i] / (lengths[i] * lengths[i]);
        for (int k = 0; k < columns; k++) x[k] += share * a[i * columns + k];
    }
}
