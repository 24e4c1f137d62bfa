/* One scene under the sanitizers: runs one by one, batches alone and in lockstep by two threads,
 * closings, and outputs called as C functions.  Reads N_MEMBERS starts and parameters. */

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "scene_sizes.h"
#include "abi/call.h"
#include "abi/codes.h"
#include "abi/large_stack.h"
#include "abi/model.h"

#ifndef MECHC_TAYLOR_SERIES
#define MECHC_TAYLOR_SERIES 0
#endif
#include "batch/members.h"
#include "closing/search.h"
#include "closing/speeds.h"

extern const mechc_model mechc_scene;

#define NX (MECHC_NQ + MECHC_NU)
#define N N_MEMBERS
#define TIMES 3
#define QUANTITIES 6

static double *heap(size_t doubles) /* of exactly that size, so that one more is seen */
{
    double *array = calloc(doubles + !doubles, sizeof(double));
    if (!array) exit(3);
    return array;
}

static double *read_doubles(size_t count)
{
    double *array = heap(count);
    if (fread(array, sizeof(double), count, stdin) != count) exit(4);
    return array;
}

static mechc_options options_of(int method)
{
    mechc_options options;
    memset(&options, 0, sizeof options);
    options.t1 = SECONDS;
    options.rtol = 1e-6;
    options.max_step = HUGE_VAL;
    options.max_steps = 20000;
    options.method = method;
    options.dense = 1;
    options.when_stiff = MECHC_RADAU5;
    return options;
}

static void alone(const mechc_unit *unit, int method, const double *y0, const double *p, double *end,
                  int *status)
{
    double *scale = heap(NX), times[2] = {0.0, 0.5 * SECONDS}, *middle = heap(2 * NX);
    mechc_options options = options_of(method);
    for (int i = 0; i < NX; i++) scale[i] = 1.0;
    double moved[2], *state = heap(NX); /* as a batch and model.simulate begin: on the constraints */
    memcpy(state, y0, NX * sizeof(double));
    unit->project(0.0, state, p, NULL, moved);
    options.y0 = state, options.p = p, options.scale = scale;
    mechc_run *run = calloc(1, unit->run_size);
    unit->start(run, &options);
    while (unit->advance(run, 5) == MECHC_RUNNING) {}
    memcpy(end, run->trajectory.y + (run->trajectory.count - 1) * NX, NX * sizeof(double));
    *status = run->status;
    unit->interpolate(method, &run->trajectory, p, NULL, 2, times, middle);
    unit->release(run);
    free(run), free(scale), free(middle), free(state);
}

static void work(void *batch)
{
    if (!mechc_batch_work(batch)) exit(6);
}

static void *work_in_thread(void *batch)
{
    if (!mechc_with_stack(mechc_stack_of(NX), work, batch)) exit(7);
    return 0;
}

static void together(const mechc_unit *unit, int method, int lockstep, int stop, const double *y0,
                     const double *p, double *end, int *status)
{
    const double t_eval[TIMES] = {0.0, 0.3 * SECONDS, SECONDS};
    double allowed[N], *pieces = heap(N * TIMES * NX), *t = heap(N);
    double *least = heap(N * MECHC_LEASTS);
    double *reduced = heap(N * QUANTITIES);
    long *counts = calloc(N * MECHC_COUNTS, sizeof(long));
    unsigned char pure[NX];
    mechc_quantity quantity[QUANTITIES];
    mechc_batch batch;
    pthread_t threads[2];
    memset(&batch, 0, sizeof batch);
    memset(quantity, 0, sizeof quantity);
    for (int i = 0; i < N; i++) allowed[i] = 1e-6;
    memset(pure, 1, sizeof pure);
    for (int i = 0; i < QUANTITIES; i++) {
        quantity[i].reduction = i < 5 ? i : 0;
        quantity[i].form = i < 5 ? 0 : 2; /* the last: the norm of an output */
        quantity[i].output = i < 3 ? -1 : 0;
        quantity[i].second = -1;
        quantity[i].level = 0.1;
    }
    batch.unit = unit, batch.options = options_of(method);
    batch.scene.unit = unit, batch.scene.coordinates = MECHC_NQ, batch.scene.speeds = MECHC_NU;
    batch.scene.rows = MECHC_NC, batch.scene.parameters = MECHC_NP, batch.scene.width = NX;
    batch.scene.sizes.dimensionless = pure, batch.options.stop = &batch.stop;
    batch.allowed = allowed, batch.count = N, batch.lockstep = lockstep;
    batch.y0 = y0, batch.p = p;
    batch.times = TIMES, batch.t_eval = t_eval;
    batch.quantities = QUANTITIES, batch.quantity = quantity;
    batch.y = end, batch.t = t, batch.at_times = pieces, batch.reduced = reduced;
    batch.least = least, batch.status = status, batch.counts = counts, batch.stop = stop;
    for (int i = 0; i < 2; i++)
        if (pthread_create(&threads[i], 0, work_in_thread, &batch)) exit(8);
    for (int i = 0; i < 2; i++) pthread_join(threads[i], 0);
    free(pieces), free(t), free(least), free(reduced), free(counts);
}

