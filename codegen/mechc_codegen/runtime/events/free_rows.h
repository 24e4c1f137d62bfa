/* Rows over the speeds, without what lies along the constraints' rows: what these leave free. */
#pragma once

#include <float.h>
#include "closing/least_change.h"

/* Take out of each of `count` rows w what lies along the orthogonal rows of J, of these lengths. */
static void mechc_take_out(double *w, int count, const double *rows, int constraints,
                           const double *lengths, int n)
{
    const double least = DBL_EPSILON * (n > constraints ? n : constraints)
                       * mechc_largest(lengths, constraints);
    for (int i = 0; i < constraints; i++) {
        const double *row = rows + i * n;
        if (!(lengths[i] > least)) continue;
        for (int k = 0; k < count; k++) {
            double share = 0.0;
            for (int j = 0; j < n; j++) share += w[k * n + j] * row[j];
            share /= lengths[i] * lengths[i];
            for (int j = 0; j < n; j++) w[k * n + j] -= share * row[j];
        }
    }
}
