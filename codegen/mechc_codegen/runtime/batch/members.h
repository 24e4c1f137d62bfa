/* Many runs of one compiled scene, each exactly the run that one trajectory makes.
 *
 * Threads take members from a common counter, as many at a time as run in lockstep; one
 * that ends makes room for the next.  Every few steps a member's trajectory is reduced to what was
 * requested (reductions, states at given times) and dropped, so that memory does not grow with it.
 */
#pragma once

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/codes.h"
#include "abi/model.h"
#include "batch/driven.h"
#include "batch/pieces.h"
#include "batch/reductions.h"

#define MECHC_BATCH_PIECE 48 /* steps between reductions of the trajectory */
#define MECHC_BATCH_COMPONENTS 256 /* components advanced between checks of the stop flag */
#define MECHC_BATCH_STOPPING 6 /* the same, where a crossing may end the run */

typedef struct {
    const mechc_unit *unit;
    mechc_options options; /* t0, t1, tolerances and policy; y0, p, scale are set per member */
    int coordinates, width, parameters;
    ptrdiff_t count;
    int lockstep; /* whether members run side by side, rather than one by one */
    const double *y0, *p, *length;
    const double *allowed; /* a member each: the gap of a start that is rounding */
    const unsigned char *pure, *assembled;
    ptrdiff_t times;
    const double *t_eval;
    int quantities, stopping; /* whether one of them is terminal */
    const mechc_quantity *quantity;
    mechc_batch_inputs inputs;
    mechc_batch_events events;
    /* Out, a row a member. */
    double *y, *t, *at_times, *reduced, *least;
    int *status;
    long *counts; /* columns: mechc_count; of `least`: mechc_least */
    ptrdiff_t next, done;
    int stop;
} mechc_batch;

/* A member under way. */
typedef struct {
    mechc_run *run;
    double *state, *scale, *after;
    mechc_pieces pieces;
    mechc_reducer reducer;
    mechc_slot_inputs inputs;
    int segment; /* of the span, between kinks of the inputs */
    ptrdiff_t member;  /* -1: none */
    ptrdiff_t reached; /* times of t_eval that it has passed */
    long taken;        /* attempted steps whose results are reduced */
} mechc_batch_slot;

/* What one thread works with. */
typedef struct {
    int width;
    mechc_batch_slot *slot;
    mechc_run **busy;
} mechc_batch_worker;

static int mechc_batch_slot_make(const mechc_batch *batch, mechc_batch_slot *slot)
{
    slot->member = -1;
    slot->run = malloc(batch->unit->run_size);
    slot->state = malloc((size_t)batch->width * sizeof(double));
    slot->scale = malloc((size_t)batch->width * sizeof(double));
    slot->after = malloc((size_t)batch->width * sizeof(double));
    const int watched = mechc_pieces_make(&batch->events, batch->unit, &slot->pieces);
    const int made = mechc_reducer_make(&slot->reducer, batch->unit, batch->width,
                                        batch->quantities, batch->quantity);
    const int driven = mechc_slot_inputs_make(&batch->inputs, &slot->inputs);
    return slot->run && slot->state && slot->scale && slot->after && watched && made && driven;
}

static int mechc_batch_worker_make(const mechc_batch *batch, mechc_batch_worker *worker)
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
        free(worker->slot[i].run);
        free(worker->slot[i].state);
        free(worker->slot[i].scale);
        free(worker->slot[i].after);
        mechc_watch_free(&worker->slot[i].pieces.watch);
        mechc_reducer_free(&worker->slot[i].reducer);
        mechc_slot_inputs_free(&worker->slot[i].inputs);
    }
    free(worker->slot);
    free(worker->busy);
}

/* With which the results of a slot's member are read. */
static const mechc_inputs *mechc_batch_whole(const mechc_batch *batch, const mechc_batch_slot *slot)
{
    return mechc_slot_inputs_in(&batch->inputs, &slot->inputs, batch->inputs.segments);
}

static int mechc_batch_is_finite(const mechc_batch *batch, const double *y0)
{
    int finite = 1;
    for (int i = 0; i < batch->width; i++) finite &= fabs(y0[i]) < HUGE_VAL;
    return finite;
}

/* States at the requested times within the steps that are kept, up to `end`; a time equal to `end`
 * counts where no step follows. */
