/* The driver of a motion: it runs a method, stops where inputs have kinks, samples fall due, events
 * have zeros or contacts change, applies the change of state there, and begins the next run.
 *
 *
 *     begin             mechc_hybrid_begin, with the inputs of the first segment    hybrid/inputs.h
 *     attempt steps     the unit's advance                                          stepping/attempt.h
 *     search a step     mechc_watch_step, zeros of events                           hybrid/events/search.h
 *     end a piece       its steps are kept                                          record/piece.h
 *     reset the state   mechc_watch_reset                                           hybrid/events/resets.h
 *     end a mode        zeros that end a mode of contact                            hybrid/contact/ends.h
 *     change contacts   mechc_contacts_change: impacts, then the next mode          hybrid/contact/contacts.h
 *     cross a kink      the same run goes on with the next segment of inputs        hybrid/inputs.h
 *     begin a piece     mechc_begin_piece, a run of the method                      stepping/start.h
 *     reach a time      one time after the other, states between steps              hybrid/reach.h
 *
 * Every accepted step is searched before the next is attempted, so that a motion has the same steps
 * whoever drives it: alone, in parts, or in a batch.
 */
#pragma once

#include "hybrid/contact/contacts.h"
#include "hybrid/events/resets.h"
#include "hybrid/inputs.h"
#include "record/piece.h"

/* A reader of the steps of a piece, called before they are dropped, with the steps up to a time
 * within the last one or NaN. */
typedef struct {
    void (*ends)(void *context, double until);
    void *context;
} mechc_observer;

typedef struct {
    mechc_motion motion;
    mechc_options options; /* of the runs that follow */
    const mechc_given_inputs *given;
    mechc_motion_inputs inputs;
    mechc_watch watch;       /* without room where there are no events */
    mechc_contacts contacts; /* likewise */
    mechc_outer outer;       /* the rates in contact */
    mechc_observer observer;
    int keeps;       /* pieces are kept; else the last one alone */
    double max_bytes; /* for their steps */
    mechc_run *run;  /* of the last piece, */
    int live;        /* which has not ended */
    mechc_piece **piece;
    int pieces, room;
    mechc_stats ended; /* counters of runs that have ended, */
    long crossings;    /* and change points that they passed */
    ptrdiff_t most;    /* states that the last piece may have */
    ptrdiff_t searched; /* steps of it */
    double stop;       /* where an event was found in it; NaN: nowhere */
    double *state, *after;
    int status;
} mechc_hybrid;

#define MECHC_MOST_STATES 4e18 /* of a piece: below the largest ptrdiff_t */

/* Switches with which a unit leaves out code that its motions never need. */
#ifndef MECHC_WITH_EVENTS
#define MECHC_WITH_EVENTS 1
#endif
#ifndef MECHC_WITH_CONTACTS
#define MECHC_WITH_CONTACTS 1
#endif

MECHC_STATIC int mechc_has_events(const mechc_hybrid *hybrid)
{
    return MECHC_WITH_EVENTS && hybrid->watch.most > 0;
}

MECHC_STATIC int mechc_has_contacts(const mechc_hybrid *hybrid)
{
    return MECHC_WITH_CONTACTS && hybrid->contacts.laws.count > 0;
}

/* Allocate the memory for motions of a scene; motion, inputs and laws of contacts are described
 * before, events are given to watch after.  Returns 0 without memory. */
MECHC_STATIC int mechc_hybrid_make(mechc_hybrid *hybrid, int events)
{
    mechc_motion *motion = &hybrid->motion;
    const int contacts = mechc_has_contacts(hybrid) ? hybrid->contacts.laws.count : 0;
    if (!mechc_motion_make(motion, events > 0)) return 0;
    hybrid->run = calloc(1, motion->unit->run_size);
    hybrid->state = malloc(2 * (size_t)motion->width * sizeof(double));
    hybrid->after = hybrid->state + motion->width;
    if (!hybrid->run || !hybrid->state) return 0;
    if (hybrid->given && !mechc_motion_inputs_make(hybrid->given, &hybrid->inputs)) return 0;
    if (MECHC_WITH_EVENTS && events
        && !mechc_watch_make(&hybrid->watch, motion, events, contacts ? 6 * contacts + 2 : 0))
        return 0;
    if (!MECHC_WITH_CONTACTS || !contacts) return 1;
    if (!mechc_contacts_make(&hybrid->contacts, motion, &hybrid->watch)) return 0;
    hybrid->outer = (mechc_outer){mechc_contact_stage, &hybrid->contacts, hybrid->contacts.sizes};
    return 1;
}

