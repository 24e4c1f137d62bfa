/* Whole turns of angles that appear in sines and cosines alone, kept apart from their remainders:
 * the closer two angles are to zero, the closer doubles lie.  What a run gives back is the sum.
 */
#pragma once

#include <math.h>
#include "dynamics/sizes.h"
#include "simd/lanes.h"

#define MECHC_TURN 6.283185307179586
/* 2 pi in parts of 27 bits, whose products with whole numbers up to 2^26 are exact: Cody & Waite. */
#define MECHC_TURN_HIGH 6.283185303211212
#define MECHC_TURN_MIDDLE 3.968374295837407e-09
#define MECHC_TURN_LOW 2.2884754904439327e-17
#define MECHC_MOST_TURNS 6.7e7
#define MECHC_FEW_TURNS 8.0 /* which stay with their angle */

#if MECHC_GENERAL
#define mechc_periodic mechc_of_scene.periodic
#define MECHC_PERIODICS mechc_of_scene.periodic_count
#elif defined MECHC_PERIODIC /* the coordinates that are such angles */
static const int mechc_periodic[] __attribute__((unused)) = {MECHC_PERIODIC};
#define MECHC_PERIODICS (int)(sizeof mechc_periodic / sizeof *mechc_periodic)
#else
static const int mechc_periodic[1] __attribute__((unused)) = {0};
#define MECHC_PERIODICS 0
#endif

/* Take whole turns out of the coordinates; turns: those taken out so far. */
MECHC_STATIC void mechc_take_turns(double *q, double *turns)
{
    for (int k = 0; k < MECHC_PERIODICS; k++) {
        const int i = mechc_periodic[k];
        if (!(fabs(q[i]) > MECHC_FEW_TURNS * MECHC_TURN)) continue;
        const double whole = nearbyint(q[i] / MECHC_TURN);
        if (!(fabs(whole + turns[i]) < MECHC_MOST_TURNS)) continue;
        q[i] -= whole * MECHC_TURN_HIGH;
        q[i] -= whole * MECHC_TURN_MIDDLE;
        q[i] -= whole * MECHC_TURN_LOW;
        turns[i] += whole;
    }
}

/* Write the coordinates with their turns. */
MECHC_STATIC void mechc_give_turns(const double *turns, double *q)
{
    for (int k = 0; k < MECHC_PERIODICS; k++) {
        const int i = mechc_periodic[k];
        if (turns[i] == 0.0) continue;
        q[i] += turns[i] * MECHC_TURN_LOW;
        q[i] += turns[i] * MECHC_TURN_MIDDLE;
        q[i] += turns[i] * MECHC_TURN_HIGH;
    }
}
