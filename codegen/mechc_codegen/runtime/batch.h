/* Many runs of one compiled scene, each exactly the run that one trajectory makes.
 *
 * Threads take blocks of members from a common counter.  A member's trajectory is drained every
 * few steps into what was asked for (reductions, states at given times), so that memory does not
 * grow with its length.
 */
#ifndef MECHC_BATCH_H
#define MECHC_BATCH_H

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model.h"
#include "batch_reduce.h"

#define MECHC_BATCH_PIECE 48 /* steps between drains and looks at the stop flag */
#define MECHC_BATCH_COUNTS 5

/* Statuses of members beside those of runs. */
enum { MECHC_NOT_RUN = 0, MECHC_NOT_ASSEMBLED = 112, MECHC_OPEN_AT_START = 111 };

typedef struct {
    const mechc_unit *unit;
    mechc_options options; /* t0, t1, tolerances and policy; y0, p, scale are set per member */
    int coordinates, width, parameters;
    double open_at_most; /* closure gap of a start that is rounding, of the model's length */
    ptrdiff_t count, block;
    const double *y0, *p, *length;
    const unsigned char *pure, *assembled;
    ptrdiff_t times;
    const double *t_eval;
    int quantities;
    const mechc_quantity *quantity;
    /* Out, a row a member. */
    double *y, *t, *at_times, *reduced, *least;
    int *status;
    long *counts; /* steps, rejected, rhs evaluations, closure iterations, change points */
    ptrdiff_t next, done;
    int stop;
} mechc_batch;

/* What one thread works with. */
typedef struct {
    mechc_run *run;
    double *state, *scale;
    mechc_reducer reducer;
} mechc_batch_worker;

static int mechc_batch_worker_make(const mechc_batch *batch, mechc_batch_worker *worker)
{
    worker->run = malloc(batch->unit->run_size);
    worker->state = malloc((size_t)batch->width * sizeof(double));
    worker->scale = malloc((size_t)batch->width * sizeof(double));
    const int made = mechc_reducer_make(&worker->reducer, batch->unit, batch->width,
                                        batch->quantities, batch->quantity);
    return worker->run && worker->state && worker->scale && made;
}

static void mechc_batch_worker_free(mechc_batch_worker *worker)
{
    free(worker->run);
    free(worker->state);
    free(worker->scale);
    mechc_reducer_free(&worker->reducer);
}

/* Whether the start is on the constraints but for rounding; it is moved onto them. */
static int mechc_batch_start_state(const mechc_batch *batch, ptrdiff_t member, double *state)
{
    const double *y0 = batch->y0 + member * batch->width;
    const double *p = batch->p + member * batch->parameters;
    const double allowed = batch->open_at_most * batch->length[member];
    double moved[2], fastest = 1.0;
    memcpy(state, y0, (size_t)batch->width * sizeof(double));
    for (int i = 0; i < batch->width; i++) {
        if (!(fabs(y0[i]) < HUGE_VAL)) return 0;
        if (i >= batch->coordinates) fastest = fmax(fastest, fabs(y0[i]));
    }
    batch->unit->project(batch->options.t0, state, p, moved);
    return moved[0] <= allowed && moved[1] <= allowed * fastest;
}

/* States at the asked times that lie in the steps at hand; a time on the last of these belongs to
 * the steps that follow, if any do. */
static void mechc_batch_at_times(const mechc_batch *batch, ptrdiff_t member,
                                 const mechc_trajectory *steps, int last, ptrdiff_t *reached)
{
    const double direction = batch->options.t1 >= batch->options.t0 ? 1.0 : -1.0;
    const double end = steps->t[steps->count - 1];
    const ptrdiff_t first = *reached;
    while (*reached < batch->times) {
        const double ahead = direction * (batch->t_eval[*reached] - end);
        if (ahead > 0.0 || (ahead == 0.0 && !last)) break;
        ++*reached;
    }
    if (*reached > first)
        batch->unit->interpolate(batch->options.method, steps,
                                 batch->p + member * batch->parameters, *reached - first,
                                 batch->t_eval + first,
                                 batch->at_times + (member * batch->times + first) * batch->width);
}