MECHC_STATIC mechc_piece *mechc_last_piece(const mechc_hybrid *hybrid)
{
    return hybrid->pieces ? hybrid->piece[hybrid->pieces - 1] : 0;
}

/* Drop the steps of the motion if they are not kept. */
MECHC_STATIC void mechc_hybrid_drop(mechc_hybrid *hybrid)
{
    if (hybrid->live && hybrid->keeps) mechc_piece_take(mechc_last_piece(hybrid), hybrid->run);
    if (hybrid->live) hybrid->motion.unit->release(hybrid->run);
    hybrid->live = 0;
    for (int i = 0; i < hybrid->pieces; i++) {
        hybrid->piece[i]->steps = &hybrid->piece[i]->own;
        mechc_piece_leave(hybrid->piece[i]);
    }
    hybrid->pieces = 0;
}

MECHC_STATIC void mechc_hybrid_free(mechc_hybrid *hybrid)
{
    if (hybrid->run) mechc_hybrid_drop(hybrid);
    if (mechc_has_contacts(hybrid)) mechc_contacts_free(&hybrid->contacts);
    if (mechc_has_events(hybrid)) mechc_watch_free(&hybrid->watch);
    mechc_motion_inputs_free(&hybrid->inputs);
    mechc_motion_free(&hybrid->motion);
    free(hybrid->piece);
    free(hybrid->run);
    free(hybrid->state);
}

/* -- counters ---------------------------------------------------------------------------------- */

MECHC_STATIC void mechc_add_stats(mechc_stats *all, const mechc_stats *more)
{
    all->steps += more->steps;
    all->rejected += more->rejected;
    all->rhs_evaluations += more->rhs_evaluations;
    all->closure_iterations += more->closure_iterations;
    all->examined += more->examined;
    all->coordinate = more->coordinate;
    all->left_series |= more->left_series;
    all->rounding = fmax(all->rounding, more->rounding);
    if (more->least_singular < all->least_singular) {
        all->least_singular = more->least_singular;
        all->least_singular_time = more->least_singular_time;
    }
    if (more->critical_gap < all->critical_gap) {
        all->critical_gap = more->critical_gap;
        all->critical_time = more->critical_time;
    }
}

/* Begin to count anew. */
MECHC_STATIC void mechc_forget_counters(mechc_hybrid *hybrid)
{
    hybrid->ended = (mechc_stats){.least_singular = HUGE_VAL, .critical_gap = HUGE_VAL, .coordinate = -1};
    hybrid->crossings = 0;
}

/* The sum of the counters of all runs. */
MECHC_STATIC mechc_stats mechc_hybrid_stats(const mechc_hybrid *hybrid)
{
    mechc_stats all = hybrid->ended;
    if (hybrid->live) mechc_add_stats(&all, &hybrid->run->stats);
    return all;
}

/* The number of change points that the current run has passed up to a time; NaN: all of them. */
MECHC_STATIC long mechc_crossings_until(const mechc_hybrid *hybrid, double t)
{
    const mechc_trajectory *steps = &hybrid->run->trajectory;
    const ptrdiff_t row = hybrid->motion.coordinates + 2;
    long passed = 0;
    for (ptrdiff_t i = 0; i < steps->crossing_count; i++)
        passed += isnan(t) || hybrid->motion.sense * (steps->crossings[i * row] - t) <= 0.0;
    return passed;
}

/* -- pieces ------------------------------------------------------------------------------------ */

/* The memory that a run takes for each step, in bytes. */
MECHC_STATIC double mechc_bytes_a_state(const mechc_trajectory *steps)
{
    return sizeof(double) * (1.0 + steps->width * (1.0 + steps->dense_rows));
}

