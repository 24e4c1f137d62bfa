/* Reductions of a trajectory to numbers: extremes, means and first crossings of a quantity.
 *
 * A quantity is sampled eight times in every step on the dense output.  Extremes found there are refined;
 * where it comes near its level the step is searched as for an event; means are Gauss-Legendre sums.  At a
 * change point constraint forces of an ideal mechanism may grow without bound: there a quantity is infinite.
 */
#pragma once

#include <math.h>
#include <string.h>
#include "batch/samples.h"

#define MECHC_FINE 3e-6 /* of a step: an extreme placed so is right to the square of it */
#define MECHC_FINE_ATTEMPTS 60
#define MECHC_LEVEL 1e-12
#define MECHC_CROSSING_FAR 1e3 /* of the changes in a step: a value farther from its level does not come to it */
#define MECHC_VERTEX_BEYOND 2.0 /* samples, of a parabola */
#define MECHC_POLE_WAY 0.25    /* of the way from a change point to the step's end, */
#define MECHC_POLE_HALVINGS 5  /* and how often it is halved */
#define MECHC_POLE_GROWTH 1.2  /* between the ratios of a logarithm, 1, and of an inverse root */
#define MECHC_POLE_SIZE 1e-6   /* of the quantity: what is less is rounding, */
#define MECHC_ERRORS 1e2       /* or an error of the motion, of so many tolerances */

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
static void mechc_probe_component(const mechc_probe *probe, ptrdiff_t count, const double *s, double *out)
{
    const mechc_trajectory *steps = probe->steps;
    const ptrdiff_t width = steps->width;
    const double *y = steps->y + probe->step * width + probe->quantity->component;
    const double *rows = steps->dense + probe->step * width * steps->dense_rows + probe->quantity->component;
    memset(out, 0, (size_t)count * sizeof *out);
    for (int row = steps->dense_rows - 1; row >= 0; row--)
        for (ptrdiff_t i = 0; i < count; i++)
            out[i] = (row % 2 ? 1.0 - s[i] : s[i]) * (out[i] + rows[row * width]);
    for (ptrdiff_t i = 0; i < count; i++) out[i] = s[i] >= 1.0 ? y[width] : y[0] + out[i];
    for (ptrdiff_t i = 0; probe->quantity->form == MECHC_ABSOLUTE && i < count; i++) out[i] = fabs(out[i]);
}

/* The quantity at `count` fractions of the step, on the constraints, as it is reported. */
static void mechc_probe_states(const mechc_probe *probe, ptrdiff_t count, const double *s, double *out)
{
    const mechc_reducer *reducer = probe->reducer;
    double t[MECHC_EVENT_SAMPLES + 1];
    if (count < 1) return;
    for (ptrdiff_t i = 0; i < count; i++) t[i] = mechc_probe_time(probe, s[i]);
    mechc_read_states(reducer->motion, count, t, reducer->states);
    for (ptrdiff_t i = 0; i < count; i++)
        if (s[i] >= 1.0)
            mechc_take_end(probe->steps, probe->step, reducer->states + i * reducer->width);
    mechc_reduce_states(reducer, probe->quantity, count, t, reducer->states, out);
}

/* The quantity at `count` fractions of the step. */
static void mechc_probe_many(const mechc_probe *probe, ptrdiff_t count, const double *s, double *out)
{
    if (mechc_is_component(probe->quantity)) mechc_probe_component(probe, count, s, out);
    else mechc_probe_states(probe, count, s, out);
}

