/* Passages: change points that an accepted step passed, each with its time and configuration.
 *
 * A step may pass several: where a motion is simple, as that of a folded linkage, steps are long.
 * Nodes do not show that, so the dense output is followed in short pieces, and each change of sign
 * of a weak direction is a passage.
 */
#pragma once

#include "stepping/crossings.h"

/* Move of a coordinate, over its scale, in one piece. */
#define MECHC_PIECE 0.25
#define MECHC_MOST_PIECES 1e4

/* Of the step, over which the rate at a passage is a difference. */
#define MECHC_PASSED_NEAR 1e-3

/* Nodes that a step has at least. */
#define MECHC_LEAST_NODES 4.0

/* Move of a coordinate, over its scale, in a step that may pass a change point which is not known: where
 * it is as far from two nodes as 2 asin(MECHC_CLEAR), whose gap is half of a step of radau5. */
#define MECHC_FAR 1.5

/* The way of the dense output beyond the change point at the fraction s, in this direction. */
MECHC_STATIC double mechc_past_crossing(const mechc_integration *run, const double *rows, double s,
                                        const double *along)
{
    double y[MECHC_NX_MAX], sum = 0.0;
    mechc_dense_polynomial(run->y, rows, run->current->dense_rows, s, y);
    for (int i = 0; i < MECHC_NQ - MECHC_STATES; i++)
        sum += (y[i] - run->decision.q[i]) * along[i];
    return sum;
}

#if MECHC_NH_MAX > 0
/* Fractions of a step between which a time where a direction is weakest is interpolated at last, and a
 * move that is the last. */
#define MECHC_LAST_APART 1e-7
#define MECHC_LAST_MOVE 1e-13

/* The square of the weakest singular value on the dense output, there at a fraction of the step. */
MECHC_STATIC double mechc_weakness(const mechc_integration *run, double h, const double *rows, double s)
{
    double y[MECHC_NX_MAX];
    mechc_weakest weakest;
    mechc_dense_polynomial(run->y, rows, run->current->dense_rows, s, y);
    mechc_weakest_at(run->head.t + s * h, y, &run->given, run->monitor.rank, &weakest);
    return weakest.ratio * weakest.ratio;
}

/* The fraction of the step at which a direction is weakest, near s.  With several freedoms q* is one of
 * many critical configurations, and the motion passes another of them; there the square of the
 * singular value, which is close to a parabola, has its zero. */
MECHC_RARE double mechc_weakest_fraction(const mechc_integration *run, double h, const double *rows,
                                         double s)
{
    double apart = MECHC_PASSED_NEAR;
    const double given = s, least = mechc_weakness(run, h, rows, s);
    for (int iteration = 0; iteration < 16; iteration++) {
        const double before = mechc_weakness(run, h, rows, s - apart);
        const double after = mechc_weakness(run, h, rows, s + apart);
        const double bend = before - 2.0 * mechc_weakness(run, h, rows, s) + after;
        if (!(bend > 0.0)) break;
        const double move = 0.5 * apart * (before - after) / bend;
        s += move;
        if (fabs(move) <= MECHC_LAST_MOVE) break;
        apart = mechc_max(MECHC_LAST_APART, mechc_min(fabs(move), MECHC_PASSED_NEAR));
    }
    return mechc_weakness(run, h, rows, s) <= least ? s : given;
}
#endif

/* The fraction of the step at which it passes the crossing, from the dense output, and in q the
 * configuration there. */
MECHC_STATIC double mechc_fraction_of_crossing(const mechc_integration *run, double h,
                                               const double *rows, double *q)
{
    double s = run->decision.fraction, before[MECHC_NX_MAX], along[MECHC_NX_MAX];
    mechc_dense_polynomial(run->y, rows, run->current->dense_rows, s - MECHC_PASSED_NEAR, before);
    mechc_dense_polynomial(run->y, rows, run->current->dense_rows, s + MECHC_PASSED_NEAR, along);
    for (int i = 0; i < MECHC_NX; i++) along[i] -= before[i];
    for (int iteration = 0; iteration < 8; iteration++) {
        const double here = mechc_past_crossing(run, rows, s, along);
        const double slope = (mechc_past_crossing(run, rows, s + MECHC_PASSED_NEAR, along)
                              - mechc_past_crossing(run, rows, s - MECHC_PASSED_NEAR, along))
                           / (2.0 * MECHC_PASSED_NEAR);
        if (slope == 0.0) break;
        s -= here / slope;
    }
    memcpy(q, run->decision.q, MECHC_NQ * sizeof *q);
#if MECHC_NH_MAX > 0
    if (MECHC_NU - run->monitor.rank < 2) return s;
    s = mechc_weakest_fraction(run, h, rows, s);
    mechc_dense_polynomial(run->y, rows, run->current->dense_rows, s, along);
    memcpy(q, along, MECHC_NQ * sizeof *q);
#else
    (void)h;
#endif
    return s;
}

/* Whether a crossing at the fraction s is the change point at which the run begins: it is not passed. */
MECHC_STATIC int mechc_begins_at(const mechc_integration *run, double s)
{
    return run->head.stats.steps == 0 && run->monitor.at_critical && fabs(s) < MECHC_PASSED_NEAR;
}