/* End the last piece, at a time within its last step or, if that is NaN, with its last state.
 * Returns MECHC_RUNNING, or which limit the motion has reached. */
MECHC_STATIC int mechc_end_piece(mechc_hybrid *hybrid, double cut)
{
    mechc_piece *piece = mechc_last_piece(hybrid);
    mechc_run *run = hybrid->run;
    const mechc_trajectory *steps = &run->trajectory;
    const long left = hybrid->options.max_steps - run->stats.steps - run->stats.rejected;
    piece->cut = cut;
    if (hybrid->observer.ends) hybrid->observer.ends(hybrid->observer.context, cut);
    mechc_add_stats(&hybrid->ended, &run->stats);
    hybrid->crossings += mechc_crossings_until(hybrid, cut);
    hybrid->options.max_steps = left > 1 ? left : 1;
    hybrid->options.first_step = 0.0;
    if (hybrid->keeps) {
        hybrid->max_bytes -= (double)steps->count * mechc_bytes_a_state(steps) + sizeof *piece;
        mechc_piece_take(piece, run);
    }
    hybrid->motion.unit->release(run);
    hybrid->live = 0;
    piece->steps = &piece->own;
    if (!hybrid->keeps) mechc_piece_leave(hybrid->piece[--hybrid->pieces]);
    if (hybrid->keeps && hybrid->max_bytes <= 0.0) return MECHC_MEMORY_LIMIT;
    return left > 0 ? MECHC_RUNNING : MECHC_TOO_MANY_STEPS;
}

/* Add a piece in the current mode of contact; 0 without memory. */
MECHC_STATIC int mechc_add_piece(mechc_hybrid *hybrid, int jumps)
{
    const mechc_watch *watch = &hybrid->watch;
    const int causes = jumps ? watch->causes : 0, contacts = hybrid->contacts.laws.count;
    if (hybrid->pieces == hybrid->room) {
        const int room = 2 * hybrid->room + 4;
        mechc_piece **more = realloc(hybrid->piece, (size_t)room * sizeof *more);
        if (!more) return 0;
        hybrid->piece = more;
        hybrid->room = room;
    }
    mechc_piece *piece =
        mechc_piece_make(hybrid->motion.p, hybrid->motion.parameters, causes, contacts);
    if (!piece) return 0;
    piece->jumps = jumps;
    piece->steps = &hybrid->run->trajectory;
    if (causes) memcpy(piece->cause, watch->cause, (size_t)causes * sizeof *piece->cause);
    if (contacts) memcpy(piece->contact, hybrid->contacts.mode, (size_t)contacts);
    hybrid->piece[hybrid->pieces++] = piece;
    hybrid->live = 1;
    return 1;
}

/* Choose the method of the pieces in contact: the requested one if it supports their rates. */
MECHC_STATIC void mechc_in_contact(mechc_hybrid *hybrid, mechc_options *options)
{
    options->outer = &hybrid->outer;
    options->dense = 1;
    options->when_stiff = options->last_only = 0;
    if (options->method != MECHC_DOPRI5) options->method = MECHC_DOP853;
}

