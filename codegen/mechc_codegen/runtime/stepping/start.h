/* The start of a run: options, scales and the first step. */
#pragma once

#include "stepping/crossings.h"
#include "stepping/switches.h"

/* Speeds that tell a scale, as a fraction of the fastest or of one unit of the coordinate a run: slower ones
 * do not. */
#define MECHC_LEAST_SPEED 1e-3

/* Raise the scales of the speeds to what forces that grow with the time alone reach within an Euler step. */
MECHC_RARE void mechc_scale_by_time(mechc_integration *run, double euler)
{
    double y[MECHC_NX_MAX], rates[MECHC_NX_MAX];
    memcpy(y, run->y, MECHC_NX * sizeof *y);
    if (mechc_rates_at(run, run->head.t + run->direction * euler, y, rates) != MECHC_RUNNING) return;
    for (int i = MECHC_NQ; i < MECHC_NX; i++)
        run->scale[i] = mechc_max(run->scale[i], 0.5 * euler * fabs(rates[i] - MECHC_RATE(run, 0)[i]));
}

/* Scales of the speeds before any is known: what the first accelerations reach within one unit of the
 * coordinate, or before they change by themselves, as an Euler step of the given length tells; never
 * nothing. */
MECHC_STATIC void mechc_first_scale(mechc_integration *run, const double *scale, double euler)
{
    double largest = 0.0;
    int changes = 0; /* whether that limits the largest */
    for (int i = 0; i < MECHC_NX; i++) run->scale[i] = scale[i];
    for (int i = MECHC_NQ; i < MECHC_NX; i++) {
        const double first = fabs(MECHC_RATE(run, 0)[i]);
        const double change = euler > 0.0 ? fabs(MECHC_RATE(run, 1)[i] - MECHC_RATE(run, 0)[i]) : 0.0;
        const double unit = sqrt(first * scale[i]);
        const int limited = euler * first * first < unit * change;
        run->scale[i] = mechc_max(fabs(run->y[i]), limited ? euler * first * first / change : unit);
        if (run->outer) run->scale[i] = mechc_max(run->scale[i], run->outer->sizes[i]);
        if (run->scale[i] > largest * scale[i]) {
            largest = run->scale[i] / scale[i];
            changes = limited;
        }
    }
    const double span = fabs(run->t1 - run->head.t);
    if (changes) mechc_scale_by_time(run, euler);
    for (int i = MECHC_NQ; i < MECHC_NX; i++) largest = mechc_max(largest, run->scale[i] / scale[i]);
    for (int i = MECHC_NQ; i < MECHC_NX; i++) {
        run->scale[i] = mechc_max(run->scale[i], scale[i] * (largest > 0.0 ? MECHC_LEAST_SPEED * largest : 1.0));
        /* a motion may rest until an input sets in, so speeds that within the span would not move anything
         * by a thousandth of its unit say nothing about later speeds */
        if (MECHC_NI > 0) run->scale[i] = mechc_max(run->scale[i], MECHC_LEAST_SPEED * scale[i] / span);
    }
}

#if MECHC_NI_MAX > 0
/* Change the inputs at the time that the run has reached. */
MECHC_STATIC void mechc_change_inputs(mechc_integration *run, const mechc_inputs *inputs)
{
    run->given.inputs[0] = inputs;
    for (int i = 0; i < MECHC_METHODS; i++)
        if (run->work[i] && run->methods[i]->renew) run->methods[i]->renew(run);
    memset(run->switches.at_start, 0, sizeof run->switches.at_start); /* zeros at the state reached */
    run->regular = 0;
    run->head.status = mechc_rates_at(run, run->head.t, run->y, MECHC_RATE(run, 0));
}
#endif

/* The time of recorded state i; below 0 the time of a dropped state, -1 the last of them. */
MECHC_STATIC double mechc_time_of(const mechc_trajectory *kept, ptrdiff_t i)
{
    return i < 0 ? kept->dropped[-1 - i] : kept->t[i];
}

