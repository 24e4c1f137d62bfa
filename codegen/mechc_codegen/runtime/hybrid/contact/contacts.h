/* The contacts of one motion: at an instant at which they change, the impacts and the next mode. */
#pragma once

#include "hybrid/contact/ends.h"
#include "hybrid/contact/impacts.h"
#include "hybrid/events/resets.h"

#define MECHC_CONTACT_SLOW 1e-3   /* of rtol, of the fastest met: a gap, or a slip, whose rate is so small
                                     rests */
#define MECHC_CONTACT_FEW 4.0     /* times the shortest flight that is told from none */
#define MECHC_CONTACT_NEAR 1e-6   /* of the largest scale: a gap so small at the start is looked at */
#define MECHC_CONTACT_CHANGES 40  /* of the mode at one instant */
#define MECHC_RATE_ROUND (64.0 * DBL_EPSILON) /* of the terms of a rate */

typedef struct {
    mechc_contact_laws laws;
    mechc_motion *motion;
    mechc_watch *watch;
    mechc_contact_place place;
    mechc_answer answer;
    mechc_choices choices;
    mechc_ends ends;
    unsigned char *mode, *closed, *still, *leaving, *struck, *touching; /* of each contact */
    double *zero, *fastest_gap, *fastest_slip, *speeds_met, *sizes, *space;
    double changed_at;
    int changes;   /* of the mode at this instant */
    int why;       /* why computation failed: MECHC_NO_LAW, MECHC_NO_MASS, MECHC_PUSHES; 0 */
    int overlaps;  /* a contact whose gap is none; -1 */
    double overlap;
    long lowered;  /* impacts at which less than the whole restitution counted, */
    double lowered_at, lowered_to; /* the first of them, and what did */
} mechc_contacts;

/* The reason why contacts are examined: a gap that has closed, contacts that have come to rest,
 * states at their limits.  Contact -1: none. */
typedef struct {
    int hit, halted, left_by;
    unsigned left;
    int reset; /* the state is not the one that the last mode has led to */
} mechc_contact_change;

MECHC_STATIC const mechc_contact_change mechc_no_change = {-1, -1, -1, 0, 0};

MECHC_STATIC void mechc_contacts_free(mechc_contacts *contacts)
{
    mechc_contact_free(&contacts->place);
    mechc_answer_free(&contacts->answer);
    mechc_choices_free(&contacts->choices);
    mechc_ends_free(&contacts->ends);
    free(contacts->mode);
    free(contacts->zero);
}

/* Allocate the memory; 0 without memory. */
MECHC_STATIC int mechc_contacts_make(mechc_contacts *contacts, mechc_motion *motion, mechc_watch *watch)
{
    const mechc_contact_laws *laws = &contacts->laws;
    const size_t n = (size_t)laws->count, nu = (size_t)motion->speeds;
    contacts->motion = motion;
    contacts->watch = watch;
    const mechc_part_of_room parts[] = {
        {&contacts->zero, n}, {&contacts->fastest_gap, n}, {&contacts->fastest_slip, n},
        {&contacts->speeds_met, nu}, {&contacts->sizes, (size_t)motion->width},
        {&contacts->space, n * (2 * nu + 14) + 3 * nu + n},
    };
    contacts->mode = calloc(6 * n + 1, 1);
    if (!contacts->mode || !MECHC_ROOM_FOR(parts)) return 0;
    contacts->closed = contacts->mode + n;
    contacts->still = contacts->closed + n;
    contacts->leaving = contacts->still + n;
    contacts->struck = contacts->leaving + n;
    contacts->touching = contacts->struck + n;
    motion->contacts = contacts;
    return mechc_contact_make(&contacts->place, motion, laws)
        && mechc_answer_make(&contacts->answer, laws->count, motion->speeds)
        && mechc_choices_make(&contacts->choices, laws->count)
        && mechc_ends_make(&contacts->ends, &contacts->place, &contacts->answer);
}

