/* Newton's iteration for the stages of collocation, where the plain one contracts slowly or not at
 * all: stiff scenes.
 *
 * One Jacobian serves all stages: that in the middle of the step, as predicted.  In the eigenvectors of
 * the integration matrix the linear equations of all stages fall into one system of the size of the
 * unknowns for each pair of eigenvalues: I - h root J, or where q' = u and the accelerations have the
 * derivatives K by q and D by u, I - h root D - (h root)^2 K.  These lie side by side in vectors.
 * Hairer & Wanner (1996), section IV.8.
 */
#pragma once

#include "methods/gauss/stages.h"
#include "run/rates.h"

#define MECHC_NEWTON_EASY 1.0    /* size of h J below which the plain iteration contracts fast */

#if MECHC_NEWTON_CODE
/* The equations of one step. */
struct mechc_newton {
    double slopes[MECHC_NEWTON_MAX][MECHC_NX_MAX];
    mechc_modes real[MECHC_NEWTON_MAX][MECHC_NEWTON_MAX]; /* first the systems, then their inverses */
    mechc_modes imaginary[MECHC_NEWTON_MAX][MECHC_NEWTON_MAX];
};

MECHC_INLINE void mechc_take_modes(const double *four, mechc_modes *modes)
{
    memcpy(modes, four, sizeof *modes);
}

#define MECHC_MIDDLE (MECHC_STAGES / 2)

/* Derivatives of the unknown rates by the state there, by differences side by side in the lanes. */
MECHC_STATIC void mechc_newton_slopes(mechc_newton *w, mechc_gauss *g, double t,
                                      const double *y, double h, const double *scale)
{
    mechc_vector middle[MECHC_NX_MAX], rates[MECHC_UNKNOWNS_MAX], base[MECHC_UNKNOWNS_MAX];
    mechc_gauss_states(g, y, h, MECHC_MIDDLE / MECHC_LANES, middle); /* as the rates are predicted */
    for (int i = 0; i < MECHC_NX; i++) middle[i] = mechc_spread(middle[i][MECHC_MIDDLE % MECHC_LANES]);
    t += mechc_gauss_nodes[MECHC_MIDDLE] * h;
    mechc_gauss_first_stages(g, t, 0.0, middle, 0, base);
    for (int first = 0; first < MECHC_NX; first += MECHC_LANES) {
        const int left = MECHC_NX - first, count = left < MECHC_LANES ? left : MECHC_LANES;
        mechc_vector state[MECHC_NX_MAX];
        memcpy(state, middle, MECHC_NX * sizeof *state);
        for (int lane = 0; lane < count; lane++) {
            const int j = first + lane;
            state[j][lane] += mechc_small_change(scale[j], middle[j][lane]);
        }
        mechc_gauss_first_stages(g, t, 0.0, state, 0, rates);
        for (int lane = 0; lane < count; lane++) {
            const int j = first + lane;
            const double change = state[j][lane] - middle[j][lane];
            for (int i = 0; i < MECHC_UNKNOWNS; i++)
                w->slopes[i][j] = (rates[i][lane] - base[i][lane]) / change;
        }
    }
}

/* The size of h J, by rows in units of the scales; for q, where J has second derivatives, its root. */
MECHC_STATIC double mechc_newton_size(const mechc_newton *w, double h, const double *scale)
{
    double once = 0.0, twice = 0.0;
    scale += MECHC_FIRST_UNKNOWN;
    for (int i = 0; i < MECHC_UNKNOWNS; i++) {
        double by_speeds = 0.0, by_places = 0.0;
        for (int j = 0; j < MECHC_UNKNOWNS; j++) {
            by_speeds += fabs(w->slopes[i][MECHC_FIRST_UNKNOWN + j]) * scale[j];
            if (MECHC_FIRST_UNKNOWN) by_places += fabs(w->slopes[i][j]) * scale[j];
        }
        once = mechc_max(once, by_speeds / scale[i]);
        twice = mechc_max(twice, by_places / scale[i]);
    }
    return fabs(h) * (once + sqrt(twice));
}

