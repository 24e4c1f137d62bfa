/* The use of Newton's iteration in a step of collocation, and the error due to stiff components. */
#pragma once

#include "methods/gauss/newton.h"
#include "run/method.h"

/* Stiff components answer at once to what the polynomial lacks: a Legendre polynomial P of degree 8,
 * by int_0^1 exp(z (1 - x)) P(x) dx, at most an eighth of it, and (z / 2)^8 / 17!! where |z| is small. */
#define MECHC_GAUSS_RESPONSE 0.125
#define MECHC_GAUSS_LOW 34459425.0
#define MECHC_GAUSS_DAMPED 144.0 /* a step leaves 1 - 144 / |z| of such a one where |z| is large */
/* Steps of Newton's iteration before the plain one is tried again. */
#define MECHC_GAUSS_PATIENCE 8
#define MECHC_GAUSS_MOST_PATIENCE 512
#define MECHC_NEWTON_VECTORS ((MECHC_NX + MECHC_LANES - 1) / MECHC_LANES) /* of states, for J */

MECHC_STATIC mechc_gauss *mechc_gauss_of(const mechc_integration *run)
{
    return run->work[MECHC_GAUSS8];
}

/* The error of a step's stiff components over its tolerance, of first order in the polynomial's
 * error. */
MECHC_STATIC double mechc_gauss_stiff_error(const mechc_integration *run, double h)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    double most = 0.0;
    for (int i = 0; g->response > 0.0 && i < MECHC_UNKNOWNS; i++) {
        mechc_sums sums;
        mechc_gauss_sums(g, i, &sums);
        const double lacks = mechc_max(fabs(sums[MECHC_DEGREE_7]), fabs(sums[MECHC_DEGREE_6]));
        most = mechc_max(most, lacks * g->weights[MECHC_FIRST_UNKNOWN + i]);
    }
    return g->response * fabs(h) * most;
}

/* Change to Newton's iteration, for twice as many steps as the last time if that is not long ago. */
MECHC_STATIC void mechc_gauss_stiffen(mechc_gauss *g)
{
    const int again = g->plain < MECHC_GAUSS_PATIENCE && g->patience;
    if (!again) g->patience = MECHC_GAUSS_PATIENCE;
    else if (g->patience < MECHC_GAUSS_MOST_PATIENCE) g->patience *= 2;
    g->stiff = g->patience;
    g->plain = g->slow = 0;
}

/* Count an accepted step. */
MECHC_STATIC void mechc_gauss_count(mechc_gauss *g, int limited)
{
    if (g->stiff) {
        g->stiff--;
        return;
    }
    g->plain++;
    g->slow = limited ? g->slow + 1 : 0;
    if (g->slow >= MECHC_GAUSS_LIMITED) mechc_gauss_stiffen(g);
}

/* Whether a motion is stiff, or was so a few steps ago. */
MECHC_STATIC int mechc_gauss_stays_alone(const mechc_integration *run)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    return g->stiff || (g->patience && g->plain < MECHC_GAUSS_PATIENCE);
}

#if MECHC_NEWTON_CODE
/* The response of stiff components to a step's missing coefficient, over a step's share of the tolerance:
 * theirs is as much larger as the errors of fewer steps add up; `size` is that of h J. */
MECHC_STATIC double mechc_gauss_respond(const mechc_integration *run, double size)
{
    const double low = pow(0.5 * size, (double)MECHC_STAGES) / MECHC_GAUSS_LOW, most = 1.0 / run->method->share;
    const double steps = mechc_min(most, mechc_max(1.0, size / MECHC_GAUSS_DAMPED));
    return mechc_min(MECHC_GAUSS_RESPONSE, low) * steps / most;
}

/* Prepare Newton's equations of this step if the plain iteration contracts slowly. */
MECHC_STATIC void mechc_gauss_prepare(mechc_integration *run, double h, mechc_newton *w)
{
    mechc_gauss *g = mechc_gauss_of(run);
    g->newton = NULL;
    g->response = 0.0;
    if (!g->stiff || g->closing != MECHC_UNPROJECTED) return;
    mechc_newton_slopes(w, g, run->head.t, run->y, h, run->scale);
    run->head.stats.rhs_evaluations += (1 + MECHC_NEWTON_VECTORS) * MECHC_LANES;
    const double size = mechc_newton_size(w, h, run->scale);
    if (size < MECHC_NEWTON_EASY) g->stiff = 0;
    if (!g->stiff) return;
    g->response = mechc_gauss_respond(run, size);
    mechc_newton_equations(w, h);
    if (mechc_newton_invert(w)) g->newton = w;
}
#endif