MECHC_RARE void mechc_integration_extend(mechc_run *head, double t1, const mechc_inputs *inputs)
{
    mechc_integration *run = (mechc_integration *)head;
    const mechc_trajectory *kept = &head->trajectory;
    if (head->status != MECHC_RUNNING && head->status != MECHC_FINISHED) return;
    run->t1 = t1;
    /* of two steps: the last may have been cut short */
    for (ptrdiff_t i = kept->count - 1; i > -kept->dropped_count && i > kept->count - 3; i--)
        run->step = mechc_max(run->step, fabs(mechc_time_of(kept, i) - mechc_time_of(kept, i - 1)));
    head->status = MECHC_RUNNING;
#if MECHC_NI_MAX > 0
    if (inputs) mechc_change_inputs(run, inputs);
#else
    (void)inputs;
#endif
}

/* Adopt the options. */
MECHC_STATIC void mechc_take_options(mechc_integration *run, const mechc_options *options)
{
    mechc_run *head = &run->head;
    run->number = options->method;
    run->t1 = options->t1;
    run->direction = options->t1 >= options->t0 ? 1.0 : -1.0;
    run->rtol = options->rtol;
    run->has_tolerances = options->atol != 0;
    run->max_step = options->max_step;
    run->limits = options->limits;
    run->outer = options->outer;
    run->max_steps = options->max_steps;
    run->on_change_point = options->on_change_point;
    run->when_stiff = options->when_stiff;
    run->allowed = 1.0;
    if (options->atol) memcpy(run->tolerance, options->atol, MECHC_NX * sizeof *run->tolerance);
    head->t = options->t0;
    head->stats.least_singular = head->stats.critical_gap = HUGE_VAL;
    head->stats.coordinate = -1;
    head->trajectory.width = MECHC_NX;
    head->trajectory.last_only = options->last_only;
}

MECHC_STATIC void mechc_give_options(mechc_integration *run, const mechc_options *options)
{
    mechc_give_at(options->t0, run->y, options->p, options->inputs, options->stop, &run->given);
}

/* Adopt the start with its parameters and inputs; 0 if it is refused.  Constants are computed again
 * only if it is moved. */
MECHC_STATIC int mechc_take_start(mechc_integration *run, const mechc_options *options)
{
    const int closes = MECHC_NC > 0 && options->allowed > 0.0;
    memcpy(run->y, options->y0, MECHC_NX * sizeof *run->y);
    if (closes) {
        mechc_give_options(run, options);
        double moved[2], fastest = 1.0;
        for (int i = MECHC_NQ; i < MECHC_NX; i++) fastest = mechc_max(fastest, fabs(run->y[i]));
        mechc_project_state(options->t0, run->y, &run->given, moved);
        if (!(moved[0] <= options->allowed && moved[1] <= options->allowed * fastest)) return 0;
    }
    if (!run->outer) mechc_take_turns(run->y, run->turns);
    int moved = 0;
    for (int i = 0; i < MECHC_NQ; i++) moved |= run->y[i] != options->y0[i];
    if (moved || !closes) mechc_give_options(run, options);
    return 1;
}

/* The number of rows of the dense output: of the requested method, and of others that may take part. */
MECHC_STATIC void mechc_count_dense_rows(mechc_integration *run, int dense)
{
    const int others = MECHC_NH > 0 || run->when_stiff;
    const mechc_method *method = run->method;
    run->most_dense = method->rows_of ? method->rows_of(run) : method->dense_rows;
    for (int i = 0; others && i < MECHC_METHODS; i++) {
        const mechc_method *other = run->methods[i];
        if (other && !other->rows_of && other->dense_rows > run->most_dense) run->most_dense = other->dense_rows;
    }
    run->head.trajectory.dense_rows = dense ? run->most_dense : 0;
}

#if MECHC_NH_MAX > 0
/* Of the angle that a first step beside a crossing covers: its nodes are to be far from it. */
#define MECHC_FIRST_MOVE 0.3

/* Whether the start is beside a crossing, which the monitor then knows. */
MECHC_STATIC int mechc_finds_crossing(mechc_integration *run)
{
    mechc_monitor *monitor = &run->monitor;
    mechc_scalar_place place;
    mechc_weakest weakest;
    if (run->conditioning >= MECHC_TOO_NEAR || MECHC_NC != MECHC_NH)
        return 0;
    mechc_weakest_at(run->head.t, run->y, &run->given, monitor->rank, &weakest);
    mechc_scalar_locate_all(run->head.t, run->y, &run->given, &place);
    weakest.ratio = mechc_max(weakest.ratio, MECHC_TOO_NEAR); /* at a crossing it is rounding */
    const double reach = mechc_beside(&weakest, &place);
    if (!mechc_find_critical(run->head.t, run->y, &run->given, &weakest, reach,
                             &monitor->known))
        return 0;
    monitor->has_known = 1;
    return monitor->known.curves && mechc_judge(&monitor->known) == MECHC_CROSSING;
}