static void mechc_batch_at_times(const mechc_batch *batch, mechc_batch_slot *slot, double end,
                                 int last)
{
    const double direction = batch->options.t1 >= batch->options.t0 ? 1.0 : -1.0;
    const ptrdiff_t first = slot->reached, member = slot->member;
    while (slot->reached < batch->times) {
        const double ahead = direction * (batch->t_eval[slot->reached] - end);
        if (ahead > 0.0 || (ahead == 0.0 && !last)) break;
        slot->reached++;
    }
    if (slot->reached > first)
        batch->unit->interpolate(batch->options.method, &slot->run->trajectory,
                                 batch->p + member * batch->parameters,
                                 mechc_batch_whole(batch, slot), slot->reached - first,
                                 batch->t_eval + first,
                                 batch->at_times + (member * batch->times + first) * batch->width);
}

/* Forget all accepted states but the last. */
static void mechc_batch_drain(mechc_trajectory *steps, int width)
{
    const ptrdiff_t last = steps->count - 1;
    if (last < 1) return;
    steps->dropped[1] = last > 1 ? steps->t[last - 2] : steps->dropped[0];
    steps->dropped[0] = steps->t[last - 1];
    steps->dropped_count = last > 1 ? 2 : steps->dropped_count ? 2 : 1;
    steps->t[0] = steps->t[last];
    memmove(steps->y, steps->y + last * width, (size_t)width * sizeof(double));
    steps->count = 1;
}

/* Change points passed up to the time t. */
static long mechc_batch_crossings(const mechc_batch *batch, const mechc_trajectory *steps, double t)
{
    const double direction = batch->options.t1 >= batch->options.t0 ? 1.0 : -1.0;
    long passed = 0;
    for (ptrdiff_t i = 0; i < steps->crossing_count; i++)
        passed += direction * (steps->crossings[i * (batch->coordinates + 2)] - t) <= 0.0;
    return passed;
}

/* The results of a run that came to its end, or to a terminal crossing. */
static void mechc_batch_report(mechc_batch *batch, mechc_batch_slot *slot)
{
    const ptrdiff_t member = slot->member;
    const mechc_run *run = slot->run;
    const mechc_trajectory *steps = &run->trajectory;
    const mechc_stats all = mechc_pieces_stats(&slot->pieces, &run->stats), *stats = &all;
    const int stopped = !isnan(slot->reducer.stop);
    const double t = stopped ? slot->reducer.stop : run->t;
    double *y = batch->y + member * batch->width;
    long *counts = batch->counts + member * MECHC_COUNTS;
    double *least = batch->least + member * MECHC_LEASTS;
    if (stopped)
        batch->unit->interpolate(batch->options.method, steps,
                                 batch->p + member * batch->parameters,
                                 mechc_batch_whole(batch, slot), 1, &t, y);
    else
        memcpy(y, steps->y + (steps->count - 1) * batch->width,
               (size_t)batch->width * sizeof(double));
    mechc_reducer_end(&slot->reducer, t, y, batch->reduced + member * batch->quantities);
    batch->t[member] = t;
    least[MECHC_LEAST_SINGULAR] = stats->least_singular;
    least[MECHC_LEAST_GAP] = stats->critical_gap;
    counts[MECHC_COUNT_STEPS] = stats->steps;
    counts[MECHC_COUNT_REJECTED] = stats->rejected;
    counts[MECHC_COUNT_RHS] = stats->rhs_evaluations;
    counts[MECHC_COUNT_CLOSURE] = stats->closure_iterations;
    counts[MECHC_COUNT_CHANGE_POINTS] = slot->pieces.crossings
        + (stopped ? mechc_batch_crossings(batch, steps, t) : (long)steps->crossing_count);
    mechc_pieces_report(&batch->events, &slot->pieces, member);
}

static long mechc_batch_attempts(const mechc_run *run)
{
    return run->stats.steps + run->stats.rejected;
}

/* On from a kink of the inputs to the next. */
static void mechc_batch_next_segment(const mechc_batch *batch, mechc_batch_slot *slot)
{
    const mechc_batch_inputs *inputs = &batch->inputs;
    const int segment = ++slot->segment;
    batch->unit->extend(slot->run, inputs->ends[segment],
                        mechc_slot_inputs_in(inputs, &slot->inputs, segment));
}

