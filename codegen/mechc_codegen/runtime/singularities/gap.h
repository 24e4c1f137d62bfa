/* The gap of a critical configuration: how far the lengths are from those of a change point.
 *
 * Its value, its rounding, and whether the lengths make a change point as they were given: 7.6, 3.8,
 * 7.7 and 3.7 do as decimals, though not as the doubles nearest to them; 1, 2, 3 and 4 + 1e-15 do
 * not, though the gap is below the rounding of the closure.
 */
#pragma once

#include "singularities/weakest.h"

/* Lengths as they were given: do they make a change point? */
typedef enum { MECHC_READS_OPEN = -1, MECHC_UNREAD = 0, MECHC_READS_CLOSED = 1 } mechc_reading;

typedef struct {
    double q[MECHC_NQ_MAX], normal[MECHC_AT_LEAST_ONE(MECHC_NH_MAX)]; /* q*, w */
    double gap;      /* g */
    double rounding; /* the error of g by rounding */
    double speeds[MECHC_NU_MAX]; /* weights of the units of speeds: square roots of the masses */
    mechc_reading reading; /* of the lengths as they were given */
    int curves;      /* branches cross or pass each other there; 0: an apex */
} mechc_critical;

typedef enum { MECHC_CROSSING, MECHC_TOO_CLOSE_TO_CALL, MECHC_NEAR_MISS, MECHC_UNKNOWN } mechc_verdict;

/* Gaps below so many units of rounding bend the motion more sharply than closed loops resolve. */
#define MECHC_BENDS 8.0

/* Judge the gap.  Lengths that make a change point as they were typed, or whose gap is no sum of
 * lengths and below its rounding, make one.  A gap of some units keeps its sign, and the curve its
 * bend, whatever rounding the closure has. */
MECHC_STATIC mechc_verdict mechc_judge(const mechc_critical *c)
{
    const int unread = c->reading == MECHC_UNREAD && fabs(c->gap) <= c->rounding;
    if (unread || c->reading == MECHC_READS_CLOSED) return MECHC_CROSSING;
    return fabs(c->gap) <= MECHC_BENDS * c->rounding ? MECHC_TOO_CLOSE_TO_CALL : MECHC_NEAR_MISS;
}

#if MECHC_NH_MAX > 0
/* q moved by a displacement given in speeds. */
MECHC_STATIC void mechc_displace(double t, const double *q, const mechc_scalar_given *given,
                                 const double *by, double *out)
{
    if (MECHC_IDENTITY_KINEMATICS) {
        for (int i = 0; i < MECHC_NQ; i++) out[i] = q[i] + by[i];
        return;
    }
    double map[MECHC_NQ_MAX * MECHC_NU_MAX];
    mechc_scalar_map_of(t, q, given, map);
    for (int i = 0; i < MECHC_NQ; i++)
        out[i] = q[i] + mechc_dot(map + i * MECHC_NU, by, MECHC_NU);
}

#if MECHC_WALKED
MECHC_ONCE void mechc_rows_at(double t, const double *q, const mechc_scalar_given *given,
                              mechc_scalar_place *place)
{
    mechc_scalar_give_ordinary(given, place);
    mechc_scalar_configuration(t, q, given, place->gap, place->jacobian, place->bias, 0,
                               place->saved, 0, 0);
}
#else
#define mechc_rows_at mechc_scalar_locate_all
#endif

/* Factor of the spread of the gap's samples: with many rows, a sample moves few of them. */
#define MECHC_SAMPLED (MECHC_NH > 2 ? 4.0 : 1.0)

/* The size of the lengths whose sum a gap is, from its derivatives by the speeds: lengths given as
 * decimals, and their sum, have an error of half an ulp each. */
MECHC_STATIC double mechc_sum_of_lengths(const mechc_scalar_place *place)
{
    double longest = place->ordinary_sum / MECHC_OF_A_RADIAN;
    for (int i = 0; i < MECHC_NH; i++) {
        double sum = 0.0;
        for (int j = 0; j < MECHC_NU; j++)
            sum += fabs(place->jacobian[i * MECHC_NU + j]) * mechc_scalar_unit_of(place, MECHC_NQ + j);
        longest = mechc_max(longest, sum);
    }
    return longest;
}

/* Coefficients of lengths in a gap are multiples of 1 / MECHC_PARTS, which are told by slopes whose
 * rounding is a small part of one. */
#define MECHC_PARTS 8.0
#define MECHC_WHOLE 0.1

/* At q* the gap along w is stationary: differences of its values so near to it are rounding. */
#define MECHC_SAMPLED_WITHIN 1e-9

/* Powers of ten that doubles hold exactly. */
#define MECHC_TEN 10.0
#define MECHC_EXACT_POWERS 22

/* Numbers up to here times 10^-k are what someone typed; all that is longer was computed. */
#define MECHC_TYPED 1e15
#define MECHC_TYPED_IN_SCENE 1e9 /* constants, which are known to rounding only */

/* A sum without rounding, as double and remainder, and what its terms stand for besides. */
typedef struct {
    double sum, rest;
    double typed;  /* error of the typed decimals */
    double spread; /* half an ulp of each number that is none */
} mechc_exact;

