/* Many motions of one compiled scene, each exactly the motion that one run makes.
 *
 * Threads take members from a common counter, as many at a time as run in lockstep; one
 * that ends makes room for the next.  Every few steps a member's trajectory is reduced to what was
 * requested (reductions, states at given times) and dropped, so that memory does not grow with it.
 */
#pragma once

#include "batch/reductions.h"
#include "hybrid/driver.h"

#define MECHC_BATCH_PIECE 48 /* steps between reductions of the trajectory */
#define MECHC_BATCH_COMPONENTS 256 /* components advanced between checks of the stop flag */

typedef struct {
    const mechc_unit *unit;
    mechc_options options; /* t0, t1, tolerances and policy; y0 and p are set for each member */
    mechc_motion scene;    /* its sizes */
    ptrdiff_t count;
    int lockstep; /* whether members run side by side, rather than one by one */
    const double *y0, *p;
    const double *allowed; /* a member each: the gap of a start that is rounding */
    const unsigned char *assembled;
    ptrdiff_t times;
    const double *t_eval;
    int quantities;
    const mechc_quantity *quantity;
    const mechc_quantity *until;     /* the crossing at which a member ends; NULL: none */
    const mechc_given_inputs *given; /* NULL: the scene has no inputs */
    int own;                         /* numbers of inputs that differ between members, */
    const int *place;                /* the signals that they are, */
    const double *numbers;           /* (members, own) */
    int events;
    const mechc_event_functions *functions;
    const mechc_event_policy *policy;
    mechc_contact_laws laws;
    /* Out, a row a member. */
    double *y, *t, *at_times, *p_at_times, *reduced, *least, *event_latest;
    double *forces_at_times; /* generalized, of contacts that last; or NULL */
    int *status;
    long *counts; /* columns: mechc_count; of `least`: mechc_least */
    long *event_counts, *lowered;
    ptrdiff_t next, done;
    int stop;
} mechc_batch;

/* A member that is being integrated. */
typedef struct {
    mechc_batch *batch;
    mechc_hybrid hybrid;
    mechc_reducer reducer, until; /* until: of the crossing that ends the member */
    ptrdiff_t member;  /* -1: none */
    ptrdiff_t reached; /* times of t_eval that it has passed */
    long taken;        /* attempted steps whose results are reduced */
} mechc_batch_slot;

/* The data of one thread. */
typedef struct {
    int width;
    mechc_batch_slot *slot;
    mechc_run **busy;
} mechc_batch_worker;

/* -- what is seen of a member's steps ----------------------------------------------------------- */

/* Write states at the requested times within the kept steps up to `end`; a time equal to `end`
 * counts if no step follows. */
static void mechc_batch_at_times(mechc_batch_slot *slot, double end, int last)
{
    const mechc_batch *batch = slot->batch;
    mechc_motion *motion = &slot->hybrid.motion;
    const ptrdiff_t first = slot->reached, row = slot->member * batch->times;
    const size_t parameters = (size_t)motion->parameters;
    while (slot->reached < batch->times) {
        const double ahead = motion->sense * (batch->t_eval[slot->reached] - end);
        if (ahead > 0.0 || (ahead == 0.0 && !last)) break;
        if (batch->p_at_times)
            memcpy(batch->p_at_times + (row + slot->reached) * motion->parameters, motion->p,
                   parameters * sizeof(double));
        slot->reached++;
    }
    if (slot->reached > first)
        mechc_read_states(motion, slot->reached - first, batch->t_eval + first,
                          batch->at_times + (row + first) * motion->width);
    for (ptrdiff_t i = first; batch->forces_at_times && i < slot->reached; i++)
        if (mechc_is_in_contact(motion)) /* where no contact lasts they stay zero */
            mechc_contact_forces(motion->contacts, batch->t_eval[i],
                                 batch->at_times + (row + i) * motion->width,
                                 batch->forces_at_times + (row + i) * motion->speeds);
}