/* Forget all accepted states but the last. */
static void mechc_batch_drain(mechc_trajectory *steps, int width)
{
    const ptrdiff_t last = steps->count - 1;
    if (last < 1) return;
    steps->t[0] = steps->t[last];
    memmove(steps->y, steps->y + last * width, (size_t)width * sizeof(double));
    steps->count = 1;
}

static void mechc_batch_report(mechc_batch *batch, ptrdiff_t member, const mechc_run *run)
{
    const mechc_stats *stats = &run->stats;
    long *counts = batch->counts + member * MECHC_BATCH_COUNTS;
    batch->t[member] = run->t;
    batch->least[2 * member] = stats->least_singular;
    batch->least[2 * member + 1] = stats->critical_gap;
    counts[0] = stats->steps;
    counts[1] = stats->rejected;
    counts[2] = stats->rhs_evaluations;
    counts[3] = stats->closure_iterations;
    counts[4] = run->trajectory.passage_count;
}

/* Run one member to its end; 0 where the stop flag came first. */
static int mechc_batch_run(mechc_batch *batch, ptrdiff_t member, mechc_batch_worker *worker)
{
    mechc_options options = batch->options;
    mechc_run *run = worker->run;
    ptrdiff_t reached = 0;
    int status = MECHC_RUNNING;
    for (int i = 0; i < batch->width; i++)
        worker->scale[i] = batch->pure[i] ? 1.0 : batch->length[member];
    options.y0 = worker->state;
    options.p = batch->p + member * batch->parameters;
    options.scale = worker->scale;
    memset(run, 0, batch->unit->run_size);
    batch->unit->start(run, &options);
    mechc_reducer_begin(&worker->reducer, options.t0, options.p);
    do {
        status = batch->unit->advance(run, MECHC_BATCH_PIECE);
        if (__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) break;
        mechc_batch_at_times(batch, member, &run->trajectory, status != MECHC_RUNNING, &reached);
        mechc_reducer_take(&worker->reducer, &run->trajectory);
        mechc_batch_drain(&run->trajectory, batch->width);
    } while (status == MECHC_RUNNING);
    if (status != MECHC_RUNNING) {
        mechc_batch_report(batch, member, run);
        memcpy(batch->y + member * batch->width, run->trajectory.y,
               (size_t)batch->width * sizeof(double));
        mechc_reducer_end(&worker->reducer, &run->trajectory,
                          batch->reduced + member * batch->quantities);
    }
    batch->unit->release(run);
    batch->status[member] = status;
    return status != MECHC_RUNNING;
}

static void mechc_batch_member(mechc_batch *batch, ptrdiff_t member, mechc_batch_worker *worker)
{
    if (batch->assembled && !batch->assembled[member]) {
        batch->status[member] = MECHC_NOT_ASSEMBLED;
    } else if (!mechc_batch_start_state(batch, member, worker->state)) {
        batch->status[member] = MECHC_OPEN_AT_START;
    } else if (!mechc_batch_run(batch, member, worker)) {
        batch->status[member] = MECHC_NOT_RUN;
        return;
    }
    __atomic_fetch_add(&batch->done, 1, __ATOMIC_RELAXED);
}

/* One thread's share of the batch; 0 without memory.  Any number may work at once. */
static int mechc_batch_work(mechc_batch *batch)
{
    mechc_batch_worker worker = {0};
    const int made = mechc_batch_worker_make(batch, &worker);
    while (made) {
        const ptrdiff_t first = __atomic_fetch_add(&batch->next, batch->block, __ATOMIC_RELAXED);
        if (first >= batch->count) break;
        for (ptrdiff_t i = first; i < first + batch->block && i < batch->count; i++) {
            if (__atomic_load_n(&batch->stop, __ATOMIC_RELAXED)) break;
            mechc_batch_member(batch, i, &worker);
        }
    }
    mechc_batch_worker_free(&worker);
    return made;
}

#endif
