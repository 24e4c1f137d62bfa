/* One planar linkage of linkage_curve.py on its curve of configurations: da/ds = n, the unit null
   vector of the closure's rows R, oriented so that det [R; n] > 0, which is smooth however near the
   curve comes to another; and the motion along it.  Gragg's extrapolation, order 16. */
#include <math.h>
#include <string.h>

#define MOST 16 /* rods */
#define COLUMNS 8
#define STEPS 20000

typedef long double real;
typedef struct {
    int rods, loops; /* rods = 2 loops + 1 */
    double inertia[MOST * MOST], moment[MOST], tips[MOST * MOST];
    double grounds[MOST], parts[MOST]; /* and what a ground has below its last digit */
} linkage;

/* Solve a x = b in place, partial pivoting; the sign of det a. */
static int solve(real *a, real *b, int n)
{
    int sign = 1;
    for (int k = 0; k < n; k++) {
        int row = k;
        for (int i = k + 1; i < n; i++)
            if (fabsl(a[i * n + k]) > fabsl(a[row * n + k])) row = i;
        if (row != k) {
            for (int j = 0; j < n; j++) {
                const real kept = a[k * n + j];
                a[k * n + j] = a[row * n + j], a[row * n + j] = kept;
            }
            const real kept = b[k];
            b[k] = b[row], b[row] = kept, sign = -sign;
        }
        if (a[k * n + k] < 0) sign = -sign;
        for (int i = k + 1; i < n; i++) {
            const real factor = a[i * n + k] / a[k * n + k];
            for (int j = k; j < n; j++) a[i * n + j] -= factor * a[k * n + j];
            b[i] -= factor * b[k];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++) b[i] -= a[i * n + j] * b[j];
        b[i] /= a[i * n + i];
    }
    return sign;
}

/* Cosines and sines; rows R and what is left of the closure. */
static void place(const linkage *g, const real *a, real *c, real *s, real *rows, real *gap)
{
    const int n = g->rods;
    for (int k = 0; k < n; k++) c[k] = cosl(a[k]), s[k] = sinl(a[k]);
    for (int l = 0; l < g->loops; l++) {
        gap[2 * l] = -(real)g->grounds[l] - g->parts[l], gap[2 * l + 1] = 0;
        for (int k = 0; k < n; k++) {
            const real tip = g->tips[l * n + k];
            gap[2 * l] += tip * c[k], gap[2 * l + 1] += tip * s[k];
            rows[2 * l * n + k] = -tip * s[k], rows[(2 * l + 1) * n + k] = tip * c[k];
        }
    }
}

/* The unit null vector of the rows, which the vector `about` only borders. */
static void tangent(const linkage *g, const real *rows, const real *about, real *n)
{
    const int size = g->rods;
    real matrix[MOST * MOST], b[MOST];
    memmove(n, about, (size_t)size * sizeof *n);
    int sign = 1;
    for (int round = 0; round < 2; round++) {
        memcpy(matrix, rows, (size_t)(size - 1) * (size_t)size * sizeof *matrix);
        memcpy(matrix + (size - 1) * size, n, (size_t)size * sizeof *n);
        memset(b, 0, sizeof b);
        b[size - 1] = 1;
        sign = solve(matrix, b, size);
        real square = 0;
        for (int k = 0; k < size; k++) square += b[k] * b[k];
        for (int k = 0; k < size; k++) n[k] = b[k] / sqrtl(square);
    }
    for (int k = 0; k < size && sign < 0; k++) n[k] = -n[k];
}

/* What moves with a change of a. */
static real mass_of(const linkage *g, const real *c, const real *s, const real *along)
{
    real mass = 0;
    for (int i = 0; i < g->rods; i++)
        for (int j = 0; j < g->rods; j++)
            mass += along[i] * g->inertia[i * g->rods + j] * (c[i] * c[j] + s[i] * s[j]) * along[j];
    return mass;
}

/* d/dt of a and of the speed w along the curve, whose length is measured by the mass matrix:
   dw/dt = -dV along it, whatever the curvature. */
static void rates(const linkage *g, const real *about, const real *y, real *out)
{
    const int n = g->rods;
    real c[MOST], s[MOST], rows[MOST * MOST], gap[MOST], along[MOST];
    real slope = 0;
    place(g, y, c, s, rows, gap);
    tangent(g, rows, about, along);
    const real weight = sqrtl(mass_of(g, c, s, along));
    for (int i = 0; i < n; i++) slope += g->moment[i] * c[i] * along[i];
    for (int k = 0; k < n; k++) out[k] = y[n] / weight * along[k];
    out[n] = -slope / weight;
}

/* Close the loops again. */
static void close_loops(const linkage *g, const real *about, real *y)
{
    const int n = g->rods;
    real c[MOST], s[MOST], rows[MOST * MOST], gap[MOST], along[MOST];
    for (int round = 0; round < 2; round++) {
        place(g, y, c, s, rows, gap);
        tangent(g, rows, about, along);
        memcpy(rows + (n - 1) * n, along, (size_t)n * sizeof *along);
        gap[n - 1] = 0;
        solve(rows, gap, n);
        for (int k = 0; k < n; k++) y[k] -= gap[k];
    }
}

