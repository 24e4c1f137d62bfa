/* The ends of a mode of contact: functions that are above 0 while it lasts, searched like events. */
#pragma once

#include "hybrid/contact/manifold.h"
#include "hybrid/contact/margin.h"
#include "hybrid/events/watch.h"

#define MECHC_END_ROUND (64.0 * DBL_EPSILON) /* of the terms of a slip, and of the forces at a contact */
#define MECHC_NOT_ZERO 5e-324 /* the least positive double: the sign alone counts */
#define MECHC_ENDS_KEPT 512 /* times at which the values of the ends are kept: those of a step's samples */

typedef enum {
    MECHC_END_HALT,     /* what slides comes to rest */
    MECHC_END_LIMIT,    /* a force comes to its limit */
    MECHC_END_MARGIN,   /* the largest least limit, of forces that are not unique, reaches 0 */
    MECHC_END_NEGATIVE, /* a coefficient of friction, which would push */
    MECHC_END_PARADOX,  /* the determinant of the sliding contacts (Painleve 1895) */
    MECHC_END_CLEAR,    /* a gap that opens from rest is open by more than the motion is known to, */
    MECHC_END_BACK      /* or has closed by as much */
} mechc_end_kind;

typedef struct {
    mechc_end_kind kind;
    int contact; /* -1: of all */
    int limit;   /* of the mode */
    double zero; /* what the gap may be where it is 0 */
    void *owner; /* mechc_ends, and the place in it, */
    int number;  /* for the function of the event */
} mechc_end;

/* The ends of the current mode, and their values at the last times. */
typedef struct {
    mechc_contact_place *place;
    mechc_answer *answer;
    const unsigned char *mode;
    mechc_end *end;
    mechc_limit *limit;
    int count, most, forces; /* forces: whether any end needs them */
    double *friction, *sticking; /* of the problem */
    mechc_problem problem;
    double *kept; /* rows of 1 + most: time, values */
    double *line; /* rows (nq + nu) over the state: of each contact's slip, and one of zeros */
} mechc_ends;

MECHC_STATIC void mechc_ends_free(mechc_ends *ends)
{
    free(ends->end);
    free(ends->limit);
    free(ends->friction);
}

/* Allocate the ends: for each contact halt, two limits, negative, clear, back; for all margin, paradox. */
MECHC_STATIC int mechc_ends_make(mechc_ends *ends, mechc_contact_place *place, mechc_answer *answer)
{
    const size_t n = (size_t)place->contacts, most = 6 * n + 2;
    const size_t width = (size_t)(place->coordinates + place->speeds);
    ends->place = place;
    ends->answer = answer;
    ends->most = (int)most;
    ends->end = calloc(most, sizeof *ends->end);
    ends->limit = calloc(2 * n + 1, sizeof *ends->limit);
    ends->friction = calloc(2 * n + MECHC_ENDS_KEPT * (1 + most) + (n + 1) * width, sizeof *ends->friction);
    if (!ends->end || !ends->limit || !ends->friction) return 0;
    ends->sticking = ends->friction + n;
    ends->kept = ends->sticking + n;
    ends->line = ends->kept + MECHC_ENDS_KEPT * (1 + most);
    return 1;
}

/* Compute the forces at the current place by mechc_forces_of or mechc_answer_of. */
MECHC_STATIC int mechc_ends_solve(
    mechc_ends *ends, void (*solve)(mechc_answer *, const mechc_problem *, const unsigned char *))
{
    const int status = mechc_contact_accelerate(ends->place);
    if (status != MECHC_RUNNING) return status;
    ends->problem = mechc_problem_of_forces(ends->place, ends->friction, ends->sticking);
    solve(ends->answer, &ends->problem, ends->mode);
    return MECHC_RUNNING;
}

