/* The gaps of the loops in extended precision: the scene's program over one long double. */
#pragma once

#include <math.h>
#include "dynamics/sizes.h"
#include "simd/lanes.h"

typedef struct {
    long double p[MECHC_AT_LEAST_ONE(MECHC_NP_MAX)], k[MECHC_CONSTANTS_MAX];
} mechc_extended_given;

MECHC_STATIC void mechc_extended_sincos(long double x, long double *sine, long double *cosine)
{
    *sine = sinl(x);
    *cosine = cosl(x);
}

#include "simd/bind_extended.h"
#include "scene_program.h"
#include "simd/unbind.h"
