/* Cholesky's factor of small matrices, and solutions with it. */
#pragma once

#include <math.h>

/* M = L L^T in place; 0 where M is not positive definite. */
static int mechc_cholesky(double *m, int n)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = m[i * n + j];
            for (int k = 0; k < j; k++) sum -= m[i * n + k] * m[j * n + k];
            if (j < i) m[i * n + j] = sum / m[j * n + j];
            else if (sum > 0.0) m[i * n + i] = sqrt(sum);
            else return 0;
        }
    return 1;
}

/* x = L^-1 x, and x = L^-T x. */
static void mechc_solve_lower(const double *l, int n, double *x)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) x[i] -= l[i * n + k] * x[k];
        x[i] /= l[i * n + i];
    }
}

static void mechc_solve_upper(const double *l, int n, double *x)
{
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) x[i] -= l[k * n + i] * x[k];
        x[i] /= l[i * n + i];
    }
}