/* Reduce the kept steps up to a time within the last one, or all for NaN. */
static void mechc_batch_reduce(mechc_batch_slot *slot, double until, int last)
{
    const mechc_trajectory *steps = &slot->hybrid.run->trajectory;
    mechc_reducer_take(&slot->reducer, steps, until);
    mechc_batch_at_times(slot, isnan(until) ? steps->t[steps->count - 1] : until, last);
}

static void mechc_batch_piece_ends(void *context, double until)
{
    mechc_batch_slot *slot = context;
    const mechc_trajectory *steps = &slot->hybrid.run->trajectory;
    mechc_batch_reduce(slot, until, 0);
    mechc_reducer_cut(&slot->reducer, steps, until);
    mechc_reducer_cut(&slot->until, steps, until);
    slot->taken = 0;
}

/* The first crossing at which the member ends, in a step or, where an event has ended the one before it at the
 * same time, at its start. */
static int mechc_batch_until(void *context, ptrdiff_t step, double *zero)
{
    mechc_batch_slot *slot = context;
    mechc_reducer *until = &slot->until;
    slot->hybrid.watch.event[slot->batch->events].count = 0;
    until->samples[MECHC_AS_EVENTS].count = 0; /* of other steps */
    mechc_reduce_step(until, &slot->hybrid.run->trajectory, step, 0, 1.0);
    *zero = until->value[0];
    return until->failed ? -1 : until->known[0];
}

/* -- room --------------------------------------------------------------------------------------- */

static int mechc_batch_slot_make(mechc_batch *batch, mechc_batch_slot *slot)
{
    mechc_hybrid *hybrid = &slot->hybrid;
    const int events = batch->events + (batch->until != 0);
    slot->batch = batch;
    slot->member = -1;
    hybrid->motion = batch->scene;
    hybrid->given = batch->given;
    hybrid->contacts.laws = batch->laws;
    hybrid->max_bytes = HUGE_VAL;
    if (!mechc_hybrid_make(hybrid, events)) return 0;
    hybrid->observer = (mechc_observer){mechc_batch_piece_ends, slot};
    for (int k = 0; k < batch->events; k++) {
        hybrid->watch.functions[k] = batch->functions[k];
        hybrid->watch.policy[k] = batch->policy[k];
    }
    if (batch->until) {
        hybrid->watch.policy[batch->events] = (mechc_event_policy){batch->until->direction, 1, -1};
        hybrid->watch.search = mechc_batch_until;
        hybrid->watch.context = slot;
    }
    if (!mechc_reducer_make(&slot->until, &hybrid->motion, batch->until != 0, batch->until)) return 0;
    return mechc_reducer_make(&slot->reducer, &hybrid->motion, batch->quantities, batch->quantity);
}

static int mechc_batch_worker_make(mechc_batch *batch, mechc_batch_worker *worker)
{
    const int width = batch->lockstep ? batch->unit->lanes : 1;
    worker->slot = calloc((size_t)width, sizeof *worker->slot);
    worker->busy = calloc((size_t)width, sizeof *worker->busy);
    if (!worker->slot || !worker->busy) return 0;
    worker->width = width;
    for (int i = 0; i < width; i++)
        if (!mechc_batch_slot_make(batch, worker->slot + i)) return 0;
    return 1;
}

static void mechc_batch_worker_free(mechc_batch_worker *worker)
{
    for (int i = 0; i < worker->width; i++) {
        mechc_hybrid_free(&worker->slot[i].hybrid);
        mechc_reducer_free(&worker->slot[i].reducer);
        mechc_reducer_free(&worker->slot[i].until);
    }
    free(worker->slot);
    free(worker->busy);
}

/* -- members ------------------------------------------------------------------------------------ */

static void mechc_batch_end(mechc_batch *batch, ptrdiff_t member, int status)
{
    batch->status[member] = status;
    if (status != MECHC_NOT_RUN) __atomic_fetch_add(&batch->done, 1, __ATOMIC_RELAXED);
}