static int output_of(const mechc_unit *unit, const char *name)
{
    for (int i = 0; i < unit->output_count; i++)
        if (!strcmp(unit->outputs[i].name, name)) return i;
    return -1;
}

static int breadth_of(const mechc_unit *unit, int output)
{
    return output < 0 ? 0 : unit->outputs[output].width;
}

static mechc_closure closure_of(const mechc_unit *unit, const unsigned char *kind,
                                const int *alike)
{
    const char *names[] = {"constraints", "constraint_gradient", "velocity_constraints",
                           "constraint_jacobian", "preference", "cut_directions"};
    _Static_assert(sizeof names == MECHC_CLOSURE_OUTPUTS * sizeof *names, "a name for each");
    mechc_closure closure;
    memset(&closure, 0, sizeof closure);
    for (int what = 0; what < MECHC_CLOSURE_OUTPUTS; what++) {
        closure.output[what] = output_of(unit, names[what]);
        if (what == MECHC_GRADIENT && closure.output[what] < 0)
            closure.output[what] = output_of(unit, names[MECHC_JACOBIAN]);
        closure.breadth[what] = breadth_of(unit, closure.output[what]);
    }
    closure.unit = unit, closure.kind = kind, closure.alike = alike;
    closure.rows = mechc_scene.holonomic;
    closure.columns = output_of(unit, "constraint_gradient") < 0 ? MECHC_NU : MECHC_NQ;
    closure.coordinates = MECHC_NQ, closure.width = NX, closure.parameters = MECHC_NP;
    return closure;
}

/* Closed from starts spread over all configurations, and again from a guess. */
static void close_all(const mechc_unit *unit, const double *y0, const double *p)
{
    if (mechc_scene.holonomic < 1 || MECHC_NQ < 2) return;
    enum { UNKNOWNS = MECHC_NQ - 1, STARTS = 10, MOST = 4 };
    int unknown[MECHC_NQ], alike[MECHC_AT_LEAST_ONE(MECHC_NH)], many[N];
    unsigned char kind[MECHC_NQ], guessed[MECHC_NQ];
    double *start = heap(STARTS * UNKNOWNS), *fixed = heap(N * MECHC_NQ), length[N], miss[N];
    double *found = heap((size_t)N * MOST * MECHC_NQ), *open = heap(N * MECHC_NQ);
    for (int i = 0; i < UNKNOWNS; i++) unknown[i] = i + 1, guessed[i] = i % 2 == 0;
    for (int i = 0; i < mechc_scene.holonomic; i++) alike[i] = i;
    for (int i = 0; i < MECHC_NQ; i++) kind[i] = i % 3 ? MECHC_ANGLE : MECHC_TRANSLATION;
    for (int i = 0; i < STARTS * UNKNOWNS; i++) start[i] = sin(1.0 + 7.0 * i);
    for (int i = 0; i < N; i++) {
        length[i] = 1.0;
        memcpy(fixed + i * MECHC_NQ, y0 + i * NX, MECHC_NQ * sizeof(double));
    }
    for (int way = 0; way < 3; way++) {
        mechc_closing job;
        memset(&job, 0, sizeof job);
        job.closure = closure_of(unit, kind, alike);
        job.unknowns = UNKNOWNS, job.unknown = unknown;
        job.guessed = way ? guessed : 0, job.near = 3, job.only_near = way == 2;
        job.starts = STARTS, job.start = start, job.count = N, job.block = 3, job.fixed = fixed;
        job.p = p, job.length = length, job.most = MOST, job.found = found, job.many = many;
        job.miss = miss, job.open = open, job.tells_miss = 1, job.enough = way;
        mechc_closer *closer = mechc_closer_make(&job);
        while (mechc_close_go_on(&job, closer, 1e-4)) {}
        if (job.done != N) exit(9);
        mechc_closer_free(closer);
    }
    free(start), free(fixed), free(found), free(open);
}