/* Begin a motion. */
MECHC_STATIC void mechc_contacts_begin(mechc_contacts *contacts)
{
    const size_t n = (size_t)contacts->laws.count;
    memset(contacts->mode, 0, 6 * n);
    memset(contacts->fastest_gap, 0, n * sizeof(double));
    memset(contacts->fastest_slip, 0, n * sizeof(double));
    memset(contacts->speeds_met, 0, (size_t)contacts->motion->speeds * sizeof(double));
    contacts->changed_at = NAN;
    contacts->changes = 0;
    contacts->overlaps = -1;
    contacts->why = 0;
    contacts->lowered = 0;
}

MECHC_STATIC int mechc_contacts_last(const mechc_contacts *contacts)
{
    int last = 0;
    for (int k = 0; k < contacts->laws.count; k++) last |= contacts->mode[k] != MECHC_OPEN;
    return last;
}

/* -- the motion in a mode ---------------------------------------------------------------------- */

/* States of a piece in contact, on its constraints. */
MECHC_STATIC void mechc_contact_states(mechc_motion *motion, ptrdiff_t count, const double *t, double *y)
{
    mechc_contacts *contacts = motion->contacts;
    motion->unit->interpolate(0, motion->steps, motion->p, motion->inputs, count, t, y);
    for (ptrdiff_t i = 0; i < count; i++, y += motion->width) {
        const int status = mechc_contact_settle(&contacts->place, contacts->mode, t[i], y);
        if (status == MECHC_RUNNING) mechc_ends_keep(&contacts->ends);
        else for (int j = 0; j < motion->width; j++) y[j] = NAN;
    }
}

/* Rates in the mode, at the current place. */
MECHC_STATIC int mechc_contact_rates_at_hand(mechc_contacts *contacts, double *rates)
{
    mechc_contact_place *c = &contacts->place;
    const int status = mechc_ends_solve(&contacts->ends, mechc_forces_of);
    if (status != MECHC_RUNNING) return status;
    memcpy(rates, c->free, (size_t)contacts->motion->width * sizeof *rates);
    mechc_contact_change_speeds(c, contacts->answer.along, rates);
    return MECHC_RUNNING;
}

/* Rates of a state that is on the mode's constraints. */
MECHC_STATIC void mechc_contact_rates(const mechc_motion *motion, double t, const double *y, double *rates)
{
    mechc_contacts *contacts = motion->contacts;
    if (mechc_contact_at(&contacts->place, t, y) != MECHC_RUNNING
        || mechc_contact_rates_at_hand(contacts, rates) != MECHC_RUNNING)
        for (int i = 0; i < motion->width; i++) rates[i] = NAN;
}

/* Whether contacts last in the current piece. */
MECHC_STATIC int mechc_is_in_contact(const mechc_motion *motion)
{
    return motion->rates == mechc_contact_rates;
}

/* The generalized forces (nu) of the contacts at a state; NaN where there are none. */
MECHC_STATIC void mechc_contact_forces(mechc_contacts *contacts, double t, const double *y, double *forces)
{
    if (mechc_contact_at(&contacts->place, t, y) == MECHC_RUNNING
        && mechc_ends_solve(&contacts->ends, mechc_forces_of) == MECHC_RUNNING)
        mechc_generalized_forces(&contacts->place, &contacts->answer, forces);
    else
        for (int j = 0; j < contacts->motion->speeds; j++) forces[j] = NAN;
}

/* Rates at a stage of a method: the state is moved onto the mode's constraints first. */
MECHC_STATIC int mechc_contact_stage(void *owner, double t, double *y, double *rates)
{
    mechc_contacts *contacts = owner;
    int status = mechc_contact_settle(&contacts->place, contacts->mode, t, y);
    if (status == MECHC_RUNNING) status = mechc_contact_rates_at_hand(contacts, rates);
    return status == MECHC_NO_MASS ? MECHC_SINGULAR_MASS : status == MECHC_NO_LAW ? MECHC_NOT_FINITE : status;
}

