/* Weak directions that changed their sign within a step, followed from node to node.
 *
 * The step's ends alone cannot show it: a step over two near misses changes the sign twice, and
 * besides the weakest row a second one may change its own.  So every direction whose singular value
 * is below the clear level is followed with its sign over all nodes of the step.
 */
#pragma once

#include "singularities/monitor.h"
#include "singularities/span.h"

#if MECHC_NH_MAX > 0

/* Conditioning below which rounding decides about the sign of the weakest direction. */
#define MECHC_NO_SIGN 1e-6

/* A run may start and end so near a crossing; whether one was passed is then told by the place of q*
 * alone. */
MECHC_STATIC int mechc_has_no_sign(const mechc_span *span, const mechc_weakest *before,
                                   const mechc_weakest *after)
{
    return (span->first && before->ratio < MECHC_NO_SIGN)
        || (span->last && after->ratio < MECHC_NO_SIGN);
}

/* A configuration of a step, its rows, and the results computed for it so far. */
typedef struct {
    double fraction, q[MECHC_NQ_MAX];
    int open; /* off the manifold: from there another sheet is near, unseen */
    double rows[MECHC_NH_MAX * MECHC_NU_MAX], ordinary; /* weighted; see mechc_decompose */
    int decomposed;
    mechc_weakest weakest;
#if MECHC_NH_MAX > 2
    int inverted; /* -1: rows have no inverse to speak of */
    double inverse[MECHC_NH_MAX * MECHC_NU_MAX]; /* right inverse of the rows, transposed */
#endif
} mechc_seen;

/* Compute the rows at out->q. */
MECHC_STATIC void mechc_see(const mechc_span *span, mechc_seen *out)
{
    mechc_scalar_place place;
    mechc_scalar_locate_all(span->t + out->fraction * span->h, out->q, span->given, &place);
    mechc_weigh_rows(place.jacobian, place.mass, place.length, out->rows);
    out->ordinary = place.ordinary_length;
    out->decomposed = 0;
#if MECHC_NH_MAX > 2
    out->inverted = 0;
#endif
}

/* Compute its weak directions. */
MECHC_STATIC const mechc_weakest *mechc_weakest_seen(int rank, mechc_seen *seen)
{
    double a[MECHC_NH_MAX * MECHC_NU_MAX];
    if (seen->decomposed) return &seen->weakest;
    memcpy(a, seen->rows, MECHC_NH * MECHC_NU * sizeof *a);
    mechc_decompose(a, seen->ordinary, rank, &seen->weakest);
    seen->decomposed = 1;
    return &seen->weakest;
}

MECHC_STATIC int mechc_surely_turned(const mechc_weakest *before, const mechc_weakest *after, int k)
{
#if MECHC_NH_MAX > 2
    if (MECHC_NH > 2) return mechc_followed(before, after, k) < -MECHC_SURE * after->values[k];
#endif
    return k == before->rank - 1 && mechc_turned_over(before, after) == 1;
}