/* An event ended or reset the motion at `stop`; the status after it. */
static int mechc_batch_jump(mechc_batch *batch, mechc_batch_slot *slot, double stop)
{
    mechc_watch *watch = &slot->pieces.watch;
    const mechc_trajectory *steps = &slot->run->trajectory;
    const int resets = mechc_event_resets(watch, watch->stopped_by);
    mechc_batch_at_times(batch, slot, stop, !resets);
    if (!resets) {
        slot->reducer.stop = stop;
        return MECHC_STOPPED_BY_EVENT;
    }
    batch->unit->interpolate(batch->options.method, steps, watch->p, watch->inputs, 1, &stop,
                             slot->state);
    memcpy(slot->after, slot->state, (size_t)batch->width * sizeof(double));
    const int code = mechc_watch_reset(watch, stop, slot->after);
    if (code != MECHC_RUNNING && code != MECHC_RESETS_ACCUMULATE) {
        slot->reducer.stop = stop;
        return code;
    }
    mechc_reducer_jump(&slot->reducer, stop, slot->state, slot->after);
    const double direction = batch->options.t1 >= batch->options.t0 ? 1.0 : -1.0;
    const int segment = mechc_segment_from(&batch->inputs, stop, direction);
    const int status =
        mechc_pieces_next(&slot->pieces, slot->run, stop, slot->after, code,
                          mechc_batch_crossings(batch, steps, stop),
                          mechc_slot_inputs_in(&batch->inputs, &slot->inputs, segment));
    slot->taken = 0;
    slot->segment = segment;
    if (status == MECHC_RUNNING && segment + 1 < batch->inputs.segments) {
        slot->segment--;
        mechc_batch_next_segment(batch, slot);
    }
    if (slot->run->trajectory.count < 1) return MECHC_NO_MEMORY;
    if (status != MECHC_RUNNING) mechc_batch_at_times(batch, slot, stop, 1);
    return status;
}

/* Reduce the steps that are kept; the status after them. */
static int mechc_batch_take(mechc_batch *batch, mechc_batch_slot *slot)
{
    mechc_trajectory *steps = &slot->run->trajectory;
    double end = steps->t[steps->count - 1], jump = NAN;
    int status = slot->run->status;
    slot->taken = mechc_batch_attempts(slot->run);
    const int event = mechc_pieces_look(&batch->events, &slot->pieces, steps, &jump);
    mechc_reducer_take(&slot->reducer, steps, jump);
    if (event == MECHC_STOPPED_BY_EVENT) return mechc_batch_jump(batch, slot, jump);
    if (event != MECHC_RUNNING) status = event;
    if (!isnan(slot->reducer.stop)) {
        end = slot->reducer.stop;
        status = MECHC_STOPPED_BY_EVENT;
    }
    const int more = status == MECHC_FINISHED && slot->segment + 1 < batch->inputs.segments;
    mechc_batch_at_times(batch, slot, end, status != MECHC_RUNNING && !more);
    if (status == MECHC_RUNNING || more) mechc_batch_drain(steps, batch->width);
    if (!more) return status;
    mechc_batch_next_segment(batch, slot);
    return MECHC_RUNNING;
}

static void mechc_batch_end(mechc_batch *batch, ptrdiff_t member, int status)
{
    batch->status[member] = status;
    if (status != MECHC_NOT_RUN) __atomic_fetch_add(&batch->done, 1, __ATOMIC_RELAXED);
}

/* The member's run has ended, or is given up since the stop flag was set. */
static void mechc_batch_release(mechc_batch *batch, mechc_batch_slot *slot, int status)
{
    batch->unit->release(slot->run);
    mechc_batch_end(batch, slot->member, status);
    slot->member = -1;
}