/* Set the sizes of the speeds for step control at a start.  What contacts hold has only the size of
 * rounding, so sizes of the free state, and earlier ones, count. */
MECHC_STATIC void mechc_contact_sizes(mechc_contacts *contacts, const double *y)
{
    const mechc_motion *motion = contacts->motion;
    const int nq = motion->coordinates, nu = motion->speeds;
    double *given = contacts->space;
    memcpy(given, contacts->answer.given, (size_t)nu * sizeof *given);
    mechc_solve_upper(contacts->place.root, nu, given);
    for (int i = 0; i < nq; i++) contacts->sizes[i] = 0.0;
    for (int j = 0; j < nu; j++) {
        const double fastest = fabs(contacts->place.free[nq + j]) + fabs(given[j]);
        contacts->speeds_met[j] = fmax(contacts->speeds_met[j], fabs(y[nq + j]));
        contacts->sizes[nq + j] =
            fmax(contacts->speeds_met[j], sqrt(fastest * motion->scale[nq + j]));
    }
}

/* -- what touches, and what rests -------------------------------------------------------------- */

MECHC_STATIC int mechc_event_of(const mechc_contacts *contacts, int contact)
{
    return contacts->laws.event[contact];
}

/* Set the bounds below which gaps count as 0, given how exactly the motion is known. */
MECHC_STATIC void mechc_contact_zeros(mechc_contacts *contacts)
{
    const mechc_contact_place *c = &contacts->place;
    const mechc_motion *motion = contacts->motion;
    for (int k = 0; k < c->contacts; k++) {
        const double *slopes = mechc_law(c, k) + MECHC_LAWS;
        const double met = contacts->watch->event[mechc_event_of(contacts, k)].size;
        double allowed = 0.0;
        for (int i = 0; i < c->coordinates; i++)
            allowed += fabs(slopes[i]) * (motion->atol ? motion->atol[i] + motion->rtol * fabs(c->y[i])
                                                       : motion->rtol * motion->scale[i]);
        allowed = fmax(motion->rtol * met, allowed) + mechc_gap_rounding(c, k);
        contacts->zero[k] = MECHC_RESET_TOUCHING * allowed;
    }
}

/* Find the gaps that are closed at the current place. */
MECHC_STATIC void mechc_find_touching(mechc_contacts *contacts, int hit)
{
    mechc_contact_zeros(contacts);
    for (int k = 0; k < contacts->laws.count; k++) {
        const double gap = fabs(mechc_law(&contacts->place, k)[MECHC_GAP]);
        const int touches = gap <= contacts->zero[k] || k == hit || contacts->mode[k] != MECHC_OPEN;
        contacts->touching[k] = contacts->laws.has_gap[k] && touches;
    }
}

MECHC_STATIC double mechc_slow(const mechc_contacts *contacts, double fastest)
{
    return MECHC_CONTACT_SLOW * contacts->motion->rtol * fastest;
}

/* The rate below which a gap of 0 counts as resting: small beside the fastest rate met, or with a
 * next flight too short to be seen. */
MECHC_STATIC double mechc_slow_gap(const mechc_contacts *contacts, int contact)
{
    const mechc_contact_place *c = &contacts->place;
    const double fall = MECHC_CONTACT_FEW * fabs(c->opening[contact]);
    const double rounding = mechc_gap_rounding(c, contact);
    double terms = 0.0;
    for (int j = 0; j < c->speeds; j++)
        terms += fabs(mechc_gap_over_speed(c, contact, j) * c->y[c->coordinates + j]);
    const double flight = fmax(mechc_at_once(contacts->watch, c->t) * fall,
                               sqrt(0.5 * MECHC_RESET_FLIGHT * rounding * fall));
    return fmax(MECHC_RATE_ROUND * terms,
                fmax(mechc_slow(contacts, contacts->fastest_gap[contact]), flight));
}

