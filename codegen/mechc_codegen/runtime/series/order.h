/* The order of Taylor steps.
 *
 * Terms fall by the ratio of the step to the radius of convergence, so that the last of p is the
 * tolerance where the step is tol^(1/p) of that radius.  Jorba & Zou (2005) minimise p^2 over the
 * step, which gives p = -ln(tol) / 2.  Here a step has costs of its own, and much of an order's cost
 * does not grow with it: c + a p + b p^2 as measured of heavy tops, alone and in lanes, over the step
 * is least near 5 - 0.58 ln(tol).
 */
#pragma once

#include <float.h>
#include <math.h>
#include "run/tableau.h"

#define MECHC_TAYLOR_FIRST 5.0     /* orders, */
#define MECHC_TAYLOR_PER_FACTOR 0.58 /* and for each factor e of the tolerance */

static const double mechc_inverse_of[MECHC_TAYLOR_MOST + 1] __attribute__((unused)) = {
    0.0,      1.0,      1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,
    1.0 / 9,  1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16, 1.0 / 17,
    1.0 / 18, 1.0 / 19, 1.0 / 20, 1.0 / 21, 1.0 / 22, 1.0 / 23, 1.0 / 24, 1.0 / 25, 1.0 / 26,
};

/* Of what is tolerated: components of a smaller amplitude are not followed, and where their last terms
 * are what is tolerated, stability limits the step. */
#define MECHC_TAYLOR_UNSEEN 100.0

/* The square of the least |lambda h| at which a component's term of this order, z^p / p! of its
 * amplitude, is what is tolerated though the amplitude is that small. */
static inline double mechc_taylor_unstable(int order)
{
    double factorial = 1.0 / MECHC_TAYLOR_UNSEEN;
    for (int k = 2; k <= order; k++) factorial *= k;
    return pow(factorial, 2.0 / order);
}

/* The order of steps whose allowed error, relative to the scales, is given. */
static inline int mechc_taylor_order(double tolerance)
{
    const double digits = -log(tolerance > DBL_EPSILON ? tolerance : DBL_EPSILON);
    const int order = (int)ceil(MECHC_TAYLOR_FIRST + MECHC_TAYLOR_PER_FACTOR * digits);
    return order < MECHC_TAYLOR_MOST ? order : MECHC_TAYLOR_MOST;
}
