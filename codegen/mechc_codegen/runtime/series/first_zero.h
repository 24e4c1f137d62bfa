/* The first zero of a root's series within a step: see step.h.
 *
 * It has to be surely the first, or the root's argument would be negative: lengths come from a bound of the
 * coefficients.  The searches of run/zeros.h see what lies between samples of a function by luck alone. */
#pragma once

#include <math.h>
#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES
#include "series/coefficients.h"

#define MECHC_ZERO_LOOKS 64
#define MECHC_ZERO_REFINED 6

/* Shift the polynomial to a new origin d, by repeated use of Horner's scheme. */
MECHC_STATIC void mechc_shift_series(double *terms, int last, double d)
{
    for (int i = 0; i < last; i++)
        for (int k = last - 1; k >= i; k--) terms[k] += d * terms[k + 1];
}

/* A lower bound of the polynomial up to d, and the slope of that bound. */
MECHC_STATIC double mechc_surely_kept(const double *terms, int last, double d, double *slope)
{
    double change = 0.0;
    *slope = 0.0;
    for (int k = last; k > 0; k--) {
        *slope = *slope * d - k * fabs(terms[k]);
        change = (change + fabs(terms[k])) * d;
    }
    return terms[0] - change;
}

/* A length, at most `rest`, up to which the polynomial is surely positive.  The bound is concave:
 * Newton's steps come from beyond its zero, and a chord ends before it. */
MECHC_STATIC double mechc_surely_positive(const double *terms, int last, double rest)
{
    double slope, d = fmin(rest, terms[0] / fabs(terms[1]));
    double kept = mechc_surely_kept(terms, last, d, &slope);
    for (int i = 0; i < MECHC_ZERO_REFINED && kept < 0.0; i++) {
        d += kept / -slope;
        kept = mechc_surely_kept(terms, last, d, &slope);
    }
    return kept < 0.0 ? d * terms[0] / (terms[0] - kept) : d;
}

/* Just past the first zero of a polynomial that begins with 1, by `past` at least, or `most`, where
 * it has none before; *zero: one was found.  After many looks it ends before a zero. */
MECHC_STATIC double mechc_first_zero(double *terms, int last, double most, double past, int *zero)
{
    double s = 0.0, slope, steepest;
    mechc_surely_kept(terms, last, most, &steepest);
    const double rounding = DBL_EPSILON * (1.0 - steepest * most);
    for (int look = 0; look < MECHC_ZERO_LOOKS && s < most; look++) {
        slope = terms[1];
        if (!(fabs(terms[0]) + fabs(slope) < HUGE_VAL)) return most;
        if (terms[0] <= rounding && slope < 0.0) {
            s += fmax(2.0 * (fabs(terms[0]) + rounding) / -slope, past);
            *zero = s < most;
            return fmin(s, most);
        }
        terms[0] = fmax(terms[0], rounding);
        const double d = mechc_surely_positive(terms, last, most - s);
        mechc_shift_series(terms, last, d);
        s += d;
    }
    return fmin(s, most);
}

/* A difference that just shows in the time, in parts of the scale. */
MECHC_STATIC double mechc_just_past(double t, double scale, double part)
{
    return 4.0 * DBL_EPSILON * (fabs(t / scale) + part);
}

/* The end of a step at the first zero among all roots of one run; `stride` numbers lie between the
 * coefficients of one lane, *zero: a root has a zero there. */
MECHC_STATIC double mechc_branches_end(const double *rows, int stride, int order, double most,
                                       double past, int *zero)
{
    *zero = 0;
#if MECHC_SERIES_ROOTS_MAX
    for (int n = 0; n < MECHC_SERIES_ROOTS; n++) {
        double terms[MECHC_TAYLOR_MOST];
        const double *first = rows + mechc_root_places[n] * stride;
        for (int k = 0; k < order; k++) terms[k] = first[k * MECHC_SERIES * stride] / first[0];
        int own = 0;
        const double end = mechc_first_zero(terms, order - 1, most, past, &own);
        *zero = end < most ? own : *zero;
        most = end;
    }
#else
    (void)rows, (void)stride, (void)order, (void)past;
#endif
    return most;
}
#endif