/* The slip below which a contact counts as still: small beside the fastest one met, rounding of its
 * terms, or gone before its end could be told from its start. */
MECHC_STATIC double mechc_slow_slip(const mechc_contacts *contacts, int contact)
{
    const mechc_contact_place *c = &contacts->place;
    const double *row = mechc_law(c, contact) + MECHC_LAWS + c->coordinates;
    const double gone = mechc_at_once(contacts->watch, c->t) * MECHC_CONTACT_FEW
                      * fabs(c->slipping[contact]);
    double terms = 0.0;
    for (int j = 0; j < c->speeds; j++) terms += fabs(row[j] * c->y[c->coordinates + j]);
    return fmax(MECHC_RATE_ROUND * terms,
                fmax(mechc_slow(contacts, contacts->fastest_slip[contact]), gone));
}

/* -- impacts ----------------------------------------------------------------------------------- */

/* Compute the impulses at the contacts that touch and change the speeds of y; `again`: a contact
 * whose restitution no longer counts. */
MECHC_STATIC int mechc_strike(mechc_contacts *contacts, int again, double *y)
{
    const mechc_contact_place *c = &contacts->place;
    const int n = c->contacts, nu = c->speeds;
    double *closing = contacts->space, *slipping = closing + n, *friction = slipping + n;
    double *restitution = friction + n, *pressed = restitution + n, *change = pressed + n;
    double *normal = change + nu, *tangent = normal + n * nu, *space = tangent + n * nu;
    unsigned char *ones = contacts->leaving, *has_friction = contacts->still;
    int touching = 0;
    for (int k = 0; k < n; k++) {
        const double *row = mechc_law(c, k);
        if (!contacts->touching[k]) continue;
        if (!(0.0 <= row[MECHC_RESTITUTION] && row[MECHC_RESTITUTION] <= 1.0)) {
            contacts->place.failed = k;
            return MECHC_NO_RESTITUTION;
        }
        memcpy(normal + touching * nu, c->normal + k * nu, (size_t)nu * sizeof(double));
        memcpy(tangent + touching * nu, c->tangent + k * nu, (size_t)nu * sizeof(double));
        closing[touching] = row[MECHC_RATE];
        slipping[touching] = row[MECHC_SLIP];
        friction[touching] = row[MECHC_FRICTION];
        restitution[touching] = k == again ? 0.0 : row[MECHC_RESTITUTION];
        ones[touching] = 1;
        has_friction[touching++] = contacts->laws.has_friction[k];
    }
    mechc_choices choices = contacts->choices;
    choices.contacts = touching;
    mechc_impact impact = {
        {touching, nu, normal, tangent, closing, slipping, friction, friction, 0, ones}, restitution,
        has_friction, pressed, change, 1.0, &contacts->answer, &choices, space,
    };
    const int status = mechc_impact_impulses(&impact, contacts->laws.poisson);
    if (status != MECHC_RUNNING) return status;
    if (impact.kept < 1.0 && !contacts->lowered++)
        contacts->lowered_at = c->t, contacts->lowered_to = impact.kept;
    mechc_contact_change_speeds(c, change, y);
    for (int k = 0, i = 0; k < n; k++)
        contacts->struck[k] = contacts->touching[k] && pressed[i++] > 0.0;
    return MECHC_RUNNING;
}

