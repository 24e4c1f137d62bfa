/* Reductions of a trajectory to numbers: extremes, means and first crossings of a quantity.
 *
 * A quantity is sampled eight times in every step on the dense output, and extremes and crossings
 * found there are refined; means are Gauss-Legendre sums over the steps.  At a change point
 * constraint forces of an ideal mechanism may grow without bound: there a quantity is infinite.
 */
#pragma once

#include <math.h>
#include <string.h>
#include "batch/samples.h"

#define MECHC_FINE 3e-6 /* of a step: an extreme placed so is right to the square of it */
#define MECHC_LEVEL 1e-12
#define MECHC_VERTEX_BEYOND 2.0 /* samples, of a parabola */
#define MECHC_POLE_WAY 0.25    /* of the way from a change point to the step's end, */
#define MECHC_POLE_HALVINGS 5  /* and how often it is halved */
#define MECHC_POLE_GROWTH 1.2  /* between the ratios of a logarithm, 1, and of an inverse root */
#define MECHC_POLE_SIZE 1e-6   /* of the quantity: what is less is rounding, */
#define MECHC_POLE_ERRORS 1e2  /* or an error of the motion, of so many tolerances */

/* A step and the quantity that is sampled in it. */
typedef struct {
    mechc_reducer *reducer;
    const mechc_quantity *quantity;
    const mechc_trajectory *steps;
    ptrdiff_t step;
    double begin, end; /* the fractions of the step between which it counts, */
    double limit[2];   /* and what the quantity tends to there; NaN: its value */
    double sign; /* extremes are sought as minima of sign * quantity */
} mechc_probe;

static double mechc_probe_time(const mechc_probe *probe, double s)
{
    return mechc_time_in(probe->steps, probe->step, s);
}

/* One component from the polynomial of the step, not projected: within the tolerance of the run. */
static double mechc_probe_component(const mechc_probe *probe, double s)
{
    const mechc_trajectory *steps = probe->steps;
    const ptrdiff_t width = steps->width;
    const int component = probe->quantity->component;
    const double *rows = steps->dense + probe->step * width * steps->dense_rows + component;
    const double *y = steps->y + probe->step * width + component;
    double sum = 0.0;
    if (s >= 1.0) return y[width];
    for (int row = steps->dense_rows - 1; row >= 0; row--)
        sum = (row % 2 ? 1.0 - s : s) * (sum + rows[row * width]);
    return y[0] + sum;
}

/* The quantity at `count` fractions of the step, on the constraints, as it is reported. */
static void mechc_probe_states(const mechc_probe *probe, ptrdiff_t count, const double *s, double *out)
{
    const mechc_reducer *reducer = probe->reducer;
    double t[MECHC_SAMPLES + 1];
    if (count < 1) return;
    for (ptrdiff_t i = 0; i < count; i++) t[i] = mechc_probe_time(probe, s[i]);
    mechc_read_states(reducer->motion, count, t, reducer->states);
    for (ptrdiff_t i = 0; i < count; i++)
        if (s[i] >= 1.0)
            mechc_take_end(probe->steps, probe->step, reducer->states + i * reducer->width);
    mechc_reduce_states(reducer, probe->quantity, count, t, reducer->states, out);
}

/* The quantity at `count` fractions of the step. */
static void mechc_probe_many(const mechc_probe *probe, ptrdiff_t count, const double *s,
                             double *out)
{
    const mechc_quantity *quantity = probe->quantity;
    if (!mechc_is_component(quantity)) mechc_probe_states(probe, count, s, out);
    for (ptrdiff_t i = 0; mechc_is_component(quantity) && i < count; i++) {
        out[i] = mechc_probe_component(probe, s[i]);
        if (quantity->form == MECHC_ABSOLUTE) out[i] = fabs(out[i]);
    }
}

static double mechc_probe_once(const mechc_probe *probe, double s)
{
    double value;
    mechc_probe_many(probe, 1, &s, &value);
    if (probe->quantity->reduction == MECHC_FIRST_CROSSING) return value - probe->quantity->level;
    return probe->sign * value;
}