/* The modified midpoint rule in an even number of steps. */
static void midpoint(const linkage *g, const real *about, const real *y, real h, int steps,
                     real *out)
{
    const int size = g->rods + 1;
    real before[MOST + 1], f[MOST + 1];
    const real d = h / steps;
    memcpy(before, y, (size_t)size * sizeof *y);
    rates(g, about, y, f);
    for (int k = 0; k < size; k++) out[k] = y[k] + d * f[k];
    for (int step = 1; step < steps; step++) {
        rates(g, about, out, f);
        for (int k = 0; k < size; k++) {
            const real next = before[k] + 2 * d * f[k];
            before[k] = out[k], out[k] = next;
        }
    }
}

/* One step by Aitken's and Neville's scheme; its error. */
static real extrapolate(const linkage *g, const real *about, const real *y, real h, real *end)
{
    const int size = g->rods + 1;
    real table[COLUMNS][MOST + 1], error = 0;
    for (int i = 0; i < COLUMNS; i++) {
        real row[COLUMNS][MOST + 1];
        midpoint(g, about, y, h, 2 * (i + 1), row[0]);
        for (int j = 1; j <= i; j++) {
            const real ratio = (real)(i + 1) / (i - j + 1), weight = 1 / (ratio * ratio - 1);
            for (int k = 0; k < size; k++)
                row[j][k] = row[j - 1][k] + weight * (row[j - 1][k] - table[j - 1][k]);
        }
        for (int k = 0; k < size && i == COLUMNS - 1; k++)
            error = fmaxl(error, fabsl(row[i][k] - row[i - 1][k]));
        memcpy(table, row, sizeof table);
    }
    memcpy(end, table[COLUMNS - 1], (size_t)size * sizeof *end);
    return error;
}

/* Close the loops at the end of a step; 0 where the rows changed so much that they may have lost
   their rank on the way, which [R; n] (1 + D), n the tangent at the start, does not while |D| < 1.
   A step that leaps to another branch of the curve shows in this, however small its error. */
static int stays(const linkage *g, const real *rows, const real *along, real *end)
{
    const int n = g->rods;
    real c[MOST], s[MOST], after[MOST * MOST], gap[MOST], square = 0;
    close_loops(g, along, end);
    place(g, end, c, s, after, gap);
    for (int k = 0; k < n; k++) { /* columns of D */
        real matrix[MOST * MOST], b[MOST] = {0};
        memcpy(matrix, rows, (size_t)(n - 1) * (size_t)n * sizeof *matrix);
        memcpy(matrix + (n - 1) * n, along, (size_t)n * sizeof *along);
        for (int row = 0; row < n - 1; row++) b[row] = after[row * n + k] - rows[row * n + k];
        solve(matrix, b, n);
        for (int i = 0; i < n; i++) square += b[i] * b[i];
    }
    return square < 1;
}

/* Coordinates and rates at the times, in doubles: (times, 2 rods).  0 where the steps run out. */
int integrate(const linkage *g, const double *start, int count, const double *times,
              double tolerance, double *out)
{
    const int n = g->rods;
    real y[MOST + 1], end[MOST + 1], c[MOST], s[MOST], rows[MOST * MOST], gap[MOST];
    real about[MOST] = {0}, along[MOST], t = 0, h = 1e-3L;
    for (int k = 0; k < n; k++) y[k] = start[k], about[k] = 1 + 0.37L * k;
    for (int round = 0; round < 2; round++) close_loops(g, about, y);
    place(g, y, c, s, rows, gap);
    tangent(g, rows, about, along);
    y[n] = 0;
    for (int k = 0; k < n; k++) y[n] += along[k] * start[n + k];
    y[n] *= sqrtl(mass_of(g, c, s, along));
    for (int i = 0, step = 0; i < count;) {
        if (step++ >= STEPS) return 0;
        const real left = times[i] - t, tried = h < left ? h : left;
        place(g, y, c, s, rows, gap);
        tangent(g, rows, along, along);
        real error = extrapolate(g, along, y, tried, end);
        if (error <= tolerance && !stays(g, rows, along, end)) error = HUGE_VALL;
        const real factor = 0.8L * powl(tolerance / (error + 1e-30L), 1.0L / (2 * COLUMNS - 1));
        if (error <= tolerance) {
            memcpy(y, end, sizeof y);
            t += tried;
            if (tried == left) {
                for (int k = 0; k < n; k++) about[k] = along[k];
                place(g, y, c, s, rows, gap);
                tangent(g, rows, about, along);
                const real v = y[n] / sqrtl(mass_of(g, c, s, along));
                for (int k = 0; k < n; k++)
                    out[2 * n * i + k] = y[k], out[2 * n * i + n + k] = v * along[k];
                t = times[i++];
            }
        }
        if (!(error <= tolerance) || tried == h)
            h = tried * fminl(4, fmaxl(0.1L, factor == factor ? factor : 0));
    }
    return 1;
}
