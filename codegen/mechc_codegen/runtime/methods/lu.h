/* Dense linear systems by Gaussian elimination with row exchanges. */
#pragma once

#include "simd/scalar.h"

#include <math.h>
#include "simd/bind_scalar.h"
#include "dynamics/given.h"
#include "simd/unbind.h"
#include "simd/lanes.h"

/* Factor a = P^-1 L U in place; 0 if a pivot vanishes, or if it is stopped. */
MECHC_ONCE int mechc_lu_factor(double *a, int *rows, int size,
                               const mechc_scalar_given *given)
{
    for (int j = 0; j < size; j++) {
        int best = j;
        if (mechc_scalar_stopped(given)) return 0;
        for (int i = j + 1; i < size; i++)
            if (fabs(a[i * size + j]) > fabs(a[best * size + j])) best = i;
        rows[j] = best;
        if (!(fabs(a[best * size + j]) > 0.0)) return 0;
        if (best != j)
            for (int k = 0; k < size; k++) {
                const double kept = a[j * size + k];
                a[j * size + k] = a[best * size + k];
                a[best * size + k] = kept;
            }
        const double inverse = 1.0 / a[j * size + j];
        for (int i = j + 1; i < size; i++) {
            const double factor = a[i * size + j] *= inverse;
            if (factor != 0.0)
                for (int k = j + 1; k < size; k++) a[i * size + k] = mechc_scalar_fused(-factor, a[j * size + k], a[i * size + k]);
        }
    }
    return 1;
}

MECHC_ONCE void mechc_lu_solve(const double *a, const int *rows, int size, double *x)
{
    for (int i = 0; i < size; i++) {
        const double kept = x[i];
        x[i] = x[rows[i]];
        x[rows[i]] = kept;
    }
    for (int i = 1; i < size; i++)
        for (int k = 0; k < i; k++) x[i] = mechc_scalar_fused(-a[i * size + k], x[k], x[i]);
    for (int i = size - 1; i >= 0; i--) {
        for (int k = i + 1; k < size; k++) x[i] = mechc_scalar_fused(-a[i * size + k], x[k], x[i]);
        x[i] /= a[i * size + i];
    }
}