static void keep_speeds(const mechc_unit *unit, const double *y0, const double *p)
{
    int unknown[MECHC_NU + 1], row[N];
    double left[N], residual[N], conditioning[N];
    mechc_speeds_job job;
    if (mechc_scene.rows < 1) return;
    double *y = heap(N * NX);
    memset(&job, 0, sizeof job);
    memcpy(y, y0, N * NX * sizeof(double));
    for (int i = 0; i < MECHC_NU; i++) unknown[i] = i;
    job.closure = closure_of(unit, NULL, NULL), job.rows = mechc_scene.rows, job.speeds = MECHC_NU;
    job.unknowns = MECHC_NU, job.unknown = unknown, job.dead = 1e-7, job.count = N, job.p = p;
    job.p_stride = MECHC_NP, job.y = y, job.left = left, job.row = row, job.residual = residual;
    job.conditioning = conditioning;
    if (!mechc_speeds_work(&job)) exit(12);
    free(y);
}

/* Every output as a C function, and each of its components along every argument. */
static void call_all(const mechc_unit *unit, const double *y, const double *p)
{
    for (int output = -1; output < unit->output_count; output++) {
        mechc_bound *bound = mechc_bind(&mechc_scene, unit, output, p, NULL);
        const int width = bound->width;
        double *out = heap((size_t)width);
        mechc_call(0.1, y, out, bound);
        free(bound);
        for (int place = -1; place < NX; place++) {
            const int places[1] = {place}, last = width - 1;
            double x[1] = {place < 0 ? 0.1 : y[place]};
            if (!width) break;
            mechc_along *along = mechc_follow(mechc_bind(&mechc_scene, unit, output, p, NULL), last, 1,
                                              places, y, 0.1);
            const double value = mechc_call_along(1, x, along);
            if (value != out[last] && !isnan(value)) exit(10);
            if (!isnan(mechc_call_along(2, x, along))) exit(11);
            mechc_let_go(along);
        }
        free(out);
    }
}

static int in_lockstep(int method)
{
    return method == MECHC_DOP853 || method == MECHC_TAYLOR || method == MECHC_GAUSS8_LOCKSTEP;
}

int main(int count, char **arguments)
{
    const mechc_unit *unit = mechc_scene.select(count > 1 ? arguments[1] : 0);
    if (!unit) return 77;
    double *y0 = read_doubles(N * NX), *p = read_doubles(N * MECHC_NP);
    for (int method = 0; method < N_METHODS; method++) {
        if (method == MECHC_TAYLOR && !MECHC_TAYLOR_SERIES) continue;
        double *one = heap(N * NX), *many = heap(N * NX);
        int ended[N], status[N], differ = 0;
        for (int i = 0; i < N; i++)
            alone(unit, method, y0 + i * NX, p + i * MECHC_NP, one + i * NX, &ended[i]);
        for (int lockstep = 0; lockstep < 1 + in_lockstep(method); lockstep++) {
            together(unit, method, lockstep, 0, y0, p, many, status);
            for (int i = 0; i < N; i++)
                if (ended[i] == MECHC_FINISHED && status[i] == MECHC_FINISHED)
                    differ += !!memcmp(one + i * NX, many + i * NX, NX * sizeof(double));
            int finished = 0;
            for (int i = 0; i < N; i++) finished += status[i] == MECHC_FINISHED;
            printf("method %d lockstep %d finished %d differ %d\n", method, lockstep, finished,
                   differ);
        }
        together(unit, method, method == 1, 1, y0, p, many, status);
        free(one), free(many);
    }
    close_all(unit, y0, p);
    keep_speeds(unit, y0, p);
    call_all(unit, y0, p);
    free(y0), free(p);
    return 0;
}
