/* A stage of one trajectory. */
#pragma once

#include "simd/bind_scalar.h"
#include "dynamics/stage.h"
#include "simd/unbind.h"
#include "simd/lanes.h"

/* A radian, 1, or the mechanism's length: what component i of a state is measured by. */
MECHC_INLINE double mechc_given_unit(const mechc_scalar_given *given, int i)
{
    (void)given, (void)i;
    return MECHC_SLIDES_AT(i) ? given->k[MECHC_LENGTH] : 1.0;
}

/* Compiled once for all that is not in every step: inlined there, equations that are long would take
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
