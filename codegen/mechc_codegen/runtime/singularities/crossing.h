/* The judgement of a step near a critical configuration.
 *
 * Of a step with a poor conditioning three questions are asked: did the weakest direction change
 * its sign, did the configuration pass q*, and is q* a change point.  Through a change point the
 * motion goes straight, and the first two answers are the same.  At a near miss it is deflected,
 * and the sign never changes.  Otherwise the step has reached another branch, and it is rejected.
 *
 * The node that is nearest to a change point decides how much the rounding of the closure is
 * magnified (as its distance to the power -3).  So the step is chosen such that the crossing lies
 * in the middle of the widest gap between the nodes, and no accepted state is near it.
 */
#pragma once

#include "dynamics/project.h"
#include "singularities/branch.h"
#include "singularities/turned_rows.h"

/* Middle of the widest gap between the nodes of the explicit pair of order 8. */
#define MECHC_PAIR_GAP 0.4667

/* The same where the gap cannot be distinguished from rounding. */
#define MECHC_LOST 1e-5

/* Of a step, in which the place nearest to a crossing is looked for, and how sharply it is told. */
#define MECHC_LOOKS 32
#define MECHC_PLACED 1e-3
/* Times the conditioning, in radians: farther away is no configuration that makes it so small. */
#define MECHC_BESIDE 30.0
/* Fractions of a step: crossings that it is aimed at, */
#define MECHC_AIM_FROM 0.1
#define MECHC_AIM_TO 1.3
/* those beyond its start whose place is known, and that the pair bridges, */
#define MECHC_KNOWN_FROM 0.02
#define MECHC_BRIDGED_FROM 0.05
/* those at its end, and as far before the horizon, */
#define MECHC_AT_END 0.1
/* a plan that is worth a new step, and the next crossing's time ahead after one that was bridged. */
#define MECHC_WORTH_A_STEP 0.9
#define MECHC_PATIENCE 0.7
/* Factors that are tried one after the other where shrinking alone would only approach a crossing. */
#define MECHC_OTHER_STEPS 0.7, 1.3, 0.45, 0.8, 0.3, 0.6, 1.7, 0.2

#if MECHC_NH_MAX > 0
/* Square of the distance to q* at the fraction s of the step: on the cubic through both ends, and
 * past the end on the parabola from there. */
MECHC_STATIC double mechc_distance(const mechc_span *span, const mechc_critical *c, double s)
{
    double square = 0.0;
    const double r = 1.0 - s;
    for (int i = 0; i < MECHC_NQ; i++) {
        const double a = span->start[i] - c->q[i], b = span->end[i] - c->q[i];
        const double da = span->h * span->start_rates[i], db = span->h * span->end_rates[i];
        const double dda =
            MECHC_IDENTITY_KINEMATICS ? span->h * span->h * span->end_rates[MECHC_NQ + i] : 0.0;
        const double at = s > 1.0 ? b - r * (db - 0.5 * r * dda)
                        : a * r * r * (1.0 + 2.0 * s) + b * s * s * (3.0 - 2.0 * s)
                            + s * r * (da * r - db * s);
        square += mechc_weight(span->given, c, i) * at * at;
    }
    return square;
}

/* The fraction of the step, from a little before it to the horizon, that is nearest to q*. */
MECHC_STATIC double mechc_nearest(const mechc_span *span, const mechc_critical *c)
{
    const int first = -MECHC_LOOKS / 4, last = (int)(MECHC_LOOKS * span->horizon);
    double best = 0.0, least = HUGE_VAL;
    for (int i = first; i <= last; i++) {
        const double square = mechc_distance(span, c, (double)i / MECHC_LOOKS);
        if (square < least) least = square, best = (double)i / MECHC_LOOKS;
    }
    double left = best - 1.0 / MECHC_LOOKS, right = best + 1.0 / MECHC_LOOKS;
    while (right - left > MECHC_PLACED) {
        const double a = left + (right - left) / 3.0, b = right - (right - left) / 3.0;
        if (mechc_distance(span, c, a) < mechc_distance(span, c, b)) right = b;
        else left = a;
    }
    return 0.5 * (left + right);
}