/* The vertex of the parabola through three values at x - d, x, x + d; NaN where there is none. */
static double mechc_vertex(double a, double b, double c, double x, double d)
{
    const double bend = a - 2.0 * b + c;
    return bend != 0.0 ? x + 0.5 * d * (a - c) / bend : NAN;
}

/* The place of the least value in [low, high], by golden sections and parabolas. */
static double mechc_probe_least(const mechc_probe *probe, double low, double middle, double high,
                                double least)
{
    double f_low = mechc_probe_once(probe, low), f_high = mechc_probe_once(probe, high);
    for (int i = 0; i < 60 && high - low > MECHC_FINE; i++) {
        const double left = middle - low, right = high - middle;
        const double a = (f_low - least) / left, b = (f_high - least) / right;
        /* divided differences; the root of the parabola's slope */
        double x = a + b > 0.0 ? middle + 0.5 * (a * right - b * left) / (a + b) : NAN;
        const double nearest = 0.1 * MECHC_FINE + 1e-3 * fmin(left, right);
        if (i % 3 == 2 || !(x > low && x < high))
            x = left > right ? middle - 0.381966 * left : middle + 0.381966 * right;
        if (fabs(x - middle) < nearest) x = middle + (left > right ? -nearest : nearest);
        const double f = mechc_probe_once(probe, x);
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

/* A zero between two samples of opposite sign, by secants within a bracket that is halved. */
static double mechc_probe_zero(const mechc_probe *probe, double low, double f_low, double high,
                               double f_high)
{
    for (int i = 0; i < 200 && high - low > 4e-16 && f_high != 0.0; i++) {
        double x = 0.5 * (low + high);
        if (i % 3) {
            const double secant = high - f_high * (high - low) / (f_high - f_low);
            const double past = secant + copysign(2e-16, x - secant);
            if (past > low && past < high) x = past;
        }
        const double f = mechc_probe_once(probe, x);
        if (x <= low || x >= high) break;
        if (f == 0.0 || (f < 0.0) != (f_low < 0.0)) high = x, f_high = f;
        else low = x, f_low = f;
    }
    return high;
}

static void mechc_keep_least(const mechc_probe *probe, int i, double value)
{
    mechc_reducer *reducer = probe->reducer;
    if (!reducer->known[i] || probe->sign * value < probe->sign * reducer->value[i]) {
        reducer->value[i] = value;
        reducer->known[i] = 1;
    }
}

/* Whether a minimum whose parabola has the value `foreseen` may be less than the least so far. */
static int mechc_may_be_least(const mechc_probe *probe, int i, double least, double foreseen)
{
    return !(least - 3.0 * fabs(least - foreseen) > probe->sign * probe->reducer->value[i]);
}

/* Refine a minimum between the samples at low and high if it may be below the least so far. */
static void mechc_refine_extreme(const mechc_probe *probe, int i, double low, double middle,
                                 double high, double least, double foreseen)
{
    if (!mechc_may_be_least(probe, i, least, foreseen)) return;
    if (fabs(least - foreseen) <= MECHC_LEVEL * fabs(least)) { /* nothing but rounding to find */
        mechc_keep_least(probe, i, probe->sign * least);
        return;
    }
    const double at = mechc_probe_least(probe, low, middle, high, least);
    double value;
    mechc_probe_states(probe, 1, &at, &value);
    mechc_keep_least(probe, i, value);
}

/* The parabola's value at its vertex. */
static double mechc_foreseen(double a, double b, double c)
{
    const double bend = a - 2.0 * b + c;
    return bend != 0.0 ? b - 0.125 * (a - c) * (a - c) / bend : b;
}

/* Seek a minimum between an end of the part, where the quantity is `end`, and the sample `next` to it at the
 * distance d, lest it be hidden by the end: where the parabola through three samples has its vertex there, or
 * so near beyond the end that what it leaves out may place it. */
static void mechc_reduce_beside(const mechc_probe *probe, int i, double at, double d, double end, double next,
                                double third)
{
    const double vertex = (mechc_vertex(end, next, third, at + d, d) - at) / d;
    if (!(end < next && vertex > -MECHC_VERTEX_BEYOND && vertex < 1.0)) return;
    if (!mechc_may_be_least(probe, i, end, mechc_foreseen(end, next, third))) return;
    const double inside = at + (vertex > 0.0 ? vertex * d : copysign(MECHC_FINE, d));
    const double value = mechc_probe_once(probe, inside);
    if (value < end)
        mechc_refine_extreme(probe, i, fmin(at, at + d), inside, fmax(at, at + d), value, end);
}

static void mechc_reduce_extreme(const mechc_probe *probe, int i, const double *s,
                                 const double *seen)
{
    const int n = MECHC_SAMPLES;
    const double d = s[1] - s[0];
    double f[MECHC_SAMPLES + 1];
    for (int j = 0; j <= n; j++) f[j] = probe->sign * seen[j];
    mechc_keep_least(probe, i, seen[0]);
    mechc_keep_least(probe, i, seen[n]);
    for (int j = 1; j < n; j++)
        if (f[j] <= f[j - 1] && f[j] <= f[j + 1] && (f[j] < f[j - 1] || f[j] < f[j + 1]))
            mechc_refine_extreme(probe, i, s[j - 1], s[j], s[j + 1], f[j],
                                 mechc_foreseen(f[j - 1], f[j], f[j + 1]));
    mechc_reduce_beside(probe, i, s[0], d, f[0], f[1], f[2]);
    mechc_reduce_beside(probe, i, probe->end, -d, f[n], f[n - 1], f[n - 2]);
}

/* Whether the quantity goes through zero from a to b in the requested direction. */
static int mechc_crosses_level(const mechc_probe *probe, double a, double b)
{
    const int crosses = a != 0.0 && (b == 0.0 || (a < 0.0) != (b < 0.0));
    return crosses && probe->quantity->direction * (b - a) >= 0.0;
}

static void mechc_reduce_first(const mechc_probe *probe, int i, const double *s, const double *seen)
{
    const double d = s[1] - s[0];
    double f[MECHC_SAMPLES + 1], zero = NAN;
    for (int j = 0; j <= MECHC_SAMPLES; j++) f[j] = seen[j] - probe->quantity->level;
    /* between steps accelerations jump, where a contact or an input changes */
    if (mechc_crosses_level(probe, probe->reducer->last[i], f[0])) zero = s[0];
    probe->reducer->last[i] = f[MECHC_SAMPLES];
    for (int j = 0; j < MECHC_SAMPLES && !(zero >= 0.0); j++) {
        double low = s[j], f_low = f[j];
        const double vertex = j > 0 ? mechc_vertex(f[j - 1], f[j], f[j + 1], s[j], d) : NAN;
        const double next = j + 2 <= MECHC_SAMPLES
                          ? mechc_vertex(f[j], f[j + 1], f[j + 2], s[j + 1], d) : NAN;
        const double dip = vertex > s[j] && vertex < s[j + 1] ? vertex : next;
        if (dip > s[j] && dip < s[j + 1]) {
            const double f_dip = mechc_probe_once(probe, dip);
            if (mechc_crosses_level(probe, f_low, f_dip))
                zero = mechc_probe_zero(probe, low, f_low, dip, f_dip);
            low = dip, f_low = f_dip;
        }
        if (!(zero >= 0.0) && mechc_crosses_level(probe, f_low, f[j + 1]))
            zero = mechc_probe_zero(probe, low, f_low, s[j + 1], f[j + 1]);
    }
    if (!(zero >= 0.0)) return;
    probe->reducer->value[i] = mechc_probe_time(probe, zero);
    probe->reducer->known[i] = 1;
}

/* The samples of the quantity in a part of a step; of a whole step they are stored. */
static void mechc_probe_all(const mechc_probe *probe, int i, const double *s, double *out)
{
    const int nodes = mechc_set_of(probe->quantity) == MECHC_AT_NODES;
    const ptrdiff_t count = nodes ? MECHC_SAMPLES : MECHC_SAMPLES + 1;
    const int whole = probe->begin == 0.0 && probe->end == 1.0;
    const int looked_up = whole && !mechc_is_component(probe->quantity);
    if (looked_up) memcpy(out, mechc_seen(probe->reducer, probe->steps, probe->step, i),
                          (size_t)count * sizeof(double));
    else mechc_probe_many(probe, count, s, out);
    for (int end = 0; end < 2 && !nodes; end++)
        if (!isnan(probe->limit[end])) out[end * MECHC_SAMPLES] = probe->limit[end];
}

/* Add the integral over a part of a step, by Gauss-Legendre quadrature of order 16. */
static void mechc_reduce_mean(const mechc_probe *probe, int i)
{
    static const double weight[MECHC_SAMPLES] = {
        0.05061426814518813, 0.11119051722668724, 0.15685332293894363, 0.18134189168918100,
        0.18134189168918100, 0.15685332293894363, 0.11119051722668724, 0.05061426814518813};
    const double *t = probe->steps->t + probe->step, *node = mechc_fractions(MECHC_AT_NODES);
    double values[MECHC_SAMPLES], s[MECHC_SAMPLES], sum = 0.0;
    const double part = probe->end - probe->begin;
    for (int j = 0; j < MECHC_SAMPLES; j++) s[j] = probe->begin + part * node[j];
    mechc_probe_all(probe, i, s, values);
    for (int j = 0; j < MECHC_SAMPLES; j++) sum += weight[j] * values[j];
    probe->reducer->value[i] += part * (t[1] - t[0]) * sum;
    for (int end = 0; end < 2; end++) /* beside a pole the integral does not converge */
        if (!isnan(probe->limit[end])) probe->reducer->value[i] += probe->limit[end];
    probe->reducer->known[i] = 1;
}

/* Reduce quantity i over a part of a step. */
static void mechc_reduce_part(const mechc_probe *probe, int i)
{
    const int reduction = probe->quantity->reduction;
    double s[MECHC_SAMPLES + 1], seen[MECHC_SAMPLES + 1];
    if (!(probe->begin < probe->end)) return;
    if (reduction == MECHC_FIRST_CROSSING && probe->reducer->known[i]) return;
    if (reduction == MECHC_MEAN) {
        mechc_reduce_mean(probe, i);
        return;
    }
    for (int j = 0; j <= MECHC_SAMPLES; j++)
        s[j] = probe->begin + (probe->end - probe->begin) * j / MECHC_SAMPLES;
    mechc_probe_all(probe, i, s, seen);
    if (reduction == MECHC_FIRST_CROSSING) mechc_reduce_first(probe, i, s, seen);
    else mechc_reduce_extreme(probe, i, s, seen);
}

/* What the quantity tends to at a change point, from one side: infinity with its sign if it has a
 * pole, else NaN.  At ways that are halved a pole's values change twice as much each time, those of
 * a smooth quantity half as much. */
static double mechc_limit_beside(const mechc_probe *probe, double at, double way)
{
    const double rtol = probe->reducer->motion->rtol;
    double s[MECHC_POLE_HALVINGS + 1], f[MECHC_POLE_HALVINGS + 1];
    for (int k = 0; k <= MECHC_POLE_HALVINGS; k++) s[k] = at + ldexp(way, -k);
    mechc_probe_many(probe, MECHC_POLE_HALVINGS + 1, s, f);
    const double end = f[MECHC_POLE_HALVINGS], last = end - f[MECHC_POLE_HALVINGS - 1];
    int grows = last * end > fmax(MECHC_POLE_SIZE, MECHC_POLE_ERRORS * rtol) * end * end;
    for (int k = 2; k <= MECHC_POLE_HALVINGS; k++) {
        const double before = f[k - 1] - f[k - 2], after = f[k] - f[k - 1];
        grows = grows && before * last > 0.0 && after / before > MECHC_POLE_GROWTH;
    }
    return grows ? copysign(HUGE_VAL, end) : NAN;
}

/* The first crossing whose time, as a fraction of the step, is above `from`. */
static ptrdiff_t mechc_crossing_after(const mechc_probe *probe, double from, ptrdiff_t row)
{
    const mechc_trajectory *steps = probe->steps;
    const double *t = steps->t + probe->step;
    ptrdiff_t low = 0, high = steps->crossing_count;
    while (low < high) {
        const ptrdiff_t middle = low + (high - low) / 2;
        if ((steps->crossings[middle * row] - t[0]) / (t[1] - t[0]) > from) high = middle;
        else low = middle + 1;
    }
    return low;
}

/* Reduce quantity i over the fraction `end` of a step: the parts between its poles, or those that
 * are away from change points. */
static void mechc_reduce_step(mechc_reducer *reducer, const mechc_trajectory *steps, ptrdiff_t step,
                              int i, double end)
{
    const mechc_quantity *quantity = reducer->quantity + i;
    const double *t = steps->t + step, away = quantity->away / fabs(t[1] - t[0]);
    const ptrdiff_t row = reducer->motion->coordinates + 2;
    const int smooth = !quantity->of_motion && away == 0.0;
    mechc_probe probe = {reducer, quantity, steps, step, 0.0, end, {NAN, NAN},
                         quantity->reduction == MECHC_MAXIMUM ? -1.0 : 1.0};
    if (quantity->reduction == MECHC_LAST) return;
    ptrdiff_t k = smooth ? steps->crossing_count : mechc_crossing_after(&probe, -away, row);
    for (; k < steps->crossing_count; k++) {
        const double at = (steps->crossings[k * row] - t[0]) / (t[1] - t[0]);
        double after = NAN;
        if (!(at - away < end)) break;
        probe.end = at - away;
        if (away == 0.0) {
            probe.limit[1] = mechc_limit_beside(&probe, at, -MECHC_POLE_WAY * at);
            after = mechc_limit_beside(&probe, at, MECHC_POLE_WAY * (1.0 - at));
            if (isnan(probe.limit[1]) && isnan(after)) continue;
        }
        mechc_reduce_part(&probe, i);
        probe.begin = fmax(probe.begin, at + away);
        probe.limit[0] = after;
        probe.limit[1] = NAN;
    }
    probe.end = end;
    mechc_reduce_part(&probe, i);
}

/* Reduce the kept steps up to the time `until`; NaN: all of them. */
static void mechc_reducer_take(mechc_reducer *reducer, const mechc_trajectory *steps, double until)
{
    for (int set = 0; set < MECHC_SETS; set++) reducer->samples[set].count = 0; /* of other steps */
    for (ptrdiff_t step = 0; step + 1 < steps->count; step++) {
        const double *t = steps->t + step, before = (until - t[0]) / (t[1] - t[0]);
        if (before <= 0.0) break;
        for (int i = 0; i < reducer->quantities; i++)
            mechc_reduce_step(reducer, steps, step, i, before < 1.0 ? before : 1.0);
    }
}

/* Record a crossing of the level by a jump of the state. */
static void mechc_reducer_jump(mechc_reducer *reducer, double t, const double *before,
                               const double *after)
{
    for (int i = 0; i < reducer->quantities; i++) {
        const mechc_quantity *quantity = reducer->quantity + i;
        const mechc_probe probe = {reducer, quantity, NULL, 0, 0.0, 1.0, {NAN, NAN}, 1.0};
        double one, other;
        if (quantity->reduction != MECHC_FIRST_CROSSING || reducer->known[i]) continue;
        mechc_reduce_states(reducer, quantity, 1, &t, before, &one);
        mechc_reduce_states(reducer, quantity, 1, &t, after, &other);
        if (!mechc_crosses_level(&probe, one - quantity->level, other - quantity->level)) continue;
        reducer->value[i] = t;
        reducer->known[i] = 1;
    }
}

/* Write the results, with the last time and state; NaN for a crossing that did not occur, and for
 * extremes where no time counts. */
static void mechc_reducer_end(mechc_reducer *reducer, double t, const double *y, double *out)
{
    const double passed = t - reducer->t0;
    for (int i = 0; i < reducer->quantities; i++) {
        const mechc_quantity *quantity = reducer->quantity + i;
        double now;
        mechc_reduce_states(reducer, quantity, 1, &t, y, &now);
        if (quantity->reduction == MECHC_FIRST_CROSSING || quantity->away > 0.0) now = NAN;
        if (quantity->reduction == MECHC_MEAN && reducer->known[i]) reducer->value[i] /= passed;
        if (reducer->known[i]) now = reducer->value[i];
        out[i] = now;
    }
}