/* Begin a piece at the state y that goes on to t1; returns its status, or why it has no run. */
MECHC_STATIC int mechc_begin_piece(mechc_hybrid *hybrid, double t, const double *y, double t1, int jumps)
{
    mechc_motion *motion = &hybrid->motion;
    mechc_options options = hybrid->options;
    const int lasts = mechc_has_contacts(hybrid) && mechc_contacts_last(&hybrid->contacts);
    const double segment =
        hybrid->given && t1 != t ? mechc_segment_end(hybrid->given, &hybrid->inputs, t1, motion->sense) : t1;
    options.t0 = t;
    options.y0 = y;
    options.t1 = lasts ? segment : t1;
    options.p = motion->p;
    options.scale = motion->scale;
    options.inputs = motion->inputs;
    motion->states = lasts ? mechc_contact_states : mechc_free_states;
    motion->rates = lasts ? mechc_contact_rates : mechc_free_rates;
    motion->steps = &hybrid->run->trajectory;
    if (mechc_has_contacts(hybrid)) {
        const int status = mechc_contacts_enter(&hybrid->contacts, t, y);
        if (status != MECHC_RUNNING) return status;
    }
    if (lasts) mechc_in_contact(hybrid, &options);
    motion->unit->start(hybrid->run, &options);
    if (!mechc_add_piece(hybrid, jumps)) return MECHC_NO_MEMORY;
    if (segment != options.t1) motion->unit->extend(hybrid->run, segment, motion->inputs);
    const mechc_trajectory *steps = &hybrid->run->trajectory;
    if (!steps->count) return hybrid->run->status == MECHC_RUNNING ? MECHC_NO_MEMORY : hybrid->run->status;
    hybrid->most = (ptrdiff_t)fmin(fmax(hybrid->max_bytes / mechc_bytes_a_state(steps), 2.0), MECHC_MOST_STATES);
    hybrid->searched = 0;
    hybrid->stop = NAN;
    if (mechc_has_events(hybrid)) mechc_watch_enter(&hybrid->watch, t, steps->y);
    return hybrid->run->status;
}

/* Go to the inputs that hold from a time on, at the state y. */
MECHC_STATIC void mechc_enter_inputs(mechc_hybrid *hybrid, double t, const double *y)
{
    mechc_motion *motion = &hybrid->motion;
    if (!hybrid->given) return;
    mechc_enter_segment(hybrid->given, &hybrid->inputs, t, y, hybrid->options.t1, motion->sense);
}

/* -- what happens at an instant ---------------------------------------------------------------- */

/* Whether an event has happened so often that the motion ends. */
MECHC_STATIC int mechc_ends_motion(const mechc_hybrid *hybrid)
{
    const mechc_watch *watch = &hybrid->watch;
    int ends = 0;
    for (int i = 0; i < watch->causes; i++) {
        const long terminal = watch->policy[watch->cause[i]].terminal;
        ends |= terminal > 0 && watch->event[watch->cause[i]].count >= terminal;
    }
    return ends;
}

/* Begin the next piece after a change at a time; `status` is the status of the pieces before it. */
MECHC_STATIC int mechc_next_piece(mechc_hybrid *hybrid, double t, const double *y, int jumps, int ends,
                            int status)
{
    const int begun = mechc_begin_piece(hybrid, t, y, ends ? t : hybrid->options.t1, jumps);
    return ends ? MECHC_STOPPED_BY_EVENT : status != MECHC_RUNNING ? status : begun;
}

/* Change the contacts and go on in another mode. */
MECHC_STATIC int mechc_change_contacts(mechc_hybrid *hybrid, const mechc_contact_change *change, double t,
                                 int left)
{
    mechc_contacts *contacts = &hybrid->contacts;
    mechc_watch *watch = &hybrid->watch;
    const int status =
        mechc_contacts_change(contacts, change, hybrid->pieces - 1, t, hybrid->after);
    if (status != MECHC_RUNNING) return status;
    for (int k = 0; k < contacts->laws.count; k++) { /* impacts are causes too */
        int known = !contacts->struck[k];
        for (int i = 0; i < watch->causes; i++) known |= watch->cause[i] == contacts->laws.event[k];
        if (!known) watch->cause[watch->causes++] = contacts->laws.event[k];
    }
    return mechc_next_piece(hybrid, t, hybrid->after, 1, mechc_ends_motion(hybrid), left);
}

