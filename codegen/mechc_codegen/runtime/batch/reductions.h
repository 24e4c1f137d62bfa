/* Numbers that stand for a whole trajectory: extremes, means and first crossings of a quantity.
 *
 * A quantity is looked at eight times in every step on the dense output, and extremes and crossings
 * seen there are refined; means are Gauss-Legendre sums over the steps.
 */
#pragma once

#include <math.h>
#include <string.h>
#include "abi/codes.h"
#include "abi/model.h"
#include "batch/looks.h"

#define MECHC_FINE 3e-6 /* of a step: an extreme placed so is right to the square of it */
#define MECHC_LEVEL 1e-12

/* The step at hand, and what is looked at in it. */
typedef struct {
    mechc_reducer *reducer;
    const mechc_quantity *quantity;
    const mechc_trajectory *steps;
    ptrdiff_t step;
    double end;  /* the fraction of the step that counts */
    double sign; /* extremes are sought as minima of sign * quantity */
} mechc_look;

static double mechc_look_time(const mechc_look *look, double s)
{
    return mechc_time_in(look->steps, look->step, s);
}

/* One component on the polynomial of the step, unprojected: within the tolerance of the run. */
static double mechc_look_component(const mechc_look *look, double s)
{
    const mechc_trajectory *steps = look->steps;
    const ptrdiff_t width = steps->width;
    const int component = look->quantity->component;
    const double *rows = steps->dense + look->step * width * steps->dense_rows + component;
    const double *y = steps->y + look->step * width + component;
    double sum = 0.0;
    if (s >= 1.0) return y[width];
    for (int row = steps->dense_rows - 1; row >= 0; row--)
        sum = (row % 2 ? 1.0 - s : s) * (sum + rows[row * width]);
    return y[0] + sum;
}

/* The quantity at `count` fractions of the step. */
static void mechc_look_many(const mechc_look *look, ptrdiff_t count, const double *s, double *out)
{
    const mechc_reducer *reducer = look->reducer;
    const mechc_quantity *quantity = look->quantity;
    double t[MECHC_LOOKS + 1];
    if (mechc_is_component(quantity)) {
        for (ptrdiff_t i = 0; i < count; i++) {
            out[i] = mechc_look_component(look, s[i]);
            if (quantity->form == MECHC_ABSOLUTE) out[i] = fabs(out[i]);
        }
        return;
    }
    for (ptrdiff_t i = 0; i < count; i++) t[i] = mechc_look_time(look, s[i]);
    reducer->unit->interpolate(0, look->steps, reducer->p, reducer->inputs, count, t,
                               reducer->states);
    for (ptrdiff_t i = 0; i < count; i++)
        if (s[i] >= 1.0)
            mechc_take_end(look->steps, look->step, reducer->states + i * reducer->width);
    mechc_reduce_states(reducer, quantity, count, t, reducer->states, out);
}

static double mechc_look_once(const mechc_look *look, double s)
{
    double value;
    mechc_look_many(look, 1, &s, &value);
    if (look->quantity->reduction == MECHC_FIRST_CROSSING) return value - look->quantity->level;
    return look->sign * value;
}

/* The quantity at a fraction of the step, projected: what is reported. */
static double mechc_look_projected(const mechc_look *look, double s)
{
    const mechc_reducer *reducer = look->reducer;
    const double t = mechc_look_time(look, s);
    double value;
    reducer->unit->interpolate(0, look->steps, reducer->p, reducer->inputs, 1, &t,
                               reducer->states);
    if (s >= 1.0) mechc_take_end(look->steps, look->step, reducer->states);
    mechc_reduce_states(reducer, look->quantity, 1, &t, reducer->states, &value);
    return value;
}

/* The vertex of the parabola through three values at x - d, x, x + d; NaN where there is none. */
static double mechc_vertex(double a, double b, double c, double x, double d)
{
    const double bend = a - 2.0 * b + c;
    return bend != 0.0 ? x + 0.5 * d * (a - c) / bend : NAN;
}

