/* The zeros of events within the steps of a motion, on its dense output.
 *
 * A step is sampled at uneven fractions, after a reset ever more densely towards its start, and
 * more densely where samples lie off the chords beside them.  Zeros between two samples and the
 * least values between three are found as in run/zeros.h.  An end of a mode that
 * is linear along the dense output is sampled only where the polynomial may come to zero.
 */
#pragma once

#include "hybrid/events/watch.h"

#define MECHC_EVENT_BENT 0.1   /* of all change over a step: a sample farther off its chord is coarse */
#define MECHC_EVENT_COARSE 0.25 /* of the samples: where more are, it is sampled too rarely */
#define MECHC_EVENT_SIGN 5e-324 /* the least positive double: its sign alone counts */
#define MECHC_EVENT_UNEVEN 0.8   /* of the distance of even samples: how far one is moved at most */
#define MECHC_EVENT_DIP 0.1      /* of the largest value: a minimum above it comes to no zero */
#define MECHC_EVENT_FAR 32.0     /* times as far from a change of sign: there a function with a pole is smaller */
#define MECHC_EVENT_GROWS 1.05   /* by this factor; so are the inverse of a third root and the logarithm */
#define MECHC_EVENT_SECTIONS 41 /* of the time between three samples, for the least value there */
#define MECHC_EVENT_ATTEMPTS 300
#define MECHC_ROOT_TWO 1.4142135623730951
#define MECHC_DENSE_BULGE 0.25   /* the largest s (1 - s) */
#define MECHC_EVENT_GRAZES 10.0 /* times rtol of its largest value: a touch so small may not be one */

/* Sort points by time, or in reverse for sense -1, by insertion, as most are in order. */
MECHC_STATIC void mechc_sort_points(mechc_point *points, int count, double sense)
{
    for (int i = 1; i < count; i++) {
        const mechc_point point = points[i];
        int k = i;
        for (; k > 0 && sense * (points[k - 1].at - point.at) > 0.0; k--) points[k] = points[k - 1];
        points[k] = point;
    }
}

/* The fraction of the step at sample i; uneven, as a function in phase with even ones would seem slow. */
MECHC_STATIC double mechc_event_fraction(int i)
{
    const double square = (double)(i * i) * MECHC_ROOT_TWO;
    if (i <= 0) return 0.0;
    if (i >= MECHC_EVENT_SAMPLES) return 1.0;
    return (i + MECHC_EVENT_UNEVEN * (square - floor(square) - 0.5)) / MECHC_EVENT_SAMPLES;
}

/* Compute the sample times of a step and the states there; returns their number.  The first grid at
 * the start of a motion is ever denser towards the start. */
MECHC_STATIC int mechc_event_grid(mechc_watch *watch, double start, double end)
{
    const double length = end - start, first = mechc_event_fraction(1);
    int count = 1, halvings = 0;
    if (start == watch->start) {
        const double ratio = log2(first * fabs(length) / mechc_located(watch, start));
        halvings = ratio > 0.0 ? (int)fmin(ratio, MECHC_EVENT_HALVINGS) : 0;
    }
    watch->grid[0] = start;
    for (int k = halvings; k > 0; k--) watch->grid[count++] = start + length * ldexp(first, -k);
    for (int i = 1; i < MECHC_EVENT_SAMPLES; i++)
        watch->grid[count++] = start + length * mechc_event_fraction(i);
    watch->grid[count++] = end;
    watch->motion->states(watch->motion, count, watch->grid, watch->on_grid);
    return count;
}

/* Whether an end of a mode stays above zero in a step by the bound of its polynomial.  With v0 and v1
 * at the ends of the step and the rows r of the dense output it is
 *     (1-s) v0 + s v1 + s(1-s) (r1 + s r2 + s(1-s) (r3 + s r4 + s(1-s) (...))),
 * of which each r_i + s r_k is least at s = 0 or 1: where the bracket is nowhere below -b, it has no
 * zero if (sqrt(v0) + sqrt(v1))^2 > b.  At the start of a piece v0 may be rounding; then what counts
 * lies beyond the exactness of times. */
