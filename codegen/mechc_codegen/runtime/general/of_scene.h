/* A scene's counts, tables and functions for the general unit (general.h), compiled with its bounds. */
#pragma once

#include "general/bounds.h"
#include "dynamics/sizes.h"
#include "run/turns.h"
#include "stepping/knots.h"
#include "general/counts.h"
#include "general/called.h"

#ifdef MECHC_ANGLES
static const int mechc_angles[] = {MECHC_ANGLES};
#define MECHC_ANGLE_COUNT (int)(sizeof mechc_angles / sizeof *mechc_angles)
#else
static const int mechc_angles[1] = {0};
#define MECHC_ANGLE_COUNT 0
#endif

MECHC_OF_SCENE const mechc_counts mechc_of_scene = {
    .nq = MECHC_NQ,
    .nu = MECHC_NU,
    .nh = MECHC_NH,
    .nc = MECHC_NC,
    .np = MECHC_NP,
    .nk = MECHC_NK,
    .saved = MECHC_SAVED,
    .turns = MECHC_TURNS,
    .ni = MECHC_NI,
    .states = MECHC_STATES,
    .switches = MECHC_SWITCHES,
    .features = MECHC_FEATURES,
    .knotted = MECHC_KNOTTED,
    .multipliers = MECHC_MULTIPLIERS,
    .lockstep = MECHC_LOCKSTEP,
    .blocks_kept = MECHC_BLOCKS_KEPT,
#ifdef MECHC_SLIDES
    .slides = mechc_slides,
#endif
    .angle_count = MECHC_ANGLE_COUNT,
    .angles = mechc_angles,
    .periodic_count = MECHC_PERIODICS,
    .periodic = mechc_periodic,
#if MECHC_KNOTTED
    .knots = mechc_knots,
    .knots_begin = mechc_knots_begin,
    .knots_period = mechc_knots_period,
#endif
};

#include "simd/bind_scalar.h"
#include "general/give.h"
#include "simd/bind_vector.h"
#include "general/give.h"
#include "simd/unbind.h"

#if MECHC_KIND_LOOPS
#if MECHC_NI > 0 /* with inputs loops are not closed finely */
MECHC_STATIC void mechc_extended_read_inputs(long double t, const long double *q, const long double *u,
                                             const void *given, int first, int last, long double *values)
{
    (void)t, (void)q, (void)u, (void)given;
    for (int i = first; i < last; i++) values[i - first] = (long double)NAN;
}
#endif
#include "dynamics/extended.h"
#include "simd/bind_extended.h"
MECHC_GAPS(MECHC_GIVE_FUNCTION)
MECHC_GAPS_OF_LOOPS(MECHC_GIVE_FUNCTION)
#include "simd/unbind.h"
#endif
