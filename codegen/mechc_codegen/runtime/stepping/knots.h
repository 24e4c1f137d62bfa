/* Knots of tables: values of a switching function that count as its zero does. */
#pragma once

#include <math.h>
#include "abi/macros.h"
#include "dynamics/sizes.h"

#define MECHC_FIRST_FEATURE (MECHC_SWITCHES - MECHC_FEATURES)
#define MECHC_FIRST_KNOTTED (MECHC_FIRST_FEATURE - MECHC_KNOTTED)
#define MECHC_WATCHED_BY_ALL (MECHC_FEATURES + MECHC_KNOTTED) /* methods, also those that keep no path */
#define MECHC_WATCHED_BY_ALL_MAX (MECHC_FEATURES_MAX + MECHC_KNOTTED_MAX)

MECHC_STATIC int mechc_has_knots(int which)
{
    return MECHC_FIRST_KNOTTED <= which && which < MECHC_FIRST_FEATURE;
}

#if MECHC_KNOTTED_MAX
#if MECHC_GENERAL
#define mechc_knots mechc_of_scene.knots
#define mechc_knots_begin mechc_of_scene.knots_begin
#define mechc_knots_period mechc_of_scene.knots_period
#else
static const double mechc_knots[] = {MECHC_KNOTS};
static const int mechc_knots_begin[] = {MECHC_KNOTS_BEGIN};
static const double mechc_knots_period[] = {MECHC_KNOTS_PERIOD};
#endif

/* The knot of this number, counted on over the periods; infinite beyond the first and the last one, and
 * where there is no number. */
MECHC_STATIC double mechc_knot(int which, double number)
{
    const int own = which - MECHC_FIRST_KNOTTED, first = mechc_knots_begin[own];
    const int count = mechc_knots_begin[own + 1] - first;
    const double turns = mechc_knots_period[own] > 0.0 ? floor(number / count) : 0.0;
    const double rest = number - turns * count;
    if (rest < 0.0) return -HUGE_VAL;
    if (!(rest < count)) return HUGE_VAL;
    return mechc_knots[first + (int)rest] + turns * mechc_knots_period[own];
}

/* The number of the knot nearest to a value. */
MECHC_STATIC double mechc_nearest_knot(int which, double value)
{
    const int own = which - MECHC_FIRST_KNOTTED, first = mechc_knots_begin[own];
    const int count = mechc_knots_begin[own + 1] - first;
    const double period = mechc_knots_period[own];
    const double turns = period > 0.0 ? floor((value - mechc_knots[first]) / period) : 0.0;
    const double *knots = mechc_knots + first;
    int low = 0, high = count;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (value - turns * period >= knots[middle]) low = middle;
        else high = middle;
    }
    const double number = turns * count + low;
    const double after = mechc_knot(which, number + 1.0) - value;
    return after < value - mechc_knot(which, number) ? number + 1.0 : number;
}

/* The knot nearest to a value; of a function without knots 0. */
MECHC_STATIC double mechc_zero_near(int which, double value)
{
    return mechc_has_knots(which) ? mechc_knot(which, mechc_nearest_knot(which, value)) : 0.0;
}
#else
MECHC_STATIC double mechc_zero_near(int which, double value)
{
    (void)which, (void)value;
    return 0.0;
}
#endif