/* The rounding error of a force at a contact, N. */
MECHC_STATIC double mechc_force_rounding(const mechc_ends *ends, int contact)
{
    const double newton = mechc_of_one_newton(&ends->problem, contact);
    return newton > 0.0 ? MECHC_END_ROUND * ends->answer->size / newton : 0.0;
}

/* The value of an end at the current place; a slip within rounding counts as none, a force within
 * rounding as pressing. */
MECHC_STATIC double mechc_end_value(mechc_ends *ends, const mechc_end *end)
{
    const mechc_contact_place *c = ends->place;
    const double *row = end->contact >= 0 ? mechc_law(c, end->contact) : 0;
    double terms = 0.0;
    switch (end->kind) {
    case MECHC_END_HALT:
        for (int j = 0; j < c->speeds; j++)
            terms += fabs(row[MECHC_LAWS + c->coordinates + j] * c->y[c->coordinates + j]);
        return mechc_way(ends->mode[end->contact]) * row[MECHC_SLIP] + MECHC_END_ROUND * terms;
    case MECHC_END_LIMIT:
        return mechc_limit_value(ends->answer, ends->limit + end->limit)
             + mechc_force_rounding(ends, end->contact);
    case MECHC_END_MARGIN: return mechc_answer_margin(ends->answer, ends->limit);
    case MECHC_END_NEGATIVE:
        return fmin(row[MECHC_FRICTION], row[MECHC_STICTION])
             + fmax(ends->forces ? mechc_force_rounding(ends, end->contact) : 0.0, MECHC_NOT_ZERO);
    case MECHC_END_PARADOX: return mechc_answer_stiffness(ends->answer);
    case MECHC_END_CLEAR: return end->zero - row[MECHC_GAP];
    default: return end->zero + row[MECHC_GAP];
    }
}

MECHC_STATIC double *mechc_ends_row(const mechc_ends *ends, double t)
{
    union { double t; unsigned long long bits; } key = {t};
    const unsigned long long mixed = key.bits * 0x9E3779B97F4A7C15ull; /* Fibonacci hashing */
    return ends->kept + (mixed >> 55) * (unsigned)(1 + ends->most);
}

/* Store the values of all ends at the current place; NaN if forces cannot be computed. */
MECHC_STATIC void mechc_ends_keep(mechc_ends *ends)
{
    double *row = mechc_ends_row(ends, ends->place->t);
    int solved = 1;
    if (!ends->count) return;
    if (ends->forces) {
        solved = mechc_ends_solve(ends, mechc_answer_of) == MECHC_RUNNING;
        if (solved) mechc_limits_of(ends->answer, ends->limit);
    }
    row[0] = ends->place->t;
    for (int i = 0; i < ends->count; i++)
        row[1 + i] = solved ? mechc_end_value(ends, ends->end + i) : NAN;
}

/* An end as the function of an event; states of the piece at this time were evaluated before. */
MECHC_STATIC double mechc_end_event(void *context, double t, const double *y, const double *p)
{
    const mechc_end *end = context;
    mechc_ends *ends = end->owner;
    const double *row = mechc_ends_row(ends, t);
    (void)p;
    if (row[0] != t) {
        if (mechc_contact_at(ends->place, t, y) != MECHC_RUNNING) return NAN;
        mechc_ends_keep(ends);
    }
    return row[1 + end->number];
}

MECHC_STATIC mechc_end *mechc_ends_add(mechc_ends *ends, mechc_end_kind kind, int contact)
{
    mechc_end *end = ends->end + ends->count;
    *end = (mechc_end){kind, contact, 0, 0.0, ends, ends->count};
    ends->count++;
    return end;
}

/* Set the line that bounds an end from below: friction that is constant, and a slip that is linear where
 * no constraint moves the states of the dense output. */
