/* Zeros and least values of a function of one variable between samples of it.
 *
 * Events, first crossings, extremes and switching functions are found by these: they differ in what they
 * sample and in how exactly a place is asked for.
 */
#pragma once

#include <math.h>
#include "abi/macros.h"

#define MECHC_ZERO_PAST 0.45 /* of the exactness aimed at: how far past the root of a secant */
#define MECHC_GOLDEN 0.6180339887498949
#define MECHC_LEAST_NEAR 1e-3 /* of the smaller side: so far from the least place the next one is at least, */
#define MECHC_LEAST_FINE 0.1  /* and of the exactness aimed at */

typedef struct {
    double at, value;
} mechc_point;

/* A function that is searched. */
typedef struct {
    double (*value)(void *context, double at);
    void *context;
} mechc_searched;

MECHC_STATIC mechc_point mechc_point_at(const mechc_searched *function, double at)
{
    return (mechc_point){at, function->value(function->context, at)};
}

/* Whether a function crosses zero from a to b, in the direction that counts: 1 upwards, -1 downwards, 0 both. */
MECHC_STATIC int mechc_crosses(double a, double b, double direction)
{
    return a != 0.0 && (b == 0.0 || (a < 0.0) != (b < 0.0)) && direction * (b - a) >= 0.0;
}

/* The vertex of the parabola through three samples; its place is not finite where they lie on a line. */
MECHC_STATIC mechc_point mechc_vertex(mechc_point a, mechc_point b, mechc_point c)
{
    const double before = b.at - a.at, after = c.at - b.at;
    const double left = before * (b.value - c.value), right = after * (b.value - a.value);
    const double turn = before * left - after * right, way = 0.5 * turn / (left + right);
    return (mechc_point){b.at - way, b.value + 0.5 * way * turn / (before * after * (before + after))};
}

/* Whether a parabola through three points of one sign has its vertex, towards zero, at the least of them in the
 * middle, or between that and the first or last of all points. */
MECHC_STATIC int mechc_dips(const mechc_point *points, int first, int last, mechc_point *vertex)
{
    const double before = points[0].value, here = points[1].value, after = points[2].value;
    const mechc_point *end = first ? points : last ? points + 2 : 0;
    *vertex = mechc_vertex(points[0], points[1], points[2]);
    return fmin(before * here, here * after) > 0.0 && copysign(1.0, here) * (vertex->value - here) <= 0.0
        && (fabs(here) <= fmin(fabs(before), fabs(after))
            || (end && (vertex->at - points[1].at) * (end->at - vertex->at) > 0.0));
}

/* Narrow the bracket of a zero to a width, by halving it and, in two attempts of three, by secants.  The
 * function has the sign of the lower sample below the zero; at the upper one it is zero or has the other. */
MECHC_STATIC void mechc_find_zero(const mechc_searched *function, mechc_point *low, mechc_point *high,
                               double width, int attempts, int secants)
{
    for (int i = 0; i < attempts && fabs(high->at - low->at) > width && high->value != 0.0; i++) {
        double at = 0.5 * (low->at + high->at);
        if (secants && i % 3) {
            double secant = high->at - high->value * (high->at - low->at) / (high->value - low->value);
            /* a little past the secant's root, so that the bracket closes from both sides */
            secant += copysign(MECHC_ZERO_PAST * width, at - secant);
            if (fmin(low->at, high->at) < secant && secant < fmax(low->at, high->at)) at = secant;
        }
        const mechc_point next = mechc_point_at(function, at);
        if (next.value == 0.0 || (next.value < 0.0) != (low->value < 0.0)) *high = next;
        else *low = next;
    }
}

/* The least of sign * function between two samples, from one between them: by sections of its larger side and,
 * unless the width is 0, twice as many vertices of parabolas. */
MECHC_STATIC mechc_point mechc_find_least(const mechc_searched *function, double sign, mechc_point low,
                                      mechc_point middle, mechc_point high, double width, int attempts)
{
    for (int i = 0; i < attempts && fabs(high.at - low.at) > width; i++) {
        const double left = fabs(middle.at - low.at), right = fabs(high.at - middle.at), all = high.at - low.at;
        double at = left > right ? high.at - MECHC_GOLDEN * all : low.at + MECHC_GOLDEN * all;
        const double vertex = width > 0.0 && i % 3 < 2 ? mechc_vertex(low, middle, high).at : NAN;
        if ((vertex - low.at) * (high.at - vertex) > 0.0) {
            const double near = MECHC_LEAST_FINE * width + MECHC_LEAST_NEAR * fmin(left, right);
            at = fabs(vertex - middle.at) < near ? middle.at + copysign(near, at - middle.at) : vertex;
        }
        const mechc_point next = mechc_point_at(function, at);
        const int lower = (at - middle.at) * all < 0.0;
        const mechc_point a = lower ? next : middle, b = lower ? middle : next;
        const int rises = sign * a.value < sign * b.value;
        middle = rises ? a : b;
        if (rises) high = b;
        else low = a;
    }
    return middle;
}