MECHC_STATIC void mechc_add_exactly(mechc_exact *out, double term)
{
    const double sum = out->sum + term, part = sum - out->sum;
    out->rest += (out->sum - (sum - part)) + (term - part);
    out->sum = sum;
}

/* The decimal of few digits within `near` of x, minus x itself; NaN if there is none. */
MECHC_STATIC double mechc_decimal_beyond(double x, double near, double longest)
{
    double power = 1.0;
    for (int k = 0; k <= MECHC_EXACT_POWERS; k++, power *= MECHC_TEN) {
        const double digits = nearbyint(x * power);
        if (!(fabs(digits) < longest)) return NAN;
        if (fabs(digits / power - x) <= near) return -fma(x, power, -digits) / power;
    }
    return NAN;
}

MECHC_STATIC void mechc_add_length(mechc_exact *out, double coefficient, double length)
{
    const double term = coefficient * length;
    const double beyond = mechc_decimal_beyond(length, 0.0, MECHC_TYPED);
    mechc_add_exactly(out, term);
    mechc_add_exactly(out, fma(coefficient, length, -term));
    if (isnan(beyond))
        out->spread += 0.5 * fabs(coefficient) * (nextafter(fabs(length), HUGE_VAL) - fabs(length));
    else out->typed += coefficient * beyond;
}

MECHC_STATIC double mechc_gap_along(double t, const mechc_scalar_given *given,
                                    const mechc_critical *c)
{
    mechc_scalar_place place;
    mechc_rows_at(t, c->q, given, &place);
    return mechc_dot(c->normal, place.gap, MECHC_NH);
}

/* The coefficient of parameter i in the gap; NaN if it is no such multiple. */
MECHC_STATIC double mechc_coefficient(double t, const mechc_scalar_given *given,
                                      const mechc_critical *c, double gap, int i)
{
    mechc_scalar_given moved = *given;
    if (given->p[i] == 0.0) return 0.0;
    moved.p[i] += ldexp(1.0, ilogb(given->p[i]) - 2);
    mechc_scalar_make_constants(&moved);
    const double by = moved.p[i] - given->p[i];
    const double slope = MECHC_PARTS * (mechc_gap_along(t, &moved, c) - gap) / by;
    const double noise = MECHC_PARTS * 4.0 * c->rounding / fabs(by);
    const double whole = nearbyint(slope);
    return noise < MECHC_WHOLE && fabs(slope - whole) <= noise ? whole / MECHC_PARTS : NAN;
}

/* A gap where links are in line is a sum of lengths, which is found without rounding.  It vanishes
 * as the numbers are stored, or as the decimals that were typed; a number of more digits stands for
 * all that is within half an ulp of it. */
MECHC_RARE_ONCE mechc_reading mechc_read_gap(double t, const mechc_scalar_given *given,
                                             mechc_critical *c)
{
    mechc_exact exact = {0.0, 0.0, 0.0, 0.0};
    const double gap = mechc_gap_along(t, given, c);
    for (int i = 0; i < MECHC_NP; i++) {
        const double coefficient = mechc_coefficient(t, given, c, gap, i);
        if (isnan(coefficient)) return MECHC_UNREAD;
        if (coefficient != 0.0) mechc_add_length(&exact, coefficient, given->p[i]);
    }
    const double constant = gap - exact.sum;
    const double beyond = mechc_decimal_beyond(constant, c->rounding, MECHC_TYPED_IN_SCENE);
    if (isnan(beyond)) return MECHC_UNREAD;
    const double stored = constant + beyond; /* the double nearest to the decimal */
    exact.typed += mechc_decimal_beyond(stored, 0.0, MECHC_TYPED);
    mechc_add_exactly(&exact, stored);
    const double sum = exact.sum + exact.rest, typed = exact.sum + (exact.rest + exact.typed);
    const double least = exact.spread + DBL_EPSILON * c->rounding;
    c->gap = sum;
    return mechc_min(fabs(sum), fabs(typed)) <= least ? MECHC_READS_CLOSED : MECHC_READS_OPEN;
}

/* Compute g and its rounding. */
MECHC_STATIC void mechc_measure_gap(double t, const mechc_scalar_given *given, mechc_critical *c)
{
    mechc_scalar_place place;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int sample = 0; sample <= 2 * MECHC_NU && !mechc_scalar_stopped(given); sample++) {
        double by[MECHC_NU_MAX] = {0}, moved[MECHC_NQ_MAX];
        if (sample > 0) {
            const int j = (sample - 1) / 2;
            const double near = MECHC_SAMPLED_WITHIN * mechc_given_unit(given, MECHC_NQ + j);
            by[j] = sample % 2 ? near : -near;
        }
        mechc_displace(t, c->q, given, by, moved);
        mechc_rows_at(t, moved, given, &place);
        const double gap = mechc_dot(c->normal, place.gap, MECHC_NH);
        low = mechc_min(low, gap), high = mechc_max(high, gap);
    }
    c->gap = 0.5 * (low + high);
    c->rounding =
        mechc_max(DBL_EPSILON * mechc_sum_of_lengths(&place), MECHC_SAMPLED * (high - low));
    c->reading = fabs(c->gap) > MECHC_BENDS * c->rounding ? MECHC_READS_OPEN
                                                          : mechc_read_gap(t, given, c);
}

#endif