/* The state after the impacts at this instant; `struck` marks the contacts that had one. */
MECHC_STATIC int mechc_impacts(mechc_contacts *contacts, int hit, int again, int piece, double *y)
{
    mechc_contact_place *c = &contacts->place;
    mechc_watch *watch = contacts->watch;
    const double t = c->t;
    int closes = 0;
    mechc_find_touching(contacts, hit);
    memset(contacts->struck, 0, (size_t)c->contacts);
    for (int k = 0; k < c->contacts; k++) {
        const double *row = mechc_law(c, k);
        if (contacts->touching[k])
            contacts->fastest_gap[k] = fmax(contacts->fastest_gap[k], fabs(row[MECHC_RATE]));
        contacts->fastest_slip[k] = fmax(contacts->fastest_slip[k], fabs(row[MECHC_SLIP]));
    }
    for (int k = 0; k < c->contacts; k++)
        closes |= contacts->touching[k]
               && mechc_law(c, k)[MECHC_RATE] < -mechc_slow_gap(contacts, k);
    if (!closes) return MECHC_RUNNING;
    double *before = contacts->sizes; /* of the state, for the zeros that are kept */
    memcpy(before, y, (size_t)contacts->motion->width * sizeof *y);
    const int status = mechc_strike(contacts, again, y);
    for (int k = 0; k < c->contacts && status == MECHC_RUNNING; k++) {
        const int number = mechc_event_of(contacts, k);
        if (!contacts->struck[k]) continue;
        watch->event[number].last = watch->event[number].latest = t;
        if (k != hit && !mechc_watch_keep(watch, number, t, piece, before)) return MECHC_NO_MEMORY;
    }
    return status;
}

/* -- modes ------------------------------------------------------------------------------------- */

/* Decide the mode in which the motion goes on from the current place. */
MECHC_STATIC int mechc_next_contacts(mechc_contacts *contacts, const mechc_contact_change *change, int again)
{
    const mechc_contact_place *c = &contacts->place;
    const mechc_contact_laws *laws = &contacts->laws;
    const int n = c->contacts;
    double *friction = contacts->space, *slip = friction + 2 * n;
    int any = 0;
    mechc_find_touching(contacts, change->hit);
    for (int k = 0; k < n; k++) any |= contacts->struck[k];
    for (int k = 0; k < n; k++) {
        const int stays = !any && !change->reset
                       && (k == change->halted || contacts->mode[k] == MECHC_STICKS);
        const int settled = fabs(mechc_law(c, k)[MECHC_RATE]) <= mechc_slow_gap(contacts, k);
        slip[k] = mechc_law(c, k)[MECHC_SLIP];
        contacts->closed[k] = contacts->touching[k] && (settled || k == again);
        contacts->still[k] = (stays || fabs(slip[k]) <= mechc_slow_slip(contacts, k))
                          && laws->has_friction[k] && (contacts->closed[k] || !laws->has_gap[k]);
    }
    const mechc_demands demands = {contacts->closed, contacts->still};
    const mechc_problem of = mechc_problem_of_forces(c, friction, friction + n);
    mechc_choose_states(&contacts->choices, &demands, slip, laws->has_gap, laws->has_friction);
    const int status = mechc_decide(&of, &contacts->answer, &contacts->choices, &demands,
                                    change->left_by, change->left, contacts->mode);
    for (int k = 0; k < n; k++)
        contacts->leaving[k] = contacts->closed[k] && contacts->mode[k] == MECHC_OPEN;
    return status;
}

MECHC_STATIC int mechc_contact_failure(mechc_contacts *contacts, int status)
{
    if (status > MECHC_NO_MASS || status < MECHC_NO_RESTITUTION) return status;
    contacts->why = status;
    return MECHC_EVENT_FAILED;
}

/* Whether parts overlap at the current place: a gap is negative. */
MECHC_STATIC int mechc_contacts_overlap(mechc_contacts *contacts)
{
    mechc_contact_zeros(contacts);
    for (int k = 0; k < contacts->laws.count; k++) {
        const double gap = mechc_law(&contacts->place, k)[MECHC_GAP];
        if (!contacts->laws.has_gap[k] || !(gap < -contacts->zero[k])) continue;
        contacts->overlaps = k;
        contacts->overlap = gap;
        return 1;
    }
    return 0;
}