/* Set up the systems of the modes. */
MECHC_STATIC void mechc_newton_equations(mechc_newton *w, double h)
{
    mechc_modes real, imaginary;
    mechc_take_modes(mechc_gauss_roots, &real);
    mechc_take_modes(mechc_gauss_roots + MECHC_GAUSS_MODES, &imaginary);
    real *= h, imaginary *= h;
    const mechc_modes square = real * real - imaginary * imaginary, cross = 2.0 * real * imaginary;
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        for (int j = 0; j < MECHC_UNKNOWNS; j++) {
            const double once = w->slopes[i][MECHC_FIRST_UNKNOWN + j];
            const double twice = MECHC_FIRST_UNKNOWN ? w->slopes[i][j] : 0.0;
            w->real[i][j] = (i == j) - once * real - twice * square;
            w->imaginary[i][j] = -once * imaginary - twice * cross;
        }
}

/* The pivot row from j on, whose least entry in column j over the modes is largest; returns its
 * square. */
MECHC_STATIC double mechc_newton_pivot(const mechc_newton *w, int j, int *row)
{
    double most = 0.0;
    for (int i = j; i < MECHC_UNKNOWNS; i++) {
        const mechc_modes a = w->real[i][j], b = w->imaginary[i][j], square = a * a + b * b;
        double least = square[0];
        for (int k = 1; k < MECHC_GAUSS_MODES; k++) least = mechc_min(least, square[k]);
        if (least > most) most = least, *row = i;
    }
    return most;
}

/* Exchange two rows, whose entries are next to each other, or two columns. */
MECHC_STATIC void mechc_newton_exchange(mechc_modes *a, mechc_modes *b, int stride)
{
    for (int k = 0; a != b && k < MECHC_UNKNOWNS; k++) {
        const mechc_modes kept = a[k * stride];
        a[k * stride] = b[k * stride];
        b[k * stride] = kept;
    }
}

/* Row i <- row i - factor row j, whose own factor takes the place of the entry in column j. */
MECHC_STATIC void mechc_newton_take_row(mechc_newton *w, int i, int j)
{
    const mechc_modes a = w->real[i][j], b = w->imaginary[i][j];
    w->real[i][j] = w->imaginary[i][j] = (mechc_modes){0};
    for (int k = 0; k < MECHC_UNKNOWNS; k++) {
        const mechc_modes c = w->real[j][k], d = w->imaginary[j][k];
        MECHC_ADD_SUMS(w->real[i][k], a, -c);
        MECHC_ADD_SUMS(w->real[i][k], b, d);
        MECHC_ADD_SUMS(w->imaginary[i][k], a, -d);
        MECHC_ADD_SUMS(w->imaginary[i][k], b, -c);
    }
}

/* Invert the systems in place, by Gauss and Jordan; 0 if one is singular or not finite. */
MECHC_ONCE int mechc_newton_invert(mechc_newton *w)
{
    int rows[MECHC_NEWTON_MAX];
    for (int j = 0; j < MECHC_UNKNOWNS; j++) {
        rows[j] = j;
        const double square = mechc_newton_pivot(w, j, &rows[j]);
        if (!(square > 0.0 && square < HUGE_VAL)) return 0;
        mechc_newton_exchange(w->real[j], w->real[rows[j]], 1);
        mechc_newton_exchange(w->imaginary[j], w->imaginary[rows[j]], 1);
        const mechc_modes a = w->real[j][j], b = w->imaginary[j][j], size = a * a + b * b;
        const mechc_modes real = a / size, imaginary = -b / size;
        w->real[j][j] = (mechc_modes){0} + 1.0;
        w->imaginary[j][j] = (mechc_modes){0};
        for (int k = 0; k < MECHC_UNKNOWNS; k++) {
            const mechc_modes c = w->real[j][k], d = w->imaginary[j][k];
            w->real[j][k] = -(imaginary * d);
            w->imaginary[j][k] = imaginary * c;
            MECHC_ADD_SUMS(w->real[j][k], real, c);
            MECHC_ADD_SUMS(w->imaginary[j][k], real, d);
        }
        for (int i = 0; i < MECHC_UNKNOWNS; i++)
            if (i != j) mechc_newton_take_row(w, i, j);
    }
    for (int j = MECHC_UNKNOWNS - 1; j >= 0; j--) {
        mechc_newton_exchange(*w->real + j, *w->real + rows[j], MECHC_NEWTON_MAX);
        mechc_newton_exchange(*w->imaginary + j, *w->imaginary + rows[j], MECHC_NEWTON_MAX);
    }
    return 1;
}