/* Start at a crossing or beside one, which the speeds leave along one branch; 0 if the start, a state
 * before it was projected, is not one. */
MECHC_STATIC int mechc_start_beside(mechc_integration *run, const double *start, const double *scale)
{
    double y[MECHC_NX_MAX], rates[MECHC_NX_MAX];
    mechc_trajectory *trajectory = &run->head.trajectory;
    if (!mechc_finds_crossing(run)) return 0;
    memcpy(y, start, MECHC_NX * sizeof *y);
    if (mechc_rates_beside(run, run->head.t, 1.0, scale, y, rates) != MECHC_RUNNING) return 0;
    memcpy(run->y, y, MECHC_NX * sizeof *y);
    memcpy(MECHC_RATE(run, 0), rates, MECHC_NX * sizeof *rates);
    memcpy(trajectory->y, y, MECHC_NX * sizeof *y);
    mechc_give_turns(run->turns, trajectory->y);
    run->head.stats.critical_gap = fabs(run->monitor.known.gap);
    run->head.stats.critical_time = run->head.t;
    return 1;
}

/* Leave such a start by a collocation step that is long enough. */
MECHC_STATIC void mechc_leave_start(mechc_integration *run)
{
    double fastest = 0.0;
    for (int i = 0; i < MECHC_NQ; i++)
        fastest = mechc_max(fastest, fabs(MECHC_RATE(run, 0)[i]) / run->scale[i]);
    run->step = mechc_max(run->step, mechc_min(MECHC_FIRST_MOVE / fastest, run->max_step));
    if (!run->method->reach && !mechc_leave_to_collocation(run)) run->head.status = MECHC_NO_MEMORY;
}
#endif

/* Start a run. methods: all methods by their numbers; a run that needs one without code sets head->wanted. */
MECHC_RARE void mechc_integration_start(mechc_run *head, const mechc_options *options,
                                        const mechc_method *const *methods,
                                        const mechc_driver *driver)
{
    mechc_integration *run = (mechc_integration *)head;
    memset(run, 0, sizeof *run);
    run->methods = methods;
    run->driver = driver;
    head->wanted = -1;
    mechc_take_options(run, options);
    if (!mechc_take_start(run, options)) {
        head->status = MECHC_OPEN_AT_START;
        return;
    }
#if MECHC_NH_MAX > 0
    double start[MECHC_NX_MAX];
    memcpy(start, run->y, MECHC_NX * sizeof *start);
#endif
    const int made = mechc_use_method(run, methods[options->method]);
    mechc_count_dense_rows(run, options->dense);
    head->status = mechc_rates_at(run, head->t, run->y, MECHC_RATE(run, 0));
    if (!mechc_append_turned(&head->trajectory, head->t, run->y, run->turns) || !made)
        head->status = MECHC_NO_MEMORY;
    if (head->status != MECHC_RUNNING) return;
    mechc_monitor_start(run);
    if (head->status != MECHC_RUNNING) return;
#if MECHC_NH_MAX > 0
    const int beside = mechc_start_beside(run, start, options->scale);
    if (run->monitor.at_critical && !beside) {
        head->status = MECHC_AT_CHANGE_POINT;
        return;
    }
#endif
    mechc_first_scale(run, options->scale, 0.0);
    const int is_given = options->first_step > 0.0;
    const double euler = mechc_euler_step(run, is_given ? mechc_min(options->first_step, run->max_step) : run->max_step);
    if (euler > 0.0) mechc_first_scale(run, options->scale, euler);
    run->step = is_given ? options->first_step : mechc_first_step(run, euler);
#if MECHC_NH_MAX > 0
    if (beside) mechc_leave_start(run);
#endif
    if (options->t0 == options->t1) head->status = MECHC_FINISHED;
}
