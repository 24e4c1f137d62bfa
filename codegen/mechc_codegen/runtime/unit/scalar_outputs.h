/* Outputs of one state, as functions of doubles. */
#pragma once

#include "singularities/generic_rank.h"
#include "simd/bind_scalar.h"
#include "dynamics/alone.h"
#include "scene_program.h"
#include "unit/jacobians.h"
#include "simd/unbind.h"
#include "simd/lanes.h"

MECHC_STATIC void mechc_scalar_output_rates(double t, const double *q, const double *u,
                                            const mechc_scalar_given *given, double *out)
{
    mechc_scalar_place place;
    mechc_scalar_coordinate_rates_of(t, q, u, given, out);
    mechc_scalar_solve(t, q, u, given, &place, out + MECHC_NQ, 0);
}