/* Write the results of a motion that has ended. */
static void mechc_batch_report(mechc_batch_slot *slot)
{
    mechc_batch *batch = slot->batch;
    mechc_hybrid *hybrid = &slot->hybrid;
    const ptrdiff_t member = slot->member;
    const double cut = hybrid->live ? mechc_last_piece(hybrid)->cut : NAN;
    const mechc_stats stats = mechc_hybrid_stats(hybrid);
    double *y = batch->y + member * batch->scene.width;
    long *counts = batch->counts + member * MECHC_COUNTS;
    double *least = batch->least + member * MECHC_LEASTS;
    if (hybrid->live) {
        mechc_batch_reduce(slot, cut, 1);
        mechc_reducer_cut(&slot->reducer, &hybrid->run->trajectory, cut);
    }
    const double t = mechc_hybrid_end(hybrid, y);
    mechc_reducer_end(&slot->reducer, t, y, batch->reduced + member * batch->quantities);
    batch->t[member] = t;
    least[MECHC_LEAST_SINGULAR] = stats.least_singular;
    least[MECHC_LEAST_GAP] = stats.critical_gap;
    counts[MECHC_COUNT_STEPS] = stats.steps;
    counts[MECHC_COUNT_REJECTED] = stats.rejected;
    counts[MECHC_COUNT_RHS] = stats.rhs_evaluations;
    counts[MECHC_COUNT_CLOSURE] = stats.closure_iterations;
    counts[MECHC_COUNT_CHANGE_POINTS] =
        hybrid->crossings + (hybrid->live ? mechc_crossings_until(hybrid, cut) : 0);
    for (int k = 0; k < batch->events; k++) {
        batch->event_counts[member * batch->events + k] = hybrid->watch.event[k].count;
        batch->event_latest[member * batch->events + k] = hybrid->watch.event[k].latest;
    }
    if (batch->lowered) batch->lowered[member] = hybrid->contacts.lowered;
}

/* Finish the member whose motion has ended, or was given up because the stop flag is set. */
static void mechc_batch_release(mechc_batch_slot *slot, int status)
{
    mechc_hybrid_drop(&slot->hybrid);
    mechc_batch_end(slot->batch, slot->member, status);
    slot->member = -1;
}

/* Begin the motion of a member; its slot stays free if it ends at once. */
static void mechc_batch_begin(mechc_batch *batch, ptrdiff_t member, mechc_batch_slot *slot)
{
    mechc_options options = batch->options;
    mechc_hybrid *hybrid = &slot->hybrid;
    options.y0 = batch->y0 + member * batch->scene.width;
    if (batch->assembled && !batch->assembled[member]) {
        mechc_batch_end(batch, member, MECHC_NOT_ASSEMBLED);
        return;
    }
    if (!mechc_is_finite(options.y0, batch->scene.width)) {
        mechc_batch_end(batch, member, MECHC_OPEN_AT_START);
        return;
    }
    if (batch->own)
        mechc_motion_inputs_own(batch->given, &hybrid->inputs, batch->own, batch->place,
                                batch->numbers + member * batch->own);
    options.allowed = batch->allowed[member];
    options.p = batch->p + member * batch->scene.parameters;
    slot->member = member;
    slot->reached = 0;
    slot->taken = 0;
    const int status = mechc_hybrid_begin(hybrid, &options);
    hybrid->options.allowed = 0.0; /* a state after an event is taken as it is */
    mechc_reducer_begin(&slot->reducer, options.t0);
    mechc_reducer_begin(&slot->until, options.t0);
    if (status == MECHC_OPEN_AT_START) mechc_batch_release(slot, status);
    else if (!hybrid->live || hybrid->run->trajectory.count < 1) /* not even the start could be kept */
        mechc_batch_release(slot, MECHC_NO_MEMORY);
}

static long mechc_batch_attempts(const mechc_run *run)
{
    return run->stats.steps + run->stats.rejected;
}