/* Time until the motion, on a parabola from here, is nearest to q*; infinite where it recedes. */
MECHC_STATIC double mechc_time_to(const mechc_span *span, const mechc_critical *c)
{
    const double direction = span->h < 0.0 ? -1.0 : 1.0;
    double away = 0.0, square = 0.0, bend = 0.0;
    for (int i = 0; i < MECHC_NQ; i++) {
        const double weight = mechc_weight(span->given, c, i), rate = direction * span->start_rates[i];
        away += weight * (c->q[i] - span->start[i]) * rate;
        square += weight * rate * rate;
        if (MECHC_IDENTITY_KINEMATICS) bend += 0.5 * weight * span->start_rates[MECHC_NQ + i] * rate;
    }
    if (!(away > 0.0 && square > 0.0)) return HUGE_VAL;
    const double discriminant = square * square + 4.0 * bend * away;
    return discriminant > 0.0 ? 2.0 * away / (square + sqrt(discriminant)) : HUGE_VAL;
}

/* Is q* between the two ends, along the velocity of the faster one? */
MECHC_STATIC int mechc_lies_between(const mechc_span *span, const mechc_critical *c)
{
    double before = 0.0, after = 0.0, slow = 0.0, fast = 0.0;
    for (int i = 0; i < MECHC_NQ; i++) {
        slow += mechc_weight(span->given, c, i) * mechc_squared(span->start_rates[i]);
        fast += mechc_weight(span->given, c, i) * mechc_squared(span->end_rates[i]);
    }
    const double *along = fast > slow ? span->end_rates : span->start_rates;
    for (int i = 0; i < MECHC_NQ; i++) {
        before += mechc_weight(span->given, c, i) * (span->start[i] - c->q[i]) * along[i];
        after += mechc_weight(span->given, c, i) * (span->end[i] - c->q[i]) * along[i];
    }
    return before * after < 0.0;
}

/* An upper bound of the step's length in mass-weighted coordinates. */
MECHC_STATIC double mechc_reach(const mechc_span *span, const mechc_scalar_place *place)
{
    double square = 0.0, moved[MECHC_NU_MAX];
    mechc_scalar_moved_masses(place->mass, place->length, moved);
    for (int j = 0; j < MECHC_NU; j++) {
        const double start = fabs(span->start[MECHC_NQ + j]), end = fabs(span->end[MECHC_NQ + j]);
        const double gained = fabs(span->h * span->start_rates[MECHC_NQ + j]);
        square += moved[j] * mechc_squared(mechc_max(mechc_max(start, end), gained));
    }
    return fabs(span->h) * sqrt(square);
}

/* How far away, in mass-weighted coordinates, the critical configuration may be that makes the
 * conditioning so small. */
MECHC_STATIC double mechc_beside(const mechc_weakest *weakest, const mechc_scalar_place *place)
{
    double heaviest = 0.0;
    for (int j = 0; j < MECHC_NU; j++)
        heaviest = mechc_max(heaviest, place->mass[j * MECHC_NU + j]
                                           * mechc_squared(mechc_scalar_unit_of(place, MECHC_NQ + j)));
    return weakest->ratio < MECHC_NARROW ? MECHC_BESIDE * weakest->ratio * sqrt(heaviest) : 0.0;
}

/* The factor of the step that puts a crossing, now at its fraction s, into the widest gap between
 * the nodes of this step or of the next one; 1 where the step needs no change. */
MECHC_STATIC double mechc_aim(const mechc_span *span, double s)
{
    if (s < MECHC_AIM_FROM || s > MECHC_AIM_TO) return 1.0;
    if (s >= span->low && s <= span->high) return 1.0;
    if (s < MECHC_AIM_TO * span->best) return s / span->best;
    return s - span->best;
}

/* Replace a step that ends too near a crossing, and would only approach it when shortened, by a
 * longer one that has the crossing in the explicit pair's widest gap.  1 where there is one. */
MECHC_STATIC int mechc_straddle(const mechc_span *span, const mechc_critical *c,
                                mechc_decision *out)
{
    const double step = mechc_time_to(span, c) / MECHC_PAIR_GAP;
    if (!(step > fabs(span->h) && step < HUGE_VAL)) return 0;
    mechc_retry(out, step / fabs(span->h), 1);
    out->to_pair = 1;
    return 1;
}

/* Of the time to the run's end, the part that may lie between it and a crossing where collocation is
 * to end the run, and the conditioning expected there. */
#define MECHC_END_BESIDE 0.05
#define MECHC_END_NEAR (10.0 * MECHC_TOO_NEAR)

/* Whether the run ends so near a crossing that a method which takes rates at its end is of no use. */
MECHC_STATIC int mechc_ends_beside(const mechc_span *span, const mechc_critical *c, double ratio)
{
    const double ahead = mechc_time_to(span, c), apart = fabs(span->left - ahead);
    return apart <= MECHC_END_BESIDE * span->left && apart * ratio <= MECHC_END_NEAR * ahead;
}