/* Where within [low, high] the look is least, by golden sections and parabolas in turn. */
static double mechc_look_least(const mechc_look *look, double low, double middle, double high,
                               double least)
{
    double f_low = mechc_look_once(look, low), f_high = mechc_look_once(look, high);
    for (int i = 0; i < 60 && high - low > MECHC_FINE; i++) {
        const double left = middle - low, right = high - middle;
        const double a = (f_low - least) / left, b = (f_high - least) / right;
        /* divided differences; the root of the parabola's slope */
        double x = a + b > 0.0 ? middle + 0.5 * (a * right - b * left) / (a + b) : NAN;
        const double nearest = 0.1 * MECHC_FINE + 1e-3 * fmin(left, right);
        if (i % 3 == 2 || !(x > low && x < high))
            x = left > right ? middle - 0.381966 * left : middle + 0.381966 * right;
        if (fabs(x - middle) < nearest) x = middle + (left > right ? -nearest : nearest);
        const double f = mechc_look_once(look, x);
        if (f < least) {
            if (x < middle) high = middle, f_high = least;
            else low = middle, f_low = least;
            middle = x, least = f;
        } else if (x < middle) {
            low = x, f_low = f;
        } else {
            high = x, f_high = f;
        }
    }
    return middle;
}

/* A zero between two looks of opposite sign, by secants inside a halving bracket. */
static double mechc_look_zero(const mechc_look *look, double low, double f_low, double high,
                              double f_high)
{
    for (int i = 0; i < 200 && high - low > 4e-16 && f_high != 0.0; i++) {
        double x = 0.5 * (low + high);
        if (i % 3) {
            const double secant = high - f_high * (high - low) / (f_high - f_low);
            const double past = secant + copysign(2e-16, x - secant);
            if (past > low && past < high) x = past;
        }
        const double f = mechc_look_once(look, x);
        if (x <= low || x >= high) break;
        if (f == 0.0 || (f < 0.0) != (f_low < 0.0)) high = x, f_high = f;
        else low = x, f_low = f;
    }
    return high;
}

static void mechc_keep_least(const mechc_look *look, int i, double value)
{
    mechc_reducer *reducer = look->reducer;
    if (!reducer->known[i] || look->sign * value < look->sign * reducer->value[i]) {
        reducer->value[i] = value;
        reducer->known[i] = 1;
    }
}

/* Whether a minimum whose parabola has the value `foreseen` may be less than what is known. */
static int mechc_may_be_least(const mechc_look *look, int i, double least, double foreseen)
{
    return !(least - 3.0 * fabs(least - foreseen) > look->sign * look->reducer->value[i]);
}

/* Refine a minimum between the looks at low and high, unless what is known is less than it can
 * be. */
static void mechc_refine_extreme(const mechc_look *look, int i, double low, double middle,
                                 double high, double least, double foreseen)
{
    if (!mechc_may_be_least(look, i, least, foreseen)) return;
    if (fabs(least - foreseen) <= MECHC_LEVEL * fabs(least)) { /* nothing but rounding to find */
        mechc_keep_least(look, i, look->sign * least);
        return;
    }
    mechc_keep_least(look, i, mechc_look_projected(look, mechc_look_least(look, low, middle, high,
                                                                          least)));
}

/* The parabola's value at its vertex. */
static double mechc_foreseen(double a, double b, double c)
{
    const double bend = a - 2.0 * b + c;
    return bend != 0.0 ? b - 0.125 * (a - c) * (a - c) / bend : b;
}