MECHC_STATIC int mechc_event_stays_positive(const mechc_watch *watch, int number, ptrdiff_t step)
{
    const mechc_event *event = watch->event + number;
    const mechc_trajectory *steps = watch->motion->steps;
    const int width = watch->motion->width, count = steps->dense_rows;
    const double *line = event->line, *rows = steps->dense + step * width * count;
    const double begin = steps->t[step], length = fabs(steps->t[step + 1] - begin);
    double below = 0.0, share = 1.0;
    if (!line || !count) return 0;
    for (int row = 1; row < count; row += 2, share *= MECHC_DENSE_BULGE) {
        const double at_zero = mechc_inner_product(line, rows + row * width, width);
        const double more = row + 1 < count ? mechc_inner_product(line, rows + (row + 1) * width, width) : 0.0;
        const double least = more > 0.0 ? at_zero : at_zero + more;
        below -= share * (least >= 0.0 ? 0.0 : least); /* NaN where a row is not finite */
    }
    const double *y = steps->y + step * width;
    const double first = event->constant + mechc_inner_product(line, y, width);
    const double last = event->constant + mechc_inner_product(line, y + width, width);
    if (first < 0.0 && event->side != 0.0 && begin == watch->start)
        return last > below && first + mechc_located(watch, begin) / length * (last - below) > 0.0;
    return first >= 0.0 && last > 0.0 && first + last + 2.0 * sqrt(first * last) > below;
}

/* Whether samples lie too far off the chords between their neighbours. */
MECHC_STATIC int mechc_changes_fast(const mechc_point *points, int count)
{
    double low = points[0].value, high = low, least = fabs(low);
    int off = 0;
    for (int i = 1; i < count; i++) {
        low = fmin(low, points[i].value);
        high = fmax(high, points[i].value);
        least = fmin(least, fabs(points[i].value));
    }
    const double change = high - low;
    if (!(change > 0.0 && change < INFINITY) || least > 4.0 * change) return 0;
    for (int i = 1; i + 1 < count; i++) {
        const mechc_point a = points[i - 1], b = points[i], c = points[i + 1];
        const double share = (b.at - a.at) / (c.at - a.at);
        off += fabs(b.value - (1.0 - share) * a.value - share * c.value) > MECHC_EVENT_BENT * change;
    }
    return off > MECHC_EVENT_COARSE * (count - 2);
}

/* Insert a point between each two points; returns the new number of points. */
MECHC_STATIC int mechc_twice_as_many(mechc_watch *watch, int count)
{
    mechc_motion *motion = watch->motion;
    mechc_point *points = watch->points, *spare = watch->spare;
    double *times = watch->times;
    memcpy(spare, points, (size_t)count * sizeof *points);
    for (int i = 0; i + 1 < count; i++) times[i] = 0.5 * (spare[i].at + spare[i + 1].at);
    for (int i = 0; i + 1 < count; i++) {
        const int row = i % MECHC_EVENT_GRID, left = count - 1 - i;
        const int some = left < MECHC_EVENT_GRID ? left : MECHC_EVENT_GRID;
        if (!row) motion->states(motion, some, times + i, watch->states);
        const double *y = watch->states + (ptrdiff_t)row * motion->width;
        points[2 * i] = spare[i];
        points[2 * i + 1] = (mechc_point){times[i], mechc_event_value(watch, watch->searched, times[i], y)};
    }
    points[2 * count - 2] = spare[count - 1];
    return 2 * count - 1;
}

/* Add the minima of samples of one sign, towards zero: where the vertex of a parabola is near zero and does
 * not pass it, those of the function itself. */
MECHC_STATIC int mechc_add_dips(mechc_watch *watch, int count)
{
    const mechc_searched function = {mechc_event_at, watch};
    mechc_point *points = watch->points, at;
    const double near = MECHC_EVENT_DIP * watch->event[watch->searched].size;
    int all = count;
    for (int i = 0; i + 2 < count; i++) {
        const mechc_point a = points[i], c = points[i + 2];
        const double sign = copysign(1.0, a.value);
        if (!mechc_dips(points + i, i == 0, i + 3 == count, &at)) continue;
        at = mechc_point_at(&function, at.at);
        if (sign * at.value > 0.0 && !(sign * at.value > near)) {
            at = mechc_point_at(&function, c.at - MECHC_GOLDEN * (c.at - a.at));
            at = mechc_find_least(&function, sign, a, at, c, 0.0, MECHC_EVENT_SECTIONS);
        }
        points[all++] = at;
    }
    return all;
}

/* Whether the function grows towards a change of sign, on one side of it: from MECHC_EVENT_FAR times the
 * distance, or from the sample where that is nearer. */
MECHC_STATIC int mechc_grows_towards(mechc_watch *watch, double at, double from, mechc_point sample)
{
    const double reach = MECHC_EVENT_FAR * (from - at);
    const int within = fabs(sample.at - at) > fabs(reach);
    const double near = fabs(mechc_event_at(watch, from));
    const double far = fabs(within ? mechc_event_at(watch, at + reach) : sample.value);
    return near == INFINITY || near > MECHC_EVENT_GROWS * far;
}

/* Whether a change of sign between two samples, bracketed by [low, high], is one through a pole: the function
 * grows towards it from both sides, as at no zero and at no jump. */
MECHC_STATIC int mechc_is_pole(mechc_watch *watch, mechc_point before, mechc_point after, double low,
                               double high)
{
    const double at = 0.5 * (low + high), wide = high - low;
    return mechc_grows_towards(watch, at, at - wide, before)
        && mechc_grows_towards(watch, at, at + wide, after);
}