/* Begin a member's run; it is not under way where it ended at once. */
static void mechc_batch_begin(mechc_batch *batch, ptrdiff_t member, mechc_batch_slot *slot)
{
    mechc_options options = batch->options;
    if (batch->assembled && !batch->assembled[member]) {
        mechc_batch_end(batch, member, MECHC_NOT_ASSEMBLED);
        return;
    }
    options.y0 = batch->y0 + member * batch->width;
    if (!mechc_batch_is_finite(batch, options.y0)) {
        mechc_batch_end(batch, member, MECHC_OPEN_AT_START);
        return;
    }
    mechc_slot_inputs_of(&batch->inputs, member, &slot->inputs);
    for (int i = 0; i < batch->width; i++)
        slot->scale[i] = batch->pure[i] ? 1.0 : batch->length[member];
    options.allowed = batch->allowed[member];
    options.p = batch->p + member * batch->parameters;
    options.scale = slot->scale;
    options.inputs = mechc_slot_inputs_in(&batch->inputs, &slot->inputs, 0);
    batch->unit->start(slot->run, &options);
    slot->member = member;
    if (slot->run->status == MECHC_OPEN_AT_START) {
        mechc_batch_release(batch, slot, MECHC_OPEN_AT_START);
        return;
    }
    options.allowed = 0.0; /* a state after an event is taken as it is */
    options.inputs = mechc_batch_whole(batch, slot);
    mechc_reducer_begin(&slot->reducer, &options);
    mechc_pieces_begin(&batch->events, &slot->pieces, &options, slot->run);
    slot->segment = batch->inputs.segments > 1 ? -1 : 0;
    if (slot->segment < 0) mechc_batch_next_segment(batch, slot);
    slot->reached = 0;
    slot->taken = 0;
    if (slot->run->trajectory.count < 1) /* not even the start could be kept */
        mechc_batch_release(batch, slot, MECHC_NO_MEMORY);
}

/* Put members into the slots that are free, while there are some; how many are under way. */
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
        if (slot->member >= 0) worker->busy[busy++] = slot->run;
    }
    return busy;
}

/* Attempted steps until the results of some run are to be reduced. */
static long mechc_batch_ahead(const mechc_batch_worker *worker, long piece)
{
    long ahead = piece;
    for (int i = 0; i < worker->width; i++) {
        const mechc_batch_slot *slot = worker->slot + i;
        if (slot->member < 0) continue;
        const long left = piece - (mechc_batch_attempts(slot->run) - slot->taken);
        if (left < ahead) ahead = left;
    }
    return ahead > 0 ? ahead : 1;
}

/* Reduce the steps of runs that have ended or have made enough of them.  Which steps are reduced
 * together must not depend on other members where a crossing among them ends the run. */
static void mechc_batch_collect(mechc_batch *batch, mechc_batch_worker *worker, long piece)
{
    for (int i = 0; i < worker->width; i++) {
        mechc_batch_slot *slot = worker->slot + i;
        if (slot->member < 0 || slot->run->status == MECHC_INTERRUPTED) continue;
        const int whole = mechc_batch_attempts(slot->run) - slot->taken >= piece;
        if (batch->stopping && !whole && slot->run->status == MECHC_RUNNING) continue;
        const int status = mechc_batch_take(batch, slot);
        if (status == MECHC_RUNNING) continue;
        mechc_batch_report(batch, slot);
        mechc_batch_release(batch, slot, status);
    }
}

/* Advance by `ahead` attempts, or until a run ends or the stop flag is set.  Pieces are shorter the
 * wider the system, since the cost of a step grows up to the cube of its width. */
static void mechc_batch_advance(mechc_batch *batch, mechc_batch_worker *worker, int busy,
                                long ahead)
{
    const long piece = 1 + MECHC_BATCH_COMPONENTS / batch->width;
    for (long left = ahead; left > 0; left -= piece) {
        const long some = left < piece ? left : piece;
        if (__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) return;
        if (batch->lockstep) batch->unit->advance_lockstep(worker->busy, busy, some);
        else batch->unit->advance(worker->busy[0], some);
        for (int i = 0; i < busy; i++)
            if (worker->busy[i]->status != MECHC_RUNNING) return;
    }
}

/* One thread's share of the batch; 0 without memory.  Any number may work at once. */
static int mechc_batch_work(mechc_batch *batch)
{
    mechc_batch_worker worker = {0};
    const long piece = batch->stopping ? MECHC_BATCH_STOPPING : MECHC_BATCH_PIECE;
    const int made = mechc_batch_worker_make(batch, &worker);
    for (int busy; made && (busy = mechc_batch_fill(batch, &worker)) > 0;) {
        if (__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) break;
        mechc_batch_advance(batch, &worker, busy, mechc_batch_ahead(&worker, piece));
        mechc_batch_collect(batch, &worker, piece);
    }
    for (int i = 0; i < worker.width; i++)
        if (worker.slot[i].member >= 0)
            mechc_batch_release(batch, worker.slot + i, MECHC_NOT_RUN);
    mechc_batch_worker_free(&worker);
    return made;
}