/* Handle the end of a mode of contact. */
MECHC_STATIC int mechc_end_contacts(mechc_hybrid *hybrid, const mechc_end *end, double t, int left)
{
    mechc_contacts *contacts = &hybrid->contacts;
    mechc_watch *watch = &hybrid->watch;
    mechc_contact_change change = mechc_no_change;
    const int k = end->contact, event = k >= 0 ? mechc_event_of(contacts, k) : -1;
    if (end->kind == MECHC_END_PARADOX) return MECHC_CONTACT_INCONSISTENT;
    if (end->kind == MECHC_END_NEGATIVE) {
        contacts->place.failed = k;
        contacts->why = MECHC_PUSHES;
        return MECHC_EVENT_FAILED;
    }
    if (end->kind == MECHC_END_CLEAR) {
        memset(contacts->leaving, 0, (size_t)contacts->laws.count);
        memset(contacts->still, 0, (size_t)contacts->laws.count);
        const int status = mechc_next_piece(hybrid, t, hybrid->after, 0, 0, left);
        watch->event[event].cleared = mechc_event_value(watch, event, t, hybrid->after);
        return status;
    }
    if (end->kind == MECHC_END_LIMIT) {
        change.left_by = k;
        change.left = contacts->ends.limit[end->limit].kind == MECHC_LIFTS
                    ? ~(1u << MECHC_OPEN) : 1u << MECHC_STICKS;
    }
    if (end->kind == MECHC_END_HALT) change.halted = k;
    if (end->kind == MECHC_END_BACK) {
        change.hit = k;
        watch->event[event].last = t; /* the contact opened from rest, and closes to rest again */
    }
    if (k >= 0 && !contacts->laws.has_gap[k]) {
        watch->event[event].latest = t;
        if (!mechc_watch_keep(watch, event, t, hybrid->pieces - 1, hybrid->state)) return MECHC_NO_MEMORY;
    }
    return mechc_change_contacts(hybrid, &change, t, left);
}

/* Reset the state by an event. */
MECHC_STATIC int mechc_reset_motion(mechc_hybrid *hybrid, int number, double t, int left)
{
    mechc_watch *watch = &hybrid->watch;
    mechc_contacts *contacts = &hybrid->contacts;
    const int code = mechc_watch_reset(watch, number, hybrid->pieces - 1, t, hybrid->after);
    const int accumulates = code == MECHC_RESETS_ACCUMULATE;
    if (code != MECHC_RUNNING && !accumulates) return code;
    if (mechc_has_contacts(hybrid)) /* what still touches is seen by its gap */
        memset(contacts->mode, 0, (size_t)contacts->laws.count);
    if (mechc_has_contacts(hybrid) && !accumulates) {
        mechc_contact_change change = mechc_no_change;
        change.reset = 1;
        if (mechc_contact_at(&contacts->place, t, hybrid->after) != MECHC_RUNNING
            || mechc_contacts_overlap(contacts))
            return MECHC_EVENT_FAILED;
        return mechc_change_contacts(hybrid, &change, t, left);
    }
    const int ends = mechc_ends_motion(hybrid);
    const int status = mechc_next_piece(hybrid, t, hybrid->after, 1, ends || accumulates, left);
    return accumulates ? code : status;
}

/* Handle the event that was found: it ends the motion, or changes the state. */
MECHC_STATIC int mechc_take_event(mechc_hybrid *hybrid)
{
    mechc_watch *watch = &hybrid->watch;
    const int number = watch->stopped_by, own = number < watch->own;
    const double t = hybrid->stop;
    mechc_motion *motion = &hybrid->motion;
    if (own && !mechc_event_resets(watch, number)) {
        mechc_last_piece(hybrid)->cut = t;
        return MECHC_STOPPED_BY_EVENT;
    }
    motion->states(motion, 1, &t, hybrid->state);
    memcpy(hybrid->after, hybrid->state, (size_t)motion->width * sizeof(double));
    const int left = mechc_end_piece(hybrid, t);
    mechc_enter_inputs(hybrid, t, hybrid->state);
    watch->causes = 0;
    if (own && (!MECHC_WITH_CONTACTS || watch->policy[number].contact < 0))
        return mechc_reset_motion(hybrid, number, t, left);
    if (!own) return mechc_end_contacts(hybrid, &hybrid->contacts.ends.end[number - watch->own], t, left);
    mechc_contact_change change = mechc_no_change;
    change.hit = watch->policy[number].contact;
    watch->cause[watch->causes++] = number;
    return mechc_change_contacts(hybrid, &change, t, left);
}