static void mechc_reduce_extreme(const mechc_look *look, int i, const double *s, const double *seen)
{
    const int n = MECHC_LOOKS;
    const double d = s[1];
    double f[MECHC_LOOKS + 1];
    for (int j = 0; j <= n; j++) f[j] = look->sign * seen[j];
    mechc_keep_least(look, i, seen[0]);
    mechc_keep_least(look, i, seen[n]);
    for (int j = 1; j < n; j++)
        if (f[j] <= f[j - 1] && f[j] <= f[j + 1] && (f[j] < f[j - 1] || f[j] < f[j + 1]))
            mechc_refine_extreme(look, i, s[j - 1], s[j], s[j + 1], f[j],
                                 mechc_foreseen(f[j - 1], f[j], f[j + 1]));
    /* beside an end, where the neighbour within the step is higher still */
    const double first = mechc_vertex(f[0], f[1], f[2], s[1], d);
    const double last = mechc_vertex(f[n - 2], f[n - 1], f[n], s[n - 1], d);
    if (f[0] < f[1] && first > 0.0 && first < s[1]
        && mechc_may_be_least(look, i, f[0], mechc_foreseen(f[0], f[1], f[2]))) {
        const double value = mechc_look_once(look, first);
        if (value < f[0]) mechc_refine_extreme(look, i, 0.0, first, s[1], value, value);
    }
    if (f[n] < f[n - 1] && last > s[n - 1] && last < look->end
        && mechc_may_be_least(look, i, f[n], mechc_foreseen(f[n], f[n - 1], f[n - 2]))) {
        const double value = mechc_look_once(look, last);
        if (value < f[n]) mechc_refine_extreme(look, i, s[n - 1], last, look->end, value, value);
    }
}

/* Whether the look goes through zero from a to b in the direction asked for. */
static int mechc_crosses_level(const mechc_look *look, double a, double b)
{
    const int crosses = a != 0.0 && (b == 0.0 || (a < 0.0) != (b < 0.0));
    return crosses && look->quantity->direction * (b - a) >= 0.0;
}

static void mechc_reduce_first(const mechc_look *look, int i, const double *s, const double *seen)
{
    double f[MECHC_LOOKS + 1], zero = NAN;
    for (int j = 0; j <= MECHC_LOOKS; j++) f[j] = seen[j] - look->quantity->level;
    for (int j = 0; j < MECHC_LOOKS && !(zero >= 0.0); j++) {
        double low = s[j], f_low = f[j];
        const double vertex = j > 0 ? mechc_vertex(f[j - 1], f[j], f[j + 1], s[j], s[1]) : NAN;
        const double next = j + 2 <= MECHC_LOOKS
                          ? mechc_vertex(f[j], f[j + 1], f[j + 2], s[j + 1], s[1]) : NAN;
        const double dip = vertex > s[j] && vertex < s[j + 1] ? vertex : next;
        if (dip > s[j] && dip < s[j + 1]) {
            const double f_dip = mechc_look_once(look, dip);
            if (mechc_crosses_level(look, f_low, f_dip))
                zero = mechc_look_zero(look, low, f_low, dip, f_dip);
            low = dip, f_low = f_dip;
        }
        if (!(zero >= 0.0) && mechc_crosses_level(look, f_low, f[j + 1]))
            zero = mechc_look_zero(look, low, f_low, s[j + 1], f[j + 1]);
    }
    if (!(zero >= 0.0)) return;
    look->reducer->value[i] = mechc_look_time(look, zero);
    look->reducer->known[i] = 1;
}

/* The quantity at the places of the step; those of all of it are looked up. */
static void mechc_look_all(const mechc_look *look, int i, const double *s, double *out)
{
    const int nodes = mechc_set_of(look->quantity) == MECHC_AT_NODES;
    const ptrdiff_t count = nodes ? MECHC_LOOKS : MECHC_LOOKS + 1;
    const int looked_up = look->end == 1.0 && !mechc_is_component(look->quantity);
    if (looked_up) memcpy(out, mechc_seen(look->reducer, look->steps, look->step, i),
                          (size_t)count * sizeof(double));
    else mechc_look_many(look, count, s, out);
}