/* A zero between two samples, by secant steps inside a bracket that is halved at least every third
 * step; for an event with a reset to the last digit, since errors add up over resets.  NaN at a pole. */
MECHC_STATIC double mechc_event_root(mechc_watch *watch, mechc_point before, mechc_point after)
{
    const mechc_searched function = {mechc_event_at, watch};
    const double width = 0.5 * mechc_located(watch, fmax(fabs(before.at), fabs(after.at)));
    mechc_point low = before, high = mechc_point_at(&function, after.at);
    mechc_find_zero(&function, &low, &high, width, MECHC_EVENT_ATTEMPTS, 1);
    /* at a zero the function is smaller on both sides than at the samples */
    if (high.value != 0.0
        && fmin(fabs(low.value), fabs(high.value)) >= fmin(fabs(before.value), fabs(after.value))
        && mechc_is_pole(watch, before, after, low.at, high.at))
        return NAN;
    if (!mechc_event_resets(watch, watch->searched) || high.value == low.value) return high.at;
    const double exact = high.at - high.value * (high.at - low.at) / (high.value - low.value);
    return fmin(fmax(exact, fmin(low.at, high.at)), fmax(low.at, high.at));
}

/* Record a minimum towards zero that may or may not be a zero. */
MECHC_STATIC void mechc_watch_touch(mechc_watch *watch, int number, mechc_point before, mechc_point at,
                                    mechc_point after)
{
    mechc_event *event = watch->event + number;
    const double direction = watch->policy[number].direction;
    const double sign = copysign(1.0, direction ? -direction : before.value);
    const double a = sign * before.value, b = sign * at.value, c = sign * after.value;
    const double touches = MECHC_EVENT_GRAZES * watch->motion->rtol * event->size;
    if (isnan(event->grazing) && a > b && b < c && a > 0.0 && c > 0.0 && fabs(b) <= touches)
        event->grazing = at.at;
}

/* Record minima towards zero, also where this step begins, that may or may not be zeros. */
MECHC_STATIC void mechc_watch_grazing(mechc_watch *watch, int number, int count)
{
    mechc_event *event = watch->event + number;
    const mechc_point *points = watch->points;
    int first = 0;
    if (event->ended == points[0].at && points[0].at != watch->start && points[0].value != 0.0)
        mechc_watch_touch(watch, number, event->before, points[0], points[1]);
    if (event->cleared > 0.0 && points[0].at == watch->start)
        while (first < count && !(points[first].value > 2.0 * event->cleared)) first++;
    for (int i = first; i + 2 < count; i++)
        mechc_watch_touch(watch, number, points[i], points[i + 1], points[i + 2]);
    event->before = points[count - 2];
    event->ended = points[count - 1].at;
}

/* The values of an event on the grid of `count` times; points close to the start of the piece are
 * moved to the end, and *close gets their number.  Returns the number of the others. */
MECHC_STATIC int mechc_event_samples(mechc_watch *watch, int number, int count, int *close)
{
    mechc_event *event = watch->event + number;
    mechc_point *points = watch->points;
    const int halvings = count - MECHC_EVENT_SAMPLES - 1;
    *close = 0;
    for (int i = 0; i < count; i++) {
        const double t = watch->grid[i];
        const double *y = watch->on_grid + (ptrdiff_t)i * watch->motion->width;
        const int near = i > 0 && i <= halvings;
        if (near && fabs(t - watch->start) < event->near) continue;
        const int place = i == 0 ? 0 : near ? MECHC_EVENT_SAMPLES + 1 + (*close)++ : i - halvings;
        points[place] = (mechc_point){t, mechc_event_value(watch, number, t, y)};
        if (fabs(points[place].value) < INFINITY) event->size = fmax(event->size, fabs(points[place].value));
    }
    if (points[0].at == watch->start && event->side != 0.0)
        points[0].value = event->side * MECHC_EVENT_SIGN;
    return MECHC_EVENT_SAMPLES + 1;
}

/* Whether a zero is that at the start of the piece, for an event without a reset. */
MECHC_STATIC int mechc_event_is_start(const mechc_watch *watch, int number, double t)
{
    return watch->event[number].side == 0.0 && !mechc_event_resets(watch, number)
        && fabs(t - watch->start) <= mechc_located(watch, t);
}

/* The zeros of one event in a step whose grid has `grid` times, in order; returns their number, or
 * -1 if its value is not a number. */