/* Record the crossing, its time refined on the dense output; stop there on request. */
MECHC_STATIC int mechc_record_crossing(mechc_integration *run, double h, const double *rows)
{
    double q[MECHC_NQ_MAX];
    const double s = mechc_fraction_of_crossing(run, h, rows, q);
    if (mechc_begins_at(run, s)) return MECHC_RUNNING;
    const double t = s > 1.0 && mechc_is_last(run, h) ? run->t1 : run->head.t + s * h;
    mechc_give_turns(run->turns, q);
    if (!mechc_append_crossing(&run->head.trajectory, t, run->decision.gap, q,
                               MECHC_NQ))
        return MECHC_NO_MEMORY;
    return run->on_change_point == MECHC_STOP_BEFORE ? MECHC_STOPPED_AT_CHANGE_POINT
                                                     : MECHC_RUNNING;
}

#if MECHC_NH_MAX > 0
/* The most that a coordinate moves over the step, in units of its scale. */
MECHC_STATIC double mechc_moved(const mechc_integration *run, double h, const double *end)
{
    double most = 0.0;
    for (int i = 0; i < MECHC_NQ - MECHC_STATES; i++)
        most = mechc_max(most, mechc_max(fabs(end[i] - run->y[i]), fabs(h * MECHC_RATE(run, 0)[i]))
                                   / run->scale[i]);
    return most;
}

/* The change point in a piece of the step, found from where the direction is weaker; 0: none. */
MECHC_STATIC int mechc_find_passed(const mechc_integration *run, const mechc_span *span,
                                   const mechc_seen *before, const mechc_seen *after, double reach,
                                   mechc_critical *found)
{
    const int first = before->weakest.ratio <= after->weakest.ratio;
    const mechc_seen *node = first ? before : after;
    const double t = span->t + node->fraction * span->h;
    return mechc_find_critical(t, node->q, &run->given, &node->weakest, reach, found)
        && found->curves && mechc_judge(found) == MECHC_CROSSING;
}

MECHC_STATIC int mechc_any_turned(int rank, mechc_seen *first, mechc_seen *second)
{
    if (mechc_stays_regular(rank, first, second)) return 0;
    const mechc_weakest *before = mechc_weakest_seen(rank, first);
    const mechc_weakest *after = mechc_weakest_seen(rank, second);
    for (int k = before->rank - 1; k >= 0; k--) {
        if (before->values[k] > MECHC_CLEAR * before->values[0]) return 0;
        if (mechc_surely_turned(before, after, k)) return 1;
    }
    return 0;
}

MECHC_STATIC void mechc_see_dense(const mechc_integration *run, const mechc_span *span,
                                  const double *rows, double s, mechc_seen *out)
{
    double y[MECHC_NX_MAX];
    mechc_dense_polynomial(run->y, rows, run->current->dense_rows, s, y);
    out->fraction = s;
    out->open = 0;
    memcpy(out->q, y, MECHC_NQ * sizeof *y);
    mechc_see(span, out);
}
#endif

/* Whether an accepted step may have passed change points: rows turn no more than coordinates move. */
MECHC_STATIC int mechc_may_pass(const mechc_integration *run, double h, const double *end)
{
#if MECHC_NH_MAX > 0
    if (run->decision.action == MECHC_CROSSES) return 1;
    const double moved = mechc_moved(run, h, end);
    return (moved > MECHC_FAR || mechc_knows_crossing(&run->monitor))
        && MECHC_LEAST_NODES * run->monitor.least < moved;
#else
    (void)run, (void)h, (void)end;
    return 0;
#endif
}

/* Record all passages of the step; at least the crossing that it was placed across. */
MECHC_STATIC int mechc_record_passages(mechc_integration *run, double h, const double *end,
                                       const double *rows)
{
#if MECHC_NH_MAX > 0
    const mechc_span span = mechc_span_of(run, h, end, MECHC_RATE(run, run->current->last_rate));
    const int pieces = 8 + (int)mechc_min(mechc_moved(run, h, end) / MECHC_PIECE, MECHC_MOST_PIECES);
    const ptrdiff_t known = run->head.trajectory.crossing_count;
    const int crosses = run->decision.action == MECHC_CROSSES;
    const mechc_decision placed = run->decision;
    mechc_seen seen[2];
    mechc_scalar_place place;
    mechc_critical found;
    int status = MECHC_RUNNING;
    mechc_scalar_locate_all(span.t, span.start, span.given, &place);
    const double reach = 4.0 * mechc_reach(&span, &place) / pieces;
    mechc_see_dense(run, &span, rows, 0.0, &seen[0]);
    for (int i = 1; i <= pieces && status == MECHC_RUNNING; i++) {
        mechc_seen *before = &seen[(i - 1) % 2], *after = &seen[i % 2];
        mechc_see_dense(run, &span, rows, (double)i / pieces, &seen[i % 2]);
        if (!mechc_any_turned(run->monitor.rank, before, after)) continue;
        if (!mechc_find_passed(run, &span, before, after, reach, &found)) continue;
        memcpy(run->decision.q, found.q, MECHC_NQ * sizeof *found.q);
        run->decision.gap = found.gap;
        run->decision.fraction = (i - 0.5) / pieces;
        status = mechc_record_crossing(run, h, rows);
    }
    run->decision = placed;
    if (status != MECHC_RUNNING || !crosses || run->head.trajectory.crossing_count > known)
        return status;
#else
    (void)end;
#endif
    return mechc_record_crossing(run, h, rows);
}