static double mechc_probe_once(void *probe, double s)
{
    double value;
    mechc_probe_many(probe, 1, &s, &value);
    return ((const mechc_probe *)probe)->sign * value;
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

/* Refine a minimum between the samples a and c if it may be below the least so far. */
static void mechc_refine_extreme(const mechc_probe *probe, int i, mechc_point a, mechc_point b,
                                 mechc_point c, double foreseen)
{
    const mechc_searched function = {mechc_probe_once, (void *)probe};
    if (!mechc_may_be_least(probe, i, b.value, foreseen)) return;
    if (fabs(b.value - foreseen) <= MECHC_LEVEL * fabs(b.value)) { /* nothing but rounding to find */
        mechc_keep_least(probe, i, probe->sign * b.value);
        return;
    }
    double value;
    const double at = mechc_find_least(&function, 1.0, a, b, c, MECHC_FINE, MECHC_FINE_ATTEMPTS).at;
    mechc_probe_states(probe, 1, &at, &value);
    mechc_keep_least(probe, i, value);
}

/* Seek a minimum between an end of the part and the sample `next` to it, lest it be hidden by the end: where
 * the parabola through three samples has its vertex there, or so near beyond the end that what it leaves out
 * may place it. */
static void mechc_reduce_beside(const mechc_probe *probe, int i, mechc_point end, mechc_point next,
                                mechc_point third)
{
    const double d = next.at - end.at;
    const mechc_point vertex = mechc_vertex(end, next, third);
    const double way = (vertex.at - end.at) / d;
    if (!(end.value < next.value && way > -MECHC_VERTEX_BEYOND && way < 1.0)) return;
    if (!mechc_may_be_least(probe, i, end.value, vertex.value)) return;
    mechc_point inside = {way > 0.0 ? vertex.at : end.at + copysign(MECHC_FINE, d), 0.0};
    inside.value = mechc_probe_once((void *)probe, inside.at);
    if (inside.value < end.value)
        mechc_refine_extreme(probe, i, end, inside, next, end.value);
}

static void mechc_reduce_extreme(const mechc_probe *probe, int i, const double *s,
                                 const double *seen)
{
    const int n = MECHC_SAMPLES;
    mechc_point f[MECHC_SAMPLES + 1];
    for (int j = 0; j <= n; j++) f[j] = (mechc_point){s[j], probe->sign * seen[j]};
    mechc_keep_least(probe, i, seen[0]);
    mechc_keep_least(probe, i, seen[n]);
    for (int j = 1; j < n; j++) {
        const double before = f[j - 1].value, here = f[j].value, after = f[j + 1].value;
        if (here <= before && here <= after && (here < before || here < after))
            mechc_refine_extreme(probe, i, f[j - 1], f[j], f[j + 1],
                                 mechc_vertex(f[j - 1], f[j], f[j + 1]).value);
    }
    mechc_reduce_beside(probe, i, f[0], f[1], f[2]);
    mechc_reduce_beside(probe, i, f[n], f[n - 1], f[n - 2]);
}

/* The value of an event that is the quantity less its level, with what it tends to at the ends of the part. */
static double mechc_probe_event(void *context, double t, const double *y, const double *p)
{
    const mechc_probe *probe = context;
    double value;
    (void)p;
    for (int end = 0; end < 2; end++)
        if (!isnan(probe->limit[end]) && t == mechc_probe_time(probe, end ? probe->end : probe->begin))
            return probe->limit[end];
    mechc_reduce_states(probe->reducer, probe->quantity, 1, &t, y, &value);
    return value - probe->quantity->level;
}

/* The first zero of the quantity less its level in a part of a step, found as that of an event whose motion
 * has come this far; 0: none, -1: it has no number. */
static int mechc_probe_zero(const mechc_probe *probe, int i, double *zero)
{
    mechc_reducer *reducer = probe->reducer;
    mechc_watch *watch = &reducer->watch;
    const double *t = probe->steps->t + probe->step;
    mechc_trajectory steps = *probe->steps;
    mechc_motion motion = *reducer->motion;
    steps.count = probe->step + 2;
    motion.steps = &steps;
    motion.inputs = motion.whole;
    watch->motion = &motion;
    watch->step = fabs(t[1] - t[0]);
    watch->functions[i] = (mechc_event_functions){mechc_probe_event, 0, 0, (void *)probe};
    const int grid =
        mechc_event_grid(watch, mechc_probe_time(probe, probe->begin), mechc_probe_time(probe, probe->end));
    const int zeros = mechc_event_zeros(watch, i, grid, watch->times);
    *zero = watch->times[0];
    return zeros;
}

/* Whether an event's search may find a zero among these samples of the part, which are of states that are not
 * projected. */
static int mechc_may_cross(const mechc_probe *probe, const mechc_point *points, double size)
{
    const int n = MECHC_EVENT_SAMPLES;
    double low = INFINITY, change = 0.0;
    mechc_point vertex;
    int may = probe->steps->t[probe->step] == probe->reducer->watch.start
           && fabs(points[0].value) <= MECHC_EVENT_DIP * size; /* it may come back at once */
    for (int j = 0; j <= n; j++) {
        low = fmin(low, fabs(points[j].value));
        change = fmax(change, fabs(points[j].value - points[0].value));
        may |= j < n && mechc_crosses(points[j].value, points[j + 1].value, probe->quantity->direction);
        may |= j + 2 <= n && mechc_dips(points + j, j == 0, j + 2 == n, &vertex);
    }
    may |= !(low > MECHC_ERRORS * probe->reducer->motion->rtol * size) || mechc_changes_fast(points, n + 1);
    return may && !(low > MECHC_CROSSING_FAR * change);
}

/* Find the first crossing of the level: at the begin of the part, if the quantity has jumped there, or within
 * it. */
static void mechc_reduce_first(const mechc_probe *probe, int i, const double *s, const double *seen)
{
    mechc_reducer *reducer = probe->reducer;
    double *size = &reducer->watch.event[i].size, *value = &reducer->value[i];
    mechc_point f[MECHC_EVENT_SAMPLES + 1];
    for (int j = 0; j <= MECHC_EVENT_SAMPLES; j++) {
        f[j] = (mechc_point){s[j], seen[j] - probe->quantity->level};
        if (fabs(f[j].value) < INFINITY) *size = fmax(*size, fabs(f[j].value));
    }
    /* between steps accelerations jump, where a contact or an input changes */
    int found = mechc_crosses(reducer->last[i], f[0].value, probe->quantity->direction);
    reducer->last[i] = f[MECHC_EVENT_SAMPLES].value;
    *value = mechc_probe_time(probe, probe->begin);
    if (!found && mechc_may_cross(probe, f, *size)) found = mechc_probe_zero(probe, i, value);
    reducer->failed |= found < 0;
    reducer->known[i] = found > 0;
}

/* The samples of the quantity in a part of a step; of a whole step they are stored. */
static void mechc_probe_all(const mechc_probe *probe, int i, const double *s, double *out)
{
    const int set = mechc_set_of(probe->quantity), nodes = set == MECHC_AT_NODES;
    const ptrdiff_t count = mechc_samples_of[set] + !nodes;
    const int whole = probe->begin == 0.0 && probe->end == 1.0;
    const int looked_up = whole && !mechc_is_component(probe->quantity);
    if (looked_up) memcpy(out, mechc_seen(probe->reducer, probe->steps, probe->step, i),
                          (size_t)count * sizeof(double));
    else mechc_probe_many(probe, count, s, out);
    for (int end = 0; end < 2 && !nodes; end++)
        if (!isnan(probe->limit[end])) out[end ? count - 1 : 0] = probe->limit[end];
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

/* Whether a component comes neither to its level nor to its extreme so far in a step, by the sizes of the dense
 * output's rows: all but the first have a factor s (1 - s). */
static int mechc_is_away(const mechc_probe *probe, int i)
{
    const mechc_quantity *quantity = probe->quantity;
    const mechc_trajectory *steps = probe->steps;
    const ptrdiff_t width = steps->width;
    const int first = quantity->reduction == MECHC_FIRST_CROSSING;
    const double bar = first ? quantity->level : probe->reducer->value[i];
    const double *y = steps->y + probe->step * width + quantity->component;
    const double *rows = steps->dense + probe->step * width * steps->dense_rows + quantity->component;
    double sizes = 0.0, *last = probe->reducer->last + i;
    if (!mechc_is_component(quantity) || probe->begin > 0.0 || probe->end < 1.0) return 0;
    const int absolute = quantity->form == MECHC_ABSOLUTE;
    const double begin = (absolute ? fabs(y[0]) : y[0]) - bar, end = (absolute ? fabs(y[width]) : y[width]) - bar;
    const double sign = first ? copysign(1.0, begin) : probe->sign;
    if (first ? mechc_crosses(*last, begin, quantity->direction) : !probe->reducer->known[i]) return 0;
    for (int row = 1; row < steps->dense_rows; row++) sizes += fabs(rows[row * width]);
    const double off = MECHC_ERRORS * probe->reducer->motion->rtol * (fabs(y[0]) + fabs(bar));
    if (!(fmin(sign * begin, sign * end) > MECHC_DENSE_BULGE * sizes + off)) return 0;
    if (absolute && sign > 0.0 && y[0] * y[width] <= 0.0) return 0; /* it is zero between */
    *last = end;
    return 1;
}

/* Reduce quantity i over a part of a step. */
static void mechc_reduce_part(const mechc_probe *probe, int i)
{
    const int reduction = probe->quantity->reduction;
    const int first = reduction == MECHC_FIRST_CROSSING, n = mechc_samples_of[mechc_set_of(probe->quantity)];
    double s[MECHC_EVENT_SAMPLES + 1], seen[MECHC_EVENT_SAMPLES + 1];
    if (!(probe->begin < probe->end) || (first && probe->reducer->known[i])) return;
    if (reduction == MECHC_MEAN) {
        mechc_reduce_mean(probe, i);
        return;
    }
    if (mechc_is_away(probe, i)) return;
    for (int j = 0; j <= MECHC_EVENT_SAMPLES; j++)
        s[j] = probe->begin + (probe->end - probe->begin) * (first ? mechc_event_fraction(j) : (double)j / n);
    mechc_probe_all(probe, i, s, seen);
    if (first) mechc_reduce_first(probe, i, s, seen);
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
    int grows = last * end > fmax(MECHC_POLE_SIZE, MECHC_ERRORS * rtol) * end * end;
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
    if (quantity->reduction == MECHC_FIRST_CROSSING) probe.end = end = 1.0; /* see mechc_reducer_cut */
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

/* End a piece of the motion at a time within the last step, or NaN: forget a crossing after it, but not one at
 * the same time, as of an impact; remember the quantities before the next piece. */
static void mechc_reducer_cut(mechc_reducer *reducer, const mechc_trajectory *steps, double until)
{
    const double t = isnan(until) ? steps->t[steps->count - 1] : until;
    reducer->watch.start = t;
    for (int i = 0; i < reducer->quantities; i++) {
        const mechc_quantity *quantity = reducer->quantity + i;
        double now;
        if (quantity->reduction != MECHC_FIRST_CROSSING) continue;
        const double after = reducer->known[i] ? reducer->motion->sense * (reducer->value[i] - t) : 0.0;
        if (after > mechc_located(&reducer->watch, t)) reducer->known[i] = 0;
        else if (after > 0.0) reducer->value[i] = t; /* the crossing is where the piece was cut */
        if (reducer->known[i] || (isnan(until) && steps->count > 1)) continue;
        mechc_read_states(reducer->motion, 1, &t, reducer->states);
        mechc_reduce_states(reducer, quantity, 1, &t, reducer->states, &now);
        now -= quantity->level;
        if (steps->count < 2 && mechc_crosses(reducer->last[i], now, quantity->direction)) {
            reducer->value[i] = t;
            reducer->known[i] = 1;
        }
        reducer->last[i] = now;
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