/* Gauss-Legendre of order 16 over the step. */
static void mechc_reduce_mean(const mechc_look *look, int i)
{
    static const double weight[MECHC_LOOKS] = {
        0.05061426814518813, 0.11119051722668724, 0.15685332293894363, 0.18134189168918100,
        0.18134189168918100, 0.15685332293894363, 0.11119051722668724, 0.05061426814518813};
    const double *t = look->steps->t + look->step, *node = mechc_fractions(MECHC_AT_NODES);
    double values[MECHC_LOOKS], s[MECHC_LOOKS], sum = 0.0;
    for (int j = 0; j < MECHC_LOOKS; j++) s[j] = look->end * node[j];
    mechc_look_all(look, i, s, values);
    for (int j = 0; j < MECHC_LOOKS; j++) sum += weight[j] * values[j];
    look->reducer->value[i] += look->end * (t[1] - t[0]) * sum;
    look->reducer->known[i] = 1;
}

/* Quantity i over the fraction `end` of a step. */
static void mechc_reduce_step(mechc_reducer *reducer, const mechc_trajectory *steps, ptrdiff_t step,
                              int i, double end)
{
    const mechc_quantity *quantity = reducer->quantity + i;
    const mechc_look look = {reducer, quantity, steps, step, end,
                             quantity->reduction == MECHC_MAXIMUM ? -1.0 : 1.0};
    double s[MECHC_LOOKS + 1], seen[MECHC_LOOKS + 1];
    if (quantity->reduction == MECHC_LAST) return;
    if (quantity->reduction == MECHC_FIRST_CROSSING && reducer->known[i]) return;
    if (quantity->reduction == MECHC_MEAN) {
        mechc_reduce_mean(&look, i);
        return;
    }
    for (int j = 0; j <= MECHC_LOOKS; j++) s[j] = end * j / MECHC_LOOKS;
    mechc_look_all(&look, i, s, seen);
    if (quantity->reduction == MECHC_FIRST_CROSSING) mechc_reduce_first(&look, i, s, seen);
    else mechc_reduce_extreme(&look, i, s, seen);
}

/* The fraction of a step up to the first terminal crossing in it; 1 without one. */
static double mechc_reduce_terminal(mechc_reducer *reducer, const mechc_trajectory *steps,
                                    ptrdiff_t step)
{
    const double start = steps->t[step], length = steps->t[step + 1] - start;
    double end = 1.0;
    for (int i = 0; i < reducer->quantities; i++) {
        if (!reducer->quantity[i].terminal) continue;
        mechc_reduce_step(reducer, steps, step, i, end);
        if (!reducer->known[i]) continue;
        reducer->stop = reducer->value[i];
        end = fmin(end, fmax((reducer->stop - start) / length, 0.0));
    }
    return end;
}

/* Take in the steps at hand, up to a terminal crossing. */
static void mechc_reducer_take(mechc_reducer *reducer, const mechc_trajectory *steps)
{
    mechc_forget_looks(reducer);
    for (ptrdiff_t step = 0; step + 1 < steps->count && isnan(reducer->stop); step++) {
        const double end = mechc_reduce_terminal(reducer, steps, step);
        for (int i = 0; i < reducer->quantities; i++)
            if (!reducer->quantity[i].terminal) mechc_reduce_step(reducer, steps, step, i, end);
    }
}

/* The results, with the last time and state; NaN for a crossing that did not come. */
static void mechc_reducer_end(mechc_reducer *reducer, double t, const double *y, double *out)
{
    const double passed = t - reducer->t0;
    for (int i = 0; i < reducer->quantities; i++) {
        const mechc_quantity *quantity = reducer->quantity + i;
        double now;
        mechc_reduce_states(reducer, quantity, 1, &t, y, &now);
        if (quantity->reduction == MECHC_FIRST_CROSSING) now = NAN;
        if (quantity->reduction == MECHC_MEAN && reducer->known[i]) reducer->value[i] /= passed;
        if (reducer->known[i]) now = reducer->value[i];
        out[i] = now;
    }
}