MECHC_STATIC int mechc_event_zeros(mechc_watch *watch, int number, int grid, double *root)
{
    mechc_event *event = watch->event + number;
    mechc_point *points = watch->points, near[MECHC_EVENT_HALVINGS];
    const double begin = watch->grid[0], end = watch->grid[grid - 1];
    const double direction = watch->policy[number].direction;
    int roots = 0, close, count = mechc_event_samples(watch, number, grid, &close);
    watch->searched = number;
    memcpy(near, points + count, (size_t)close * sizeof *near);
    while (mechc_changes_fast(points, count)) {
        if (count > MECHC_EVENT_MOST_SAMPLES) {
            if (isnan(event->too_fast)) event->too_fast = begin;
            break;
        }
        count = mechc_twice_as_many(watch, count);
    }
    count = mechc_add_dips(watch, count);
    memcpy(points + count, near, (size_t)close * sizeof *near);
    count += close;
    mechc_sort_points(points, count, end < begin ? -1.0 : 1.0);
    for (int i = 0; i < count; i++)
        if (isnan(points[i].value)) return -1;
    for (int i = 0; i + 1 < count; i++) {
        if (!mechc_crosses(points[i].value, points[i + 1].value, direction)) continue;
        root[roots] = mechc_event_root(watch, points[i], points[i + 1]);
        roots += !isnan(root[roots]) && !mechc_event_is_start(watch, number, root[roots]);
    }
    mechc_watch_grazing(watch, number, count);
    return roots;
}

/* The index of the zero in a step at which an event ends or resets the motion; -1: none. */
MECHC_STATIC int mechc_event_stop(const mechc_watch *watch, int number, int roots)
{
    const long terminal = watch->policy[number].terminal, before = watch->event[number].count;
    if (!roots) return -1;
    if (mechc_event_resets(watch, number)) return 0;
    return terminal > 0 && terminal <= before + roots ? (int)(terminal - before - 1) : -1;
}

/* Whether an event without a reset is at the time of the stop, though its zero was found after it: at an impact,
 * say, at the level that is asked for. */
MECHC_STATIC int mechc_event_is_at(const mechc_watch *watch, int number, double after, double stop)
{
    return !mechc_event_resets(watch, number) && after <= mechc_located(watch, stop);
}

/* Search a step of the piece, by its number.  Returns MECHC_RUNNING, MECHC_STOPPED_BY_EVENT with the time at
 * which an event ends or resets the motion, or why the search failed. */
MECHC_STATIC int mechc_watch_step(mechc_watch *watch, int piece, ptrdiff_t step, double *stop)
{
    mechc_motion *motion = watch->motion;
    double *root = watch->times;
    const double *t = motion->steps->t + step;
    const ptrdiff_t first = watch->zeros;
    int grid = 0;
    ptrdiff_t kept = first;
    watch->stopped_by = -1;
    watch->step = fabs(t[1] - t[0]);
    for (int k = 0; k < watch->count; k++) {
        if (watch->event[k].idle || mechc_event_stays_positive(watch, k, step)) continue;
        const int own = watch->functions[k].value != 0;
        if (own && !grid) grid = mechc_event_grid(watch, t[0], t[1]);
        const int roots = own ? mechc_event_zeros(watch, k, grid, root) : watch->search(watch->context, step, root);
        const int at = roots < 0 ? -1 : mechc_event_stop(watch, k, roots);
        if (roots < 0) {
            watch->stopped_by = k;
            return MECHC_EVENT_FAILED;
        }
        const double after = at >= 0 && watch->stopped_by >= 0 ? motion->sense * (root[at] - *stop) : -1.0;
        if (at >= 0 && after >= 0.0 && mechc_event_resets(watch, watch->stopped_by)
            && mechc_event_is_at(watch, k, after, *stop)) {
            root[at] = *stop; /* an end comes before a reset at the same time */
            watch->stopped_by = k;
        } else if (at >= 0 && after < 0.0) {
            *stop = root[at];
            watch->stopped_by = k;
        }
        for (int i = 0; i < roots && k < watch->own; i++)
            if (!mechc_watch_keep(watch, k, root[i], piece, watch->states)) return MECHC_NO_MEMORY;
    }
    for (ptrdiff_t i = first; i < watch->zeros; i++) { /* those after the stop are omitted */
        mechc_event_zero zero = watch->zero[i];
        const double after = watch->stopped_by >= 0 ? motion->sense * (zero.t - *stop) : -1.0;
        if (after > 0.0 && !mechc_event_is_at(watch, zero.event, after, *stop)) {
            watch->event[zero.event].count--;
            continue;
        }
        zero.t = after > 0.0 ? *stop : zero.t;
        if (watch->keeps_states)
            motion->states(motion, 1, &zero.t, watch->zero_state + kept * motion->width);
        watch->event[zero.event].latest = zero.t;
        watch->zero[kept++] = zero;
    }
    watch->zeros = kept;
    return watch->stopped_by < 0 ? MECHC_RUNNING : MECHC_STOPPED_BY_EVENT;
}