MECHC_STATIC void mechc_examine_crossing(const mechc_span *span, mechc_monitor *monitor,
                                         const mechc_critical *critical, int between, int turned,
                                         int too_near, mechc_decision *out)
{
    static const double factors[] = {MECHC_OTHER_STEPS};
    if (turned != between || too_near) {
        monitor->ahead = HUGE_VAL;
        if (monitor->tries >= 24) mechc_give_up(out, MECHC_NO_STEP_FITS, critical->gap);
        else if (turned != between || monitor->tries % 4 != 2
                 || !mechc_straddle(span, critical, out))
            mechc_retry(out, factors[monitor->tries % 8], 0);
        return;
    }
    if (span->looks_ahead) {
        const int known = out->fraction > MECHC_KNOWN_FROM && out->fraction < span->horizon - MECHC_AT_END;
        monitor->ahead = known ? out->fraction * fabs(span->h) : HUGE_VAL;
        const double planned = mechc_plan(span->nodes, monitor->ahead, fabs(span->h));
        const int at_end = fabs(out->fraction - 1.0) < MECHC_AT_END;
        if (planned < MECHC_WORTH_A_STEP * fabs(span->h) && monitor->tries < 4 && !(span->last && at_end)) {
            mechc_retry(out, 1.0, 1);
        } else if (at_end && !span->last && monitor->tries < 16) {
            monitor->ahead = HUGE_VAL;
            mechc_retry(out, factors[monitor->tries % 8], 0);
        } else if (turned) {
            out->action = MECHC_CROSSES;
        }
        return;
    }
    if (!span->bridge) {
        const double ahead = out->fraction * fabs(span->h);
        if (out->fraction > MECHC_BRIDGED_FROM && out->fraction < span->horizon - MECHC_AT_END
            && ahead <= monitor->patience) {
            monitor->patience = MECHC_PATIENCE * ahead;
            monitor->wanted = fabs(span->h);
            mechc_retry(out, out->fraction / span->best, 1);
            return;
        }
    }
    const double factor = monitor->tries < 4 ? mechc_aim(span, out->fraction) : 1.0;
    if (factor < 1.0 && !monitor->wanted) monitor->wanted = fabs(span->h);
    if (factor != 1.0) mechc_retry(out, factor, span->bridge);
    else if (turned) out->action = MECHC_CROSSES;
}

/* Whether the step ends a run by collocation, which takes no rates at its end. */
MECHC_STATIC int mechc_ends_run(const mechc_span *span)
{
    return span->last && span->looks_ahead;
}

/* Find the critical configuration near q: the last one found, if it is in this step too. at: the
 * weak directions at q; NULL: not known yet. */
MECHC_STATIC int mechc_find_near(const mechc_span *span, const double *q, const mechc_weakest *at,
                                 mechc_monitor *monitor, double reach, mechc_critical *c)
{
    mechc_weakest here;
    if (monitor->has_known && !monitor->tries
        && mechc_still_critical(span->t, q, span->given, reach, &monitor->known, c)) return 1;
    if (!at) mechc_weakest_at(span->t, q, span->given, monitor->rank, &here);
    if (!mechc_find_critical(span->t, q, span->given, at ? at : &here, reach, c)) return 0;
    monitor->known = *c;
    monitor->has_known = 1;
    return 1;
}

#if MECHC_NH_MAX > 2
/* Row i's part in the span of the weak directions, as a unit vector; 0 where it has none.  Directions
 * of several loops mix in the singular vectors, but each loop's normal has parts in its own rows. */
MECHC_STATIC int mechc_weak_part(const mechc_weakest *at, int i, double *normal)
{
    double square = 0.0;
    for (int j = 0; j < MECHC_NH; j++) normal[j] = 0.0;
    for (int k = at->rank - 1; k >= 0 && at->values[k] <= MECHC_CLEAR * at->largest; k--) {
        const double *left = at->basis + k * MECHC_NH;
        for (int j = 0; j < MECHC_NH; j++) normal[j] += left[i] * left[j];
        square += left[i] * left[i];
    }
    for (int j = 0; j < MECHC_NH; j++) normal[j] /= sqrt(square);
    return square > 0.0;
}

/* Examine what a step passed besides the weakest direction's near miss.  Loops beside each other
 * may be critical together: one bends at its near miss while another passes its change point. */