/* Replace the rates found at the stages by the next iterates: the former ones plus Newton's correction. */
MECHC_ONCE void mechc_newton_correct(const mechc_gauss *g,
                                     mechc_vector rates[][MECHC_UNKNOWNS_MAX])
{
    const mechc_newton *w = g->newton;
    mechc_modes real[MECHC_NEWTON_MAX], imaginary[MECHC_NEWTON_MAX];
    for (int i = 0; i < MECHC_UNKNOWNS; i++) {
        double left[MECHC_STAGES];
        for (int block = 0; block < MECHC_BLOCKS; block++)
            mechc_put(rates[block][i] - mechc_take(g->rates[i], block), left, block);
        real[i] = imaginary[i] = (mechc_modes){0};
        for (int j = 0; j < MECHC_STAGES; j++) {
            const double *to = mechc_gauss_to_modes + j * MECHC_STAGES;
            mechc_modes a, b;
            mechc_take_modes(to, &a);
            mechc_take_modes(to + MECHC_GAUSS_MODES, &b);
            MECHC_ADD_SUMS(real[i], a, MECHC_SUMS_OF(left[j]));
            MECHC_ADD_SUMS(imaginary[i], b, MECHC_SUMS_OF(left[j]));
        }
    }
    for (int i = 0; i < MECHC_UNKNOWNS; i++) {
        mechc_modes x = {0}, y = {0};
        for (int j = 0; j < MECHC_UNKNOWNS; j++) {
            const mechc_modes a = w->real[i][j], b = w->imaginary[i][j];
            MECHC_ADD_SUMS(x, a, real[j]);
            MECHC_ADD_SUMS(x, -b, imaginary[j]);
            MECHC_ADD_SUMS(y, a, imaginary[j]);
            MECHC_ADD_SUMS(y, b, real[j]);
        }
        for (int block = 0; block < MECHC_BLOCKS; block++) {
            mechc_vector sum = mechc_take(g->rates[i], block);
            for (int k = 0; k < MECHC_GAUSS_MODES; k++) {
                const double *from = mechc_gauss_from_modes + k * MECHC_STAGES;
                MECHC_ADD(sum, mechc_spread(x[k]), mechc_take(from, block));
                from += MECHC_GAUSS_MODES * MECHC_STAGES;
                MECHC_ADD(sum, mechc_spread(y[k]), mechc_take(from, block));
            }
            rates[block][i] = sum;
        }
    }
}
#endif

/* Rates of one block of stages, kept on the constraints or not; also stores the changes of positions. */
MECHC_INLINE void mechc_gauss_block(mechc_gauss *g, double t, const double *y, double h, int block,
                                    int first, mechc_vector *rates, mechc_vector *moved)
{
    mechc_vector state[MECHC_NX_MAX];
    if (g->closing != MECHC_UNPROJECTED)
        mechc_gauss_stages(g, t, y, h, block, rates, moved);
    else if (!first)
        mechc_gauss_plain_stages(g, t, y, h, block, rates);
    else {
        mechc_gauss_states(g, y, h, block, state);
        mechc_gauss_first_stages(g, t, h, state, block, rates);
    }
}

/* Make one iteration; returns the largest change of a rate over its tolerance. */
MECHC_ONCE double mechc_gauss_iterate(mechc_gauss *g, double t, const double *y, double h,
                                      int first)
{
    const double *weights = g->weights;
    mechc_vector rates[MECHC_BLOCKS][MECHC_UNKNOWNS_MAX], moved[MECHC_NQ_MAX], change = {0};
    const int projected = g->closing != MECHC_UNPROJECTED;
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        mechc_gauss_block(g, t, y, h, block, first, rates[block], moved);
        for (int i = 0; projected && i < MECHC_NQ; i++)
            change = mechc_larger(change, moved[i] * weights[i]);
    }
#if MECHC_NEWTON_CODE
    if (g->newton && !projected) mechc_newton_correct(g, rates);
#endif
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        for (int block = 0; block < MECHC_BLOCKS; block++) {
            const mechc_vector by = rates[block][i] - mechc_take(g->rates[i], block);
            const double weight = fabs(h) * weights[MECHC_FIRST_UNKNOWN + i];
            change = mechc_larger(change, by * weight);
            mechc_put(rates[block][i], g->rates[i], block);
        }
    return mechc_greatest(change);
}