MECHC_STATIC void mechc_end_line(const mechc_ends *ends, const mechc_end *end, mechc_event *event)
{
    const mechc_contact_place *c = ends->place;
    const int nq = c->coordinates, nu = c->speeds, k = end->contact, halts = end->kind == MECHC_END_HALT;
    if (!halts && end->kind != MECHC_END_NEGATIVE) return;
    if (!c->laws->is_linear || !c->laws->is_linear[k]) return;
    if (halts && (c->rows || mechc_mode_holds(c, ends->mode))) return;
    const double *row = mechc_law(c, k), *slopes = row + MECHC_LAWS + nq;
    const double way = mechc_way(ends->mode[k]);
    double *line = ends->line + (halts ? k : c->contacts) * (nq + nu);
    for (int j = 0; j < nu && halts; j++) line[nq + j] = way * slopes[j];
    event->line = line;
    event->constant = halts ? way * (row[MECHC_SLIP] - mechc_inner_product(slopes, c->y + nq, nu))
                            : fmin(row[MECHC_FRICTION], row[MECHC_STICTION]) + MECHC_NOT_ZERO;
}

/* Set the ends of a mode that begins at the current place, with known accelerations, as events
 * after those of the caller. `still`: contacts without slip there; `leaving`: gaps that open from
 * rest, with the bounds below which they count as 0. */
MECHC_STATIC void mechc_ends_begin(mechc_ends *ends, mechc_watch *watch, const unsigned char *mode,
                             const unsigned char *still, const unsigned char *leaving,
                             const double *zero)
{
    const mechc_contact_place *c = ends->place;
    const unsigned char *has_gap = c->laws->has_gap;
    int paradox = 0;
    ends->mode = mode;
    ends->count = 0;
    for (int i = 0; i < MECHC_ENDS_KEPT; i++) ends->kept[i * (1 + ends->most)] = NAN;
    mechc_ends_solve(ends, mechc_answer_of);
    const int limits = mechc_limits_of(ends->answer, ends->limit);
    for (int k = 0; k < c->contacts; k++)
        if (mechc_way(mode[k]) != 0.0) mechc_ends_add(ends, MECHC_END_HALT, k);
    if (limits && mechc_answer_is_redundant(ends->answer)) mechc_ends_add(ends, MECHC_END_MARGIN, -1);
    else
        for (int i = 0; i < limits; i++)
            mechc_ends_add(ends, MECHC_END_LIMIT, ends->limit[i].contact)->limit = i;
    for (int k = 0; k < c->contacts; k++) {
        const int slides = mechc_way(mode[k]) != 0.0;
        paradox |= slides && has_gap[k];
        if (slides || mode[k] == MECHC_STICKS) mechc_ends_add(ends, MECHC_END_NEGATIVE, k);
    }
    if (paradox) mechc_ends_add(ends, MECHC_END_PARADOX, -1);
    ends->forces = limits > 0 || paradox;
    for (int k = 0; k < c->contacts; k++) {
        if (!leaving[k]) continue;
        mechc_ends_add(ends, MECHC_END_CLEAR, k)->zero = zero[k];
        mechc_ends_add(ends, MECHC_END_BACK, k)->zero = zero[k];
    }
    watch->count = watch->own + ends->count;
    for (int i = 0; i < ends->count; i++) {
        const mechc_end *end = ends->end + i;
        const int number = watch->own + i;
        const double value = mechc_end_value(ends, end);
        const int halts = end->kind == MECHC_END_HALT && still[end->contact];
        /* a mode may begin at its limit, and ends where it exceeds it */
        const int at = end->kind != MECHC_END_HALT && end->kind != MECHC_END_PARADOX && value <= 0.0
                    && end->kind != MECHC_END_CLEAR && end->kind != MECHC_END_BACK;
        watch->functions[number] = (mechc_event_functions){mechc_end_event, 0, 0, ends->end + i};
        watch->policy[number] = (mechc_event_policy){-1.0, 1, -1};
        mechc_event_forget(watch->event + number);
        watch->event[number].side = halts || at ? 1.0 : 0.0;
        mechc_end_line(ends, end, watch->event + number);
    }
}