/* Handle the end of a run: the end of its segment of inputs, or of the motion. */
MECHC_STATIC int mechc_take_run_end(mechc_hybrid *hybrid)
{
    mechc_motion *motion = &hybrid->motion;
    const mechc_trajectory *steps = &hybrid->run->trajectory;
    const double t = hybrid->run->t, *y = steps->y + (steps->count - 1) * motion->width;
    if (t == hybrid->options.t1) return MECHC_FINISHED;
    if (!mechc_has_contacts(hybrid) || !mechc_contacts_last(&hybrid->contacts)) {
        mechc_enter_inputs(hybrid, t, y);
        const double end =
            mechc_segment_end(hybrid->given, &hybrid->inputs, hybrid->options.t1, motion->sense);
        motion->unit->extend(hybrid->run, end, motion->inputs);
        return hybrid->run->status;
    }
    memcpy(hybrid->state, y, (size_t)motion->width * sizeof *y);
    memcpy(hybrid->after, y, (size_t)motion->width * sizeof *y);
    const int left = mechc_end_piece(hybrid, NAN);
    mechc_enter_inputs(hybrid, t, hybrid->state);
    hybrid->watch.causes = 0;
    return mechc_change_contacts(hybrid, &mechc_no_change, t, left);
}

/* -- forwards ---------------------------------------------------------------------------------- */

/* Begin a motion that consists of its start alone, for a reason that is returned. */
MECHC_STATIC int mechc_begin_nothing(mechc_hybrid *hybrid, int why)
{
    mechc_options options = hybrid->options;
    options.y0 = hybrid->state;
    options.t1 = options.t0;
    options.p = hybrid->motion.p;
    options.scale = hybrid->motion.scale;
    options.inputs = hybrid->motion.inputs;
    hybrid->motion.states = mechc_free_states;
    hybrid->motion.rates = mechc_free_rates;
    hybrid->motion.steps = &hybrid->run->trajectory;
    memset(hybrid->contacts.mode, 0, (size_t)hybrid->contacts.laws.count);
    hybrid->motion.unit->start(hybrid->run, &options);
    return mechc_add_piece(hybrid, 0) ? why : MECHC_NO_MEMORY;
}

/* Continue the motion from the current state with these options, without a piece before it. */
MECHC_STATIC int mechc_hybrid_go_on(mechc_hybrid *hybrid, const mechc_options *options)
{
    mechc_motion *motion = &hybrid->motion;
    mechc_contacts *contacts = &hybrid->contacts;
    hybrid->options = *options;
    motion->rtol = options->rtol;
    motion->atol = options->atol;
    motion->sense = options->t1 >= options->t0 ? 1.0 : -1.0;
    motion->last = options->t1;
    motion->inputs = hybrid->given ? &hybrid->inputs.now.head : 0;
    motion->whole = hybrid->given ? &hybrid->inputs.whole.head : 0;
    mechc_enter_inputs(hybrid, options->t0, hybrid->state);
    mechc_motion_renew(motion);
    if (mechc_has_contacts(hybrid)) {
        int status = mechc_contact_at(&contacts->place, options->t0, hybrid->state);
        status = mechc_contact_failure(contacts, status);
        if (status == MECHC_RUNNING && mechc_contacts_overlap(contacts)) status = MECHC_OPEN_AT_START;
        if (status == MECHC_RUNNING && mechc_contacts_may_last(contacts))
            status = mechc_contacts_change(contacts, &mechc_no_change, 0, options->t0, hybrid->state);
        if (status != MECHC_RUNNING) return hybrid->status = mechc_begin_nothing(hybrid, status);
    }
    return hybrid->status = mechc_begin_piece(hybrid, options->t0, hybrid->state, options->t1, 0);
}

/* Begin a motion. */
MECHC_STATIC int mechc_hybrid_begin(mechc_hybrid *hybrid, const mechc_options *options)
{
    mechc_forget_counters(hybrid);
    hybrid->inputs.segment = 0;
    memcpy(hybrid->motion.p, options->p, (size_t)hybrid->motion.parameters * sizeof(double));
    memcpy(hybrid->state, options->y0, (size_t)hybrid->motion.width * sizeof(double));
    if (mechc_has_events(hybrid)) mechc_watch_begin(&hybrid->watch);
    if (mechc_has_contacts(hybrid)) mechc_contacts_begin(&hybrid->contacts);
    return mechc_hybrid_go_on(hybrid, options);
}