/* Whether the contact that is hit was also hit just before, as far as can be told. */
MECHC_STATIC int mechc_is_hit_again(const mechc_contacts *contacts, int hit, double t)
{
    mechc_event *event;
    if (hit < 0) return 0;
    event = contacts->watch->event + mechc_event_of(contacts, hit);
    event->later = mechc_law(&contacts->place, hit)[MECHC_RATE];
    event->rounding = mechc_gap_rounding(&contacts->place, hit);
    return mechc_is_now(contacts->watch, event, event->last, t);
}

/* Change contacts at the state y: apply the impacts there and put the state onto the constraints of the next
 * mode.  Impacts are recorded as zeros in `piece`.  Returns MECHC_RUNNING, or why the motion ends. */
MECHC_STATIC int mechc_contacts_change(mechc_contacts *contacts, const mechc_contact_change *change, int piece,
                                 double t, double *y)
{
    mechc_contact_place *c = &contacts->place;
    const int soon = fabs(t - contacts->changed_at) <= mechc_at_once(contacts->watch, t);
    const int nq = c->coordinates;
    contacts->changes = soon ? contacts->changes + 1 : 0;
    contacts->changed_at = t;
    if (contacts->changes > MECHC_CONTACT_CHANGES) return MECHC_CONTACT_UNDECIDED;
    for (int j = 0; j < c->speeds; j++)
        contacts->speeds_met[j] = fmax(contacts->speeds_met[j], fabs(y[nq + j]));
    int status = mechc_contact_motion_at(c, t, y);
    if (status != MECHC_RUNNING) return mechc_contact_failure(contacts, status);
    const int again = mechc_is_hit_again(contacts, change->hit, t) ? change->hit : -1;
    if (change->hit >= 0) contacts->watch->event[mechc_event_of(contacts, change->hit)].last = t;
    status = mechc_impacts(contacts, change->hit, again, piece, y);
    if (status == MECHC_RUNNING) status = mechc_contact_motion_at(c, t, y);
    if (status == MECHC_RUNNING) status = mechc_next_contacts(contacts, change, again);
    if (status == MECHC_RUNNING) status = mechc_contact_settle(c, contacts->mode, t, y);
    return mechc_contact_failure(contacts, status);
}

/* Begin a piece in the current mode at the state y: set its ends, and which events cannot happen. */
MECHC_STATIC int mechc_contacts_enter(mechc_contacts *contacts, double t, const double *y)
{
    mechc_contact_place *c = &contacts->place;
    mechc_watch *watch = contacts->watch;
    const int status = mechc_contact_motion_at(c, t, y);
    if (status != MECHC_RUNNING) return mechc_contact_failure(contacts, status);
    mechc_contact_zeros(contacts);
    mechc_ends_begin(&contacts->ends, watch, contacts->mode, contacts->still, contacts->leaving,
                     contacts->zero);
    mechc_contact_sizes(contacts, y);
    for (int k = 0; k < contacts->laws.count; k++) {
        mechc_event *event = watch->event + mechc_event_of(contacts, k);
        event->idle = contacts->mode[k] != MECHC_OPEN || contacts->leaving[k] || !contacts->laws.has_gap[k];
        event->cleared = 0.0;
        if (event->last == t) event->after = mechc_law(c, k)[MECHC_RATE];
    }
    return MECHC_RUNNING;
}

/* Whether contacts have to be examined at the start. */
MECHC_STATIC int mechc_contacts_may_last(mechc_contacts *contacts)
{
    double largest = 0.0;
    int may = 0;
    for (int i = 0; i < contacts->motion->width; i++) largest = fmax(largest, contacts->motion->scale[i]);
    for (int k = 0; k < contacts->laws.count; k++) {
        const double gap = fabs(mechc_law(&contacts->place, k)[MECHC_GAP]);
        may |= !contacts->laws.has_gap[k] || gap <= MECHC_CONTACT_NEAR * largest;
    }
    return may;
}