/* Put members into the free slots while there are any; returns the number of occupied slots. */
static int mechc_batch_fill(mechc_batch *batch, mechc_batch_worker *worker)
{
    int busy = 0;
    for (int i = 0; i < worker->width; i++) {
        mechc_batch_slot *slot = worker->slot + i;
        while (slot->member < 0 && !__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) {
            const ptrdiff_t next = __atomic_fetch_add(&batch->next, 1, __ATOMIC_RELAXED);
            if (next >= batch->count) break;
            mechc_batch_begin(batch, next, slot);
        }
        if (slot->member >= 0) worker->busy[busy++] = slot->hybrid.run;
    }
    return busy;
}

/* The number of attempted steps until a motion is to be reduced or searched. */
static long mechc_batch_ahead(const mechc_batch *batch, const mechc_batch_worker *worker)
{
    long ahead = MECHC_BATCH_PIECE;
    if (batch->events || batch->until) return 1;
    for (int i = 0; i < worker->width; i++) {
        const mechc_batch_slot *slot = worker->slot + i;
        if (slot->member < 0 || slot->reducer.looks_ahead) continue;
        const long left = MECHC_BATCH_PIECE - (mechc_batch_attempts(slot->hybrid.run) - slot->taken);
        if (left < ahead) ahead = left;
    }
    return ahead > 0 ? ahead : 1;
}

/* Search the steps of motions that have advanced; reduce those that ended or have many steps. */
static void mechc_batch_collect(mechc_batch_worker *worker)
{
    for (int i = 0; i < worker->width; i++) {
        mechc_batch_slot *slot = worker->slot + i;
        mechc_hybrid *hybrid = &slot->hybrid;
        if (slot->member < 0 || hybrid->run->status == MECHC_INTERRUPTED) continue;
        if (hybrid->status == MECHC_RUNNING) mechc_hybrid_take(hybrid);
        if (hybrid->status != MECHC_RUNNING) {
            mechc_batch_report(slot);
            mechc_batch_release(slot, hybrid->status);
        } else if (!slot->reducer.looks_ahead
                   && mechc_batch_attempts(hybrid->run) - slot->taken >= MECHC_BATCH_PIECE) {
            mechc_batch_reduce(slot, NAN, 0);
            mechc_keep_last(&hybrid->run->trajectory);
            hybrid->searched = 0;
            slot->taken = mechc_batch_attempts(hybrid->run);
        }
    }
}

/* Advance by `ahead` attempts, or until a run ends or the stop flag is set.  The wider the system,
 * the fewer attempts, since the cost of a step grows up to the cube of its width. */
static void mechc_batch_advance(mechc_batch *batch, mechc_batch_worker *worker, int busy,
                                long ahead)
{
    const long piece = 1 + MECHC_BATCH_COMPONENTS / batch->scene.width;
    for (long left = ahead; left > 0; left -= piece) {
        const long some = left < piece ? left : piece;
        if (__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) return;
        if (batch->lockstep) batch->unit->advance_lockstep(worker->busy, busy, some);
        else batch->unit->advance(worker->busy[0], some);
        for (int i = 0; i < busy; i++)
            if (worker->busy[i]->status != MECHC_RUNNING) return;
    }
}

/* Process one thread's share of the batch; 0 without memory.  Threads may work side by side. */
static int mechc_batch_work(mechc_batch *batch)
{
    mechc_batch_worker worker = {0};
    const int made = mechc_batch_worker_make(batch, &worker);
    for (int busy; made && (busy = mechc_batch_fill(batch, &worker)) > 0;) {
        if (__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) break;
        mechc_batch_advance(batch, &worker, busy, mechc_batch_ahead(batch, &worker));
        mechc_batch_collect(&worker);
    }
    for (int i = 0; i < worker.width; i++)
        if (worker.slot[i].member >= 0) mechc_batch_release(worker.slot + i, MECHC_NOT_RUN);
    mechc_batch_worker_free(&worker);
    return made;
}