#if MECHC_NH_MAX > 2
/* u_i . J v_j of the rows after for all weak vectors before, from the row `first` on. */
MECHC_STATIC void mechc_followed_all(const mechc_weakest *before, const mechc_weakest *after,
                                     int first, double *b)
{
    const int weak = before->rank - first;
    double left[MECHC_NH_MAX * MECHC_NH_MAX], right[MECHC_NH_MAX * MECHC_NH_MAX];
    for (int k = 0; k < weak; k++)
        for (int i = 0; i < MECHC_NH; i++) {
            const double *u = before->basis + (first + k) * MECHC_NH;
            const double *v = before->rows + (first + k) * MECHC_NU;
            left[k * MECHC_NH + i] = mechc_dot(u, after->basis + i * MECHC_NH, MECHC_NH);
            right[k * MECHC_NH + i] = mechc_dot(v, after->rows + i * MECHC_NU, MECHC_NU)
                                    / mechc_max(before->values[first + k], DBL_MIN);
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

/* True only where none of several weak directions changed its sign, however they mixed. */
MECHC_STATIC int mechc_all_surely_kept(const mechc_weakest *before, const mechc_weakest *after)
{
    double b[MECHC_NH_MAX * MECHC_NH_MAX];
    int first = before->rank - 1;
    while (first > 0 && before->values[first - 1] <= MECHC_CLEAR * before->largest) first--;
    if (before->values[first] > MECHC_CLEAR * before->largest) return 1;
    mechc_followed_all(before, after, first, b);
    return mechc_is_positive(b, before->rank - first);
}
#endif

MECHC_STATIC int mechc_surely_kept(const mechc_weakest *before, const mechc_weakest *after)
{
#if MECHC_NH_MAX > 2
    if (MECHC_NH > 2) return mechc_all_surely_kept(before, after);
#endif
    return mechc_turned_over(before, after) == 0;
}

/* The gap besides that along its normal that a critical configuration may have, in units of
 * rounding: a larger one is the gap of another row. */
#define MECHC_CLOSED_BESIDE 4.0

/* How often a step is shortened whose weak directions cannot be followed with certainty. */
#define MECHC_DOUBTS 16

/* How often a piece between two nodes is halved. */
#define MECHC_HALVINGS 3

/* Whether a configuration is critical, with every gap closed but the one along its normal. */
MECHC_STATIC int mechc_is_critical(const mechc_span *span, double t, const mechc_critical *c)
{
    mechc_scalar_place place;
    double rounding;
    mechc_scalar_locate_all(t, c->q, span->given, &place);
    mechc_scalar_gap(&place, c->q, &rounding);
    for (int i = 0; i < MECHC_NH; i++)
        if (!(fabs(place.gap[i] - c->gap * c->normal[i]) <= MECHC_CLOSED_BESIDE * rounding))
            return 0;
    return 1;
}

/* Findings between two nodes: directions that certainly changed their sign, and the last gap
 * judged. */
typedef struct {
    int turned;
    double gap;
} mechc_tally;

/* Judge what direction k passed there, from the node at which it is weaker.  If it changed its sign
 * and no critical configuration explains that, the step is too long to follow the motion. */
MECHC_STATIC mechc_verdict mechc_judge_row(const mechc_span *span, const mechc_seen *before,
                                           const mechc_seen *after, int k, double reach, int surely,
                                           mechc_tally *tally)
{
    const int first = before->weakest.values[k] <= after->weakest.values[k];
    const mechc_seen *node = first ? before : after;
    const double t = span->t + node->fraction * span->h;
    mechc_critical found;
    const int is_one =
        mechc_find_critical_of(t, node->q, span->given, &node->weakest,
                               node->weakest.basis + k * MECHC_NH, reach, &found)
        && mechc_is_critical(span, t, &found);
    if (is_one && !found.curves) return MECHC_CROSSING;
    if (is_one) tally->gap = found.gap;
    return is_one ? mechc_judge(&found) : surely ? MECHC_NEAR_MISS : MECHC_UNKNOWN;
}

/* The worst case among the weak directions between two nodes. */
MECHC_STATIC mechc_verdict mechc_judge_piece(const mechc_span *span, const mechc_seen *before,
                                             const mechc_seen *after, double reach,
                                             mechc_tally *tally)
{
    const mechc_weakest *from = &before->weakest, *to = &after->weakest;
    int first = from->rank, turned_here = 0;
    if (!before->open && !after->open && mechc_surely_kept(from, to)) return MECHC_CROSSING;
    while (first > 0 && from->values[first - 1] <= MECHC_CLEAR * from->largest) first--;
    for (int k = from->rank - 1; k >= first; k--) {
        if (!mechc_surely_turned(from, to, k)) continue;
        const mechc_verdict found = mechc_judge_row(span, before, after, k, reach, 1, tally);
        turned_here++;
        tally->turned++;
        if (found != MECHC_CROSSING) return found;
    }
    for (int k = from->rank - 1; k >= first && !turned_here; k--) {
        const mechc_verdict found = mechc_judge_row(span, before, after, k, reach, 0, tally);
        if (found != MECHC_UNKNOWN) return found;
    }
    return turned_here ? MECHC_CROSSING : MECHC_UNKNOWN;
}

#if MECHC_NH_MAX > 2
/* P with A P = 1, transposed, by A = L Q: P = Q^T L^-1.  -1 where a row is nearly in the span of those
 * before it, else 1. */
MECHC_ONCE int mechc_invert_rows(const double *rows, double *inverse)
{
    double lower[MECHC_NH_MAX * MECHC_NH_MAX], longest = 0.0;
    memcpy(inverse, rows, MECHC_NH * MECHC_NU * sizeof *inverse);
    for (int i = 0; i < MECHC_NH; i++) {
        double *row = inverse + i * MECHC_NU;
        longest = mechc_max(longest, sqrt(mechc_dot(row, row, MECHC_NU)));
        for (int k = 0; k < i; k++) {
            const double *before = inverse + k * MECHC_NU;
            const double part = mechc_dot(row, before, MECHC_NU);
            for (int j = 0; j < MECHC_NU; j++) row[j] -= part * before[j];
            lower[i * MECHC_NH + k] = part;
        }
        const double norm = sqrt(mechc_dot(row, row, MECHC_NU));
        if (!(norm > MECHC_NO_SIGN * longest)) return -1;
        for (int j = 0; j < MECHC_NU; j++) row[j] /= norm;
        lower[i * MECHC_NH + i] = norm;
    }
    for (int i = MECHC_NH - 1; i >= 0; i--) {
        double *row = inverse + i * MECHC_NU;
        for (int k = i + 1; k < MECHC_NH; k++)
            for (int j = 0; j < MECHC_NU; j++)
                row[j] -= lower[k * MECHC_NH + i] * inverse[k * MECHC_NU + j];
        for (int j = 0; j < MECHC_NU; j++) row[j] /= lower[i * MECHC_NH + i];
    }
    return 1;
}

/* |(B - A) P| < 1 for the rows A and B of two configurations, in a bound of the spectral norm:
 * |E|^4 is at most the sum of squares of E E^T. */
MECHC_ONCE int mechc_is_within(const mechc_seen *a, const mechc_seen *b)
{
    double e[MECHC_NH_MAX * MECHC_NH_MAX], change[MECHC_NU_MAX], square = 0.0, fourth = 0.0;
    for (int i = 0; i < MECHC_NH; i++) {
        for (int j = 0; j < MECHC_NU; j++)
            change[j] = b->rows[i * MECHC_NU + j] - a->rows[i * MECHC_NU + j];
        for (int k = 0; k < MECHC_NH; k++)
            e[i * MECHC_NH + k] = mechc_dot(change, a->inverse + k * MECHC_NU, MECHC_NU);
        square += mechc_dot(e + i * MECHC_NH, e + i * MECHC_NH, MECHC_NH);
    }
    if (square < 1.0 || !(square < MECHC_NH)) return square < 1.0;
    for (int i = 0; i < MECHC_NH; i++)
        for (int k = 0; k <= i; k++) {
            const double product = mechc_dot(e + i * MECHC_NH, e + k * MECHC_NH, MECHC_NH);
            fourth += (k < i ? 2.0 : 1.0) * product * product;
        }
    return fourth < 1.0;
}

MECHC_STATIC int mechc_reaches(mechc_seen *a, const mechc_seen *b)
{
    if (a->inverted == 0) a->inverted = mechc_invert_rows(a->rows, a->inverse);
    return a->inverted > 0 && mechc_is_within(a, b);
}
#endif

/* Certainly no direction changed its sign between two configurations, and none twice.
 *
 * With A P = 1 every B with |(B - A) P| < 1 has full rank (Neumann's series), so all rows between A
 * and B have.  In this norm a way from A to rows of less rank is no shorter than 1, and from there to
 * B no shorter than 1 - |(B - A) P|: together they are longer than the way from A to B.  Unlike
 * singular values, which ask for every row's change, it says nothing of a change along strong rows,
 * and needs a factorisation alone. */
MECHC_STATIC int mechc_stays_regular(int rank, mechc_seen *a, mechc_seen *b)
{
#if MECHC_NH_MAX > 2
    if (MECHC_NH <= 2 || rank < MECHC_NH || a->open || b->open) return 0;
    return mechc_reaches(a, b) || mechc_reaches(b, a);
#else
    (void)rank, (void)a, (void)b;
    return 0;
#endif
}

#if MECHC_NH_MAX > 2
/* Could a direction have changed its sign twice between two configurations?  Singular values change
 * no more than the rows do: Weyl (1912). */
MECHC_STATIC int mechc_may_hide(const mechc_seen *before, const mechc_seen *after)
{
    const int last = before->weakest.rank - 1;
    double square = 0.0;
    for (int i = 0; i < MECHC_NH * MECHC_NU; i++) {
        const double change = after->rows[i] - before->rows[i];
        square += change * change;
    }
    return sqrt(square) > before->weakest.values[last] + after->weakest.values[last];
}

/* A configuration after node i - 1, on the cubic through the four nodes around it, its loops closed
 * where they can be. */
MECHC_STATIC void mechc_see_between(const mechc_span *span, int i, double fraction,
                                    mechc_seen *out)
{
    const mechc_path *path = span->path;
    const int first = i < 2 ? 0 : i > path->count - 2 ? path->count - 4 : i - 2;
    double closed[MECHC_NQ_MAX] = {0};
    long unused = 0;
    mechc_scalar_place place;
    for (int j = first; j < first + 4; j++) {
        double weight = 1.0;
        for (int k = first; k < first + 4; k++)
            if (k != j)
                weight *= (fraction - path->fraction[k]) / (path->fraction[j] - path->fraction[k]);
        for (int c = 0; c < MECHC_NQ; c++) closed[c] += weight * path->q[j][c];
    }
    const double t = span->t + fraction * span->h;
    out->fraction = fraction;
    memcpy(out->q, closed, MECHC_NQ * sizeof *closed);
    out->open = mechc_close_loops(t, closed, span->given, &place, &unused) != MECHC_RUNNING;
    if (!out->open) memcpy(out->q, closed, MECHC_NQ * sizeof *closed);
    mechc_see(span, out);
}
#endif

/* Judge a piece between two nodes; it is halved where a direction may have changed its sign twice. */
MECHC_STATIC mechc_verdict mechc_judge_halves(const mechc_span *span, int rank,
                                              mechc_seen *before, mechc_seen *after, int i,
                                              int halvings, double reach, mechc_tally *tally)
{
    if (mechc_stays_regular(rank, before, after)) return MECHC_CROSSING;
    mechc_weakest_seen(rank, before);
    mechc_weakest_seen(rank, after);
#if MECHC_NH_MAX > 2
    if (MECHC_NH > 2 && halvings > 0 && mechc_may_hide(before, after)) {
        mechc_seen middle;
        mechc_see_between(span, i, 0.5 * (before->fraction + after->fraction), &middle);
        const mechc_verdict found =
            mechc_judge_halves(span, rank, before, &middle, i, halvings - 1, reach, tally);
        if (found != MECHC_CROSSING) return found;
        return mechc_judge_halves(span, rank, &middle, after, i, halvings - 1, reach, tally);
    }
#else
    (void)i, (void)halvings;
#endif
    return mechc_judge_piece(span, before, after, reach, tally);
}

/* Add a node of the step. */
MECHC_STATIC void mechc_see_node(const mechc_span *span, int i, mechc_seen *out)
{
    out->fraction = span->path->fraction[i];
    memcpy(out->q, span->path->q[i], MECHC_NQ * sizeof *out->q);
    out->open = span->path->open[i];
    mechc_see(span, out);
}

/* Is the sign of a piece at the run's start or end decided by rounding? */
MECHC_STATIC int mechc_sign_is_lost(const mechc_span *span, int i, int rank, mechc_seen *before,
                                    mechc_seen *after)
{
    if (!(span->first && i == 1) && !(span->last && i == span->path->count - 1)) return 0;
    return mechc_has_no_sign(span, mechc_weakest_seen(rank, before), mechc_weakest_seen(rank, after));
}

/* Follow the step's nodes: 1 where `out` rejects the step.  A change of sign at a near miss means
 * that the step jumped to the other curve; a step over several crossings is shortened to end
 * between the first two. */
MECHC_STATIC int mechc_follow_nodes(const mechc_span *span, const mechc_monitor *monitor,
                                    double reach, mechc_decision *out)
{
    const double *fraction = span->path->fraction;
    mechc_seen nodes[2];
    const int rank = monitor->rank;
    int crossed = 0;
    mechc_see_node(span, 0, &nodes[0]);
    for (int i = 1; i < span->path->count && !mechc_scalar_stopped(span->given); i++) {
        mechc_tally tally = {0, HUGE_VAL};
        mechc_seen *before = &nodes[(i - 1) % 2], *after = &nodes[i % 2];
        mechc_see_node(span, i, after);
        if (mechc_sign_is_lost(span, i, rank, before, after)) continue;
        switch (mechc_judge_halves(span, rank, before, after, i, MECHC_HALVINGS, reach, &tally)) {
        case MECHC_TOO_CLOSE_TO_CALL:
            mechc_give_up(out, MECHC_UNDECIDED, tally.gap);
            return 1;
        case MECHC_NEAR_MISS:
            mechc_retry(out, tally.turned ? MECHC_ASTRAY : 0.5, 0);
            return 1;
        case MECHC_UNKNOWN:
            if (monitor->tries >= MECHC_DOUBTS)
                mechc_give_up(out, MECHC_BRANCH_IN_DOUBT, HUGE_VAL);
            else mechc_retry(out, 0.5, 0);
            return 1;
        case MECHC_CROSSING:
            break;
        }
        if (tally.turned && crossed && i > crossed + 1 && monitor->tries < 16) {
            mechc_retry(out, 0.5 * (fraction[crossed] + fraction[i - 1]), span->bridge);
            return 1;
        }
        if (tally.turned && !crossed) crossed = i;
    }
    return 0;
}

#endif
