/* Which weak directions turned over within a step, seen from node to node.
 *
 * A step's ends alone do not tell: two near misses leapt in one step turn a direction over twice,
 * and behind the weakest row a second one may pass its own.  So every direction whose singular
 * value is below the clear level is followed with its sign over all nodes of the step.
 */
#pragma once

#include "dynamics/scalar_stage.h"
#include "singularities/critical.h"
#include "singularities/monitor.h"
#include "singularities/span.h"
#include "singularities/weakest.h"

#if MECHC_NH > 0

/* Two neighbouring nodes of a step. */
typedef struct {
    int after; /* the later one */
    const mechc_weakest *at[2];
} mechc_piece;

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

#if MECHC_NH > 2
/* u_i . J v_j of the rows after for all weak vectors before, from the row `first` on. */
MECHC_STATIC void mechc_followed_all(const mechc_weakest *before, const mechc_weakest *after,
                                     int first, double *b)
{
    const int weak = before->rank - first;
    double left[MECHC_NH * MECHC_NH], right[MECHC_NH * MECHC_NH];
    for (int k = 0; k < weak; k++)
        for (int i = 0; i < MECHC_NH; i++) {
            const double *u = before->basis + (first + k) * MECHC_NH;
            const double *v = before->rows + (first + k) * MECHC_NU;
            left[k * MECHC_NH + i] = mechc_dot(u, after->basis + i * MECHC_NH, MECHC_NH);
            right[k * MECHC_NH + i] = mechc_dot(v, after->rows + i * MECHC_NU, MECHC_NU)
                                    / mechc_max(before->values[first + k], 1e-300);
        }
    for (int k = 0; k < weak; k++)
        for (int l = 0; l < weak; l++)
            b[k * weak + l] = mechc_dot(left + k * MECHC_NH, right + l * MECHC_NH, MECHC_NH);
}

/* Is b + b^T positive definite?  It is overwritten. */
MECHC_STATIC int mechc_is_positive(double *b, int n)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) b[i * n + j] = b[j * n + i] = b[i * n + j] + b[j * n + i];
    for (int j = 0; j < n; j++) {
        if (!(b[j * n + j] > 0.0)) return 0;
        for (int i = j + 1; i < n; i++)
            for (int k = j + 1; k <= i; k++)
                b[i * n + k] -= b[i * n + j] * b[k * n + j] / b[j * n + j];
    }
    return 1;
}
#endif

/* Surely no weak direction turned over: together they went on, however they mixed. */
MECHC_STATIC int mechc_surely_kept(const mechc_weakest *before, const mechc_weakest *after)
{
#if MECHC_NH > 2
    double b[MECHC_NH * MECHC_NH];
    int first = before->rank - 1;
    while (first > 0 && before->values[first - 1] <= MECHC_CLEAR * before->values[0]) first--;
    if (before->values[first] > MECHC_CLEAR * before->values[0]) return 1;
    mechc_followed_all(before, after, first, b);
    return mechc_is_positive(b, before->rank - first);
#else
    return mechc_turned_over(before, after) == 0;
#endif
}

/* Closure that a critical configuration may leave beside what it leaves along its normal, in units
 * of rounding: more is the gap of another row. */
#define MECHC_CLOSED_BESIDE 4.0

/* Is it one, with every gap closed but the one along its normal? */
MECHC_STATIC int mechc_is_critical(const mechc_span *span, double t, const mechc_critical *c)
{
    mechc_scalar_place place;
    double rounding;
    mechc_place_at(t, c->q, span->given, &place);
    mechc_scalar_gap(&place, c->q, &rounding);
    for (int i = 0; i < MECHC_NH; i++)
        if (!(fabs(place.gap[i] - c->gap * c->normal[i]) <= MECHC_CLOSED_BESIDE * rounding))
            return 0;
    return 1;
}

/* What direction k passed there, seen from the node at which it is weaker.  Where no critical
 * configuration explains that it surely turned, the step is too long to follow the motion. */
MECHC_STATIC mechc_verdict mechc_judge_row(const mechc_span *span, const mechc_piece *piece, int k,
                                           double reach, int surely)
{
    const int node = piece->after - (piece->at[0]->values[k] <= piece->at[1]->values[k]);
    const double *q = span->path->q[node], t = span->t + span->path->fraction[node] * span->h;
    mechc_critical found;
    const int is_one =
        mechc_find_critical_of(t, q, span->given, piece->at[0]->rank, k, reach, &found)
        && mechc_is_critical(span, t, &found);
    return is_one ? mechc_judge(&found) : surely ? MECHC_NEAR_MISS : MECHC_CROSSING;
}

/* The worst that a weak direction passed between two nodes; *turned counts those that surely turned
 * over. */
MECHC_STATIC mechc_verdict mechc_judge_piece(const mechc_span *span, const mechc_piece *piece,
                                             double reach, int *turned)
{
    const mechc_weakest *before = piece->at[0], *after = piece->at[1];
    mechc_verdict worst = MECHC_CROSSING;
    *turned = 0;
    if (mechc_surely_kept(before, after)) return worst;
    for (int k = before->rank - 1; k >= 0 && worst == MECHC_CROSSING; k--) {
        if (before->values[k] > MECHC_CLEAR * before->values[0]) break;
        if (!mechc_surely_turned(before, after, k)) continue;
        worst = mechc_judge_row(span, piece, k, reach, 1);
        ++*turned;
    }
    return *turned ? worst : mechc_judge_row(span, piece, before->rank - 1, reach, 0);
}

/* Follow the step's nodes: 1 where `out` says that the step cannot stand.  A direction that turned
 * over at a near miss has leapt over it; a step over several crossings is to end between the first
 * two. */
MECHC_STATIC int mechc_follow_nodes(const mechc_span *span, const mechc_monitor *monitor,
                                    double reach, mechc_decision *out)
{
    const double *fraction = span->path->fraction;
    mechc_weakest places[2];
    int crossed = 0, turned;
    mechc_weakest_at(span->t, span->path->q[0], span, monitor->rank, &places[0]);
    for (int i = 1; i < span->path->count && !mechc_scalar_stopped(span->given); i++) {
        const mechc_piece piece = {i, {&places[(i - 1) % 2], &places[i % 2]}};
        mechc_weakest_at(span->t + fraction[i] * span->h, span->path->q[i], span, monitor->rank,
                         &places[i % 2]);
        switch (mechc_judge_piece(span, &piece, reach, &turned)) {
        case MECHC_TOO_CLOSE_TO_CALL:
            out->action = MECHC_CANNOT_TELL;
            return 1;
        case MECHC_NEAR_MISS:
            mechc_retry(out, turned ? 0.3 : 0.5, 0);
            return 1;
        case MECHC_CROSSING:
            break;
        }
        if (turned && crossed && i > crossed + 1 && monitor->tries < 16) {
            mechc_retry(out, 0.5 * (fraction[crossed] + fraction[i - 1]), span->bridge);
            return 1;
        }
        if (turned && !crossed) crossed = i;
    }
    return 0;
}

#endif