MECHC_ONCE void mechc_examine_others(const mechc_span *span, mechc_monitor *monitor, double reach,
                                     mechc_decision *out)
{
    double normal[MECHC_NH_MAX];
    mechc_weakest at;
    mechc_critical found;
    mechc_weakest_at(span->t, monitor->q, span->given, monitor->rank, &at);
    if (at.rank < 2 || at.values[at.rank - 2] > MECHC_CLEAR * at.largest) return;
    for (int i = 0; i < MECHC_NH && !mechc_scalar_stopped(span->given); i++) {
        if (!mechc_weak_part(&at, i, normal)
            || !mechc_find_critical_of(span->t, monitor->q, span->given, &at, normal, reach, &found)
            || !mechc_is_critical(span, span->t, &found) || !found.curves) continue;
        const int crossing = mechc_judge(&found) == MECHC_CROSSING;
        const int between = crossing && mechc_lies_between(span, &found);
        const int aside = mechc_changes_branch(span, &found);
        if (!between && !aside) continue;
        memcpy(out->q, found.q, MECHC_NQ * sizeof *out->q);
        out->gap = found.gap;
        out->fraction = mechc_nearest(span, &found);
        mechc_examine_crossing(span, monitor, &found, between, aside ? !between : between, 0, out);
        return;
    }
}
#endif

/* Judge a step with a poor conditioning. */
MECHC_ONCE void mechc_examine(const mechc_span *span, mechc_monitor *monitor, mechc_decision *out)
{
    mechc_weakest before, after;
    mechc_critical critical;
    mechc_scalar_place place;
    out->action = MECHC_STANDS;
    mechc_scalar_locate_all(span->t, span->start, span->given, &place);
    mechc_find_weakest(place.jacobian, place.mass, place.length, place.ordinary_length, 0, &before);
    if (before.rank > monitor->rank) monitor->rank = before.rank;
    if (before.rank < monitor->rank)
        mechc_weakest_at(span->t, span->start, span->given, monitor->rank, &before);
    mechc_weakest_at(span->t + span->h, span->end, span->given, monitor->rank, &after);
    int turned = mechc_turned_over(&before, &after);
    const double reach =
        mechc_max(span->horizon * mechc_reach(span, &place), mechc_beside(&after, &place));
    if (mechc_follow_nodes(span, monitor, reach, out)) return;
    if (mechc_scalar_stopped(span->given)) return;
    const int knew = mechc_knows_crossing(monitor);
    if (!mechc_find_near(span, monitor->q, 0, monitor, reach, &critical)) {
        if (turned != 1) return;
        if (monitor->tries >= 24) mechc_give_up(out, MECHC_BRANCH_IN_DOUBT, HUGE_VAL);
        else mechc_retry(out, 0.5, 0);
        return;
    }
    if (!critical.curves) return;
    const int between = mechc_lies_between(span, &critical);
    if (mechc_has_no_sign(span, &before, &after)) turned = between;
    memcpy(out->q, critical.q, MECHC_NQ * sizeof *out->q);
    out->gap = critical.gap;
    out->fraction = mechc_nearest(span, &critical);
    switch (mechc_judge(&critical)) {
    case MECHC_CROSSING:
        if (monitor->at_critical && span->first) { /* the start's side is rounding */
            if (mechc_changes_branch(span, &critical)) mechc_retry(out, MECHC_ASTRAY, 0);
            break;
        }
        if (!span->looks_ahead && monitor->tries < 8
            && mechc_ends_beside(span, &critical, before.ratio)) {
            mechc_retry(out, span->left / fabs(span->h), 0);
            out->to_collocation = 1;
            break;
        }
        if (!knew && after.ratio < MECHC_TOO_NEAR && mechc_ends_run(span)) {
            mechc_retry(out, 1.0, 0); /* the speeds of this end were decided by rounding */
            break;
        }
        mechc_examine_crossing(span, monitor, &critical, between, turned,
                               after.ratio < MECHC_TOO_NEAR && !mechc_ends_run(span), out);
        break;
    case MECHC_TOO_CLOSE_TO_CALL:
        if (between || turned || after.ratio < MECHC_LOST)
            mechc_give_up(out, MECHC_UNDECIDED, critical.gap);
        break;
    default:
        if (turned) mechc_retry(out, turned > 0 ? MECHC_ASTRAY : 0.5, 0);
        else if (mechc_changes_branch(span, &critical)) mechc_retry(out, MECHC_ASTRAY, 0);
#if MECHC_NH_MAX > 2
        else if (MECHC_NH > 2) mechc_examine_others(span, monitor, reach, out);
#endif
        break;
    }
}
#endif