/* Search the new steps of the run; hybrid->stop gets the first time at which something happens. */
MECHC_STATIC int mechc_hybrid_search(mechc_hybrid *hybrid)
{
    const mechc_trajectory *steps = &hybrid->run->trajectory;
    for (; mechc_has_events(hybrid) && hybrid->searched + 1 < steps->count; hybrid->searched++) {
        const int code =
            mechc_watch_step(&hybrid->watch, hybrid->pieces - 1, hybrid->searched, &hybrid->stop);
        if (code == MECHC_STOPPED_BY_EVENT) return MECHC_RUNNING;
        hybrid->stop = NAN;
        if (code != MECHC_RUNNING) return code;
    }
    return MECHC_RUNNING;
}

/* Search the new steps after the run has advanced, and handle what happens there. */
MECHC_STATIC int mechc_hybrid_take(mechc_hybrid *hybrid)
{
    int status = mechc_hybrid_search(hybrid);
    if (mechc_has_events(hybrid) && status == MECHC_RUNNING && !isnan(hybrid->stop))
        status = mechc_take_event(hybrid);
    else if (status == MECHC_RUNNING)
        status = hybrid->run->status == MECHC_FINISHED ? mechc_take_run_end(hybrid) : hybrid->run->status;
    return hybrid->status = status;
}

/* The number of attempted steps that the run may make before its steps are searched. */
MECHC_STATIC long mechc_attempts_at_once(const mechc_hybrid *hybrid, long steps)
{
    const ptrdiff_t room = hybrid->most - hybrid->run->trajectory.count;
    if (mechc_has_events(hybrid)) steps = steps < 1 ? steps : 1;
    return room < steps ? (long)room : steps;
}

/* Advance by at most this many attempts; returns the status, early if the code of a method is missing. */
MECHC_STATIC int mechc_hybrid_advance(mechc_hybrid *hybrid, long steps)
{
    while (hybrid->status == MECHC_RUNNING && hybrid->run->wanted < 0 && steps > 0) {
        const long some = mechc_attempts_at_once(hybrid, steps);
        if (some < 1) return hybrid->status = MECHC_MEMORY_LIMIT;
        const mechc_stats *stats = &hybrid->run->stats;
        const long before = stats->steps + stats->rejected;
        hybrid->motion.unit->advance(hybrid->run, some);
        const long made = stats->steps + stats->rejected - before;
        steps -= made > 1 ? made : 1;
        mechc_hybrid_take(hybrid);
    }
    return hybrid->status;
}

/* Adapt the driver after the run was brought back to a moment within a segment. */
MECHC_STATIC void mechc_hybrid_back(mechc_hybrid *hybrid, ptrdiff_t segment)
{
    hybrid->status = hybrid->run->status;
    hybrid->searched = 0;
    hybrid->stop = NAN;
    hybrid->inputs.segment = segment;
    if (!hybrid->given) return;
    const double end = mechc_segment_end(hybrid->given, &hybrid->inputs, hybrid->options.t1,
                                         hybrid->motion.sense);
    mechc_narrow_inputs(hybrid->given, &hybrid->inputs, hybrid->run->t, end);
}

/* The last time; y gets the state there. */
MECHC_STATIC double mechc_hybrid_end(mechc_hybrid *hybrid, double *y)
{
    mechc_motion *motion = &hybrid->motion;
    const mechc_trajectory *steps = &hybrid->run->trajectory;
    const double cut = hybrid->live ? mechc_last_piece(hybrid)->cut : hybrid->stop;
    const double *last = hybrid->live ? steps->y + (steps->count - 1) * motion->width : hybrid->state;
    if (hybrid->live && !isnan(cut)) motion->states(motion, 1, &cut, y);
    else memcpy(y, last, (size_t)motion->width * sizeof *y);
    return isnan(cut) ? hybrid->run->t : cut;
}
