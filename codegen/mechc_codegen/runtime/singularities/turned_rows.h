/* Which weak directions turned over within a step, seen from node to node.
 *
 * A step's ends alone do not tell: two near misses leapt in one step turn a direction over twice,
 * and behind the weakest row a second one may pass its own.  So every direction whose singular
 * value is below the clear level is followed with its sign over all nodes of the step.
 */
#ifndef MECHC_TURNED_ROWS_H
#define MECHC_TURNED_ROWS_H

#include "dynamics/sizes.h"
#include "simd/lanes.h"
#include "singularities/critical.h"
#include "singularities/monitor.h"
#include "singularities/span.h"
#include "singularities/weakest.h"

#if MECHC_NH > 0

/* A direction that has surely turned over between two nodes of a step. */
typedef struct {
    int node, row; /* the node after; the direction, counted by falling singular value */
    int nearer;    /* the node of these two at which it is weaker */
} mechc_turn;

/* The share of the singular value after that u . J v must be, to count. */
#define MECHC_SURE 0.3

MECHC_STATIC int mechc_surely_turned(const mechc_weakest *before, const mechc_weakest *after, int k)
{
#if MECHC_NH > 2
    return mechc_followed(before, after, k) < -MECHC_SURE * after->values[k];
#else
    return k == before->rank - 1 && mechc_turned_over(before, after) == 1;
#endif
}

/* Whether that was at a crossing.  Where no critical configuration explains it, the step is too long
 * to follow the motion. */
MECHC_STATIC mechc_verdict mechc_judge_turn(const mechc_span *span, const mechc_turn *turn, int rank,
                                            double reach)
{
    const double *q = span->path->q[turn->nearer];
    const double t = span->t + span->path->fraction[turn->nearer] * span->h;
    mechc_critical found, checked;
    const int is_one =
        mechc_find_critical_of(t, q, span->p, span->k, rank, turn->row, reach, &found)
        && mechc_still_critical(t, found.q, span->p, span->k, reach, &found, &checked);
    return is_one ? mechc_judge(&found) : MECHC_NEAR_MISS;
}

/* The next turn after the one given, which begins with node 0; 0 where there is none. */
MECHC_STATIC int mechc_next_turn(const mechc_span *span, int rank, mechc_weakest *places,
                                 mechc_turn *turn)
{
    for (; turn->node < span->path->count; turn->node++, turn->row = rank) {
        const int i = turn->node;
        mechc_weakest *before = &places[(i + 1) % 2], *after = &places[i % 2];
        if (turn->row == rank)
            mechc_weakest_at(span->t + span->path->fraction[i] * span->h, span->path->q[i], span,
                             rank, after);
        while (i > 0 && --turn->row >= 0) {
            const int k = turn->row;
            if (before->values[k] > MECHC_CLEAR * before->values[0]) break;
            turn->nearer = after->values[k] < before->values[k] ? i : i - 1;
            if (mechc_surely_turned(before, after, k)) return 1;
        }
    }
    return 0;
}

/* Follow the step's nodes: 1 where `out` says that the step cannot stand.  A direction that turned
 * over at a near miss has leapt it; a step over several crossings is to end between the first two. */
MECHC_STATIC int mechc_follow_nodes(const mechc_span *span, const mechc_monitor *monitor, double reach,
                                    mechc_finding *out)
{
    const double *fraction = span->path->fraction;
    mechc_weakest places[2];
    mechc_turn turn = {.node = 0, .row = monitor->rank};
    int crossed = 0;
    while (mechc_next_turn(span, monitor->rank, places, &turn)) {
        const mechc_verdict verdict = mechc_judge_turn(span, &turn, monitor->rank, reach);
        if (verdict == MECHC_TOO_CLOSE_TO_CALL) {
            out->action = MECHC_CANNOT_TELL;
            return 1;
        }
        if (verdict == MECHC_NEAR_MISS) {
            mechc_retry(out, 0.3, 0);
            return 1;
        }
        if (crossed && turn.node > crossed + 1 && monitor->tries < 4) {
            mechc_retry(out, 0.5 * (fraction[crossed] + fraction[turn.node - 1]), span->bridge);
            return 1;
        }
        if (!crossed) crossed = turn.node;
    }
    return 0;
}

#endif

#endif
