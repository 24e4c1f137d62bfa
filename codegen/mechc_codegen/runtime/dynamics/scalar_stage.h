/* A stage of one trajectory, as functions of doubles. */
#pragma once

#include "simd/bind_scalar.h"
#include "dynamics/stage.h"
#include "simd/unbind.h"
#include "simd/lanes.h"

/* The unit in which component i of a state is measured: a radian, 1, or the mechanism's length. */
MECHC_INLINE double mechc_given_unit(const mechc_scalar_given *given, int i)
{
    (void)given, (void)i;
    return MECHC_SLIDES_AT(i) ? given->k[MECHC_LENGTH] : 1.0;
}

/* Locate a stage outside the steps.  Compiled once: inlined everywhere, long equations would take
 * most of the time of compiling a scene. */
MECHC_ONCE void mechc_locate(double t, const double *q, const mechc_scalar_given *given,
                             mechc_scalar_place *place)
{
    mechc_scalar_locate(t, q, given, place);
}

MECHC_ONCE int mechc_close_loops(double t, double *q, const mechc_scalar_given *given,
                                 mechc_scalar_place *place, long *iterations)
{
    return mechc_scalar_close_loops(t, q, given, place, iterations);
}
