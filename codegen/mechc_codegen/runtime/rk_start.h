/* The start of a run: its options taken over, scales and the first step. */

/* A first step after Hairer, Norsett & Wanner (1993), section II.4. */
MECHC_STATIC double mechc_rk_first_step(mechc_rk_run *run)
{
    double state = 0.0, first = 0.0, second = 0.0, end[MECHC_NX];
    for (int i = 0; i < MECHC_NX; i++) {
        const double tolerance = mechc_rk_tolerance(run, i, run->y);
        state += pow(run->y[i] / tolerance, 2);
        first += pow(MECHC_RATE(run, 0)[i] / tolerance, 2);
    }
    const double span = fabs(run->t1 - run->head.t);
    double guess = state < 1e-10 || first < 1e-10 ? 1e-6 * span : 0.01 * sqrt(state / first);
    guess = mechc_min(mechc_min(guess, run->max_step), span);
    for (int i = 0; i < MECHC_NX; i++)
        end[i] = run->y[i] + run->direction * guess * MECHC_RATE(run, 0)[i];
    const double t = run->head.t + run->direction * guess;
    if (mechc_rk_stage(run, t, end, MECHC_RATE(run, 1)) != MECHC_RUNNING) return 1e-3 * guess;
    for (int i = 0; i < MECHC_NX; i++) {
        const double change = MECHC_RATE(run, 1)[i] - MECHC_RATE(run, 0)[i];
        second += pow(change / (guess * mechc_rk_tolerance(run, i, run->y)), 2);
    }
    const double largest = sqrt(mechc_max(first, second) / MECHC_NX);
    const double step = largest > 1e-15 ? pow(0.01 / largest, 1.0 / run->tableau->order)
                                        : mechc_max(1e-6 * span, 1e-3 * guess);
    return mechc_min(mechc_min(100.0 * guess, step), run->max_step);
}

/* Scales of the speeds before any is known: what the first accelerations reach within one unit
 * of the coordinate, and never nothing. */
MECHC_STATIC void mechc_rk_first_scale(mechc_rk_run *run, const double *scale)
{
    double largest = 0.0;
    for (int i = 0; i < MECHC_NX; i++) run->scale[i] = scale[i];
    for (int i = MECHC_NQ; i < MECHC_NX; i++) {
        const double reached = sqrt(fabs(MECHC_RATE(run, 0)[i]) * scale[i]);
        run->scale[i] = mechc_max(fabs(run->y[i]), reached);
        largest = mechc_max(largest, run->scale[i] / scale[i]);
    }
    for (int i = MECHC_NQ; i < MECHC_NX; i++)
        run->scale[i] = mechc_max(run->scale[i], scale[i] * (largest > 0.0 ? 1e-3 * largest : 1.0));
}

#if MECHC_NI > 0
/* A motion may rest until an input sets in: speeds that within the span would not move anything by
 * a thousandth of its unit say nothing of the speeds that follow. */
MECHC_STATIC void mechc_rk_widen_for_inputs(mechc_rk_run *run, const double *scale)
{
    const double span = fabs(run->t1 - run->head.t);
    for (int i = MECHC_NQ; i < MECHC_NX; i++)
        run->scale[i] = mechc_max(run->scale[i], 1e-3 * scale[i] / span);
}

static void mechc_rk_extend(mechc_run *head, double t1, double inputs)
{
    mechc_rk_run *run = (mechc_rk_run *)head;
    const ptrdiff_t count = head->trajectory.count;
    if (head->status != MECHC_RUNNING && head->status != MECHC_FINISHED) return;
    run->t1 = t1;
    run->p[MECHC_NP] = inputs;
    if (run->collocation) mechc_gauss_renew(run);
    for (ptrdiff_t i = count - 1; i > 0 && i > count - 3; i--) /* the last may have been cut short */
        run->step = mechc_max(run->step, fabs(head->trajectory.t[i] - head->trajectory.t[i - 1]));
    head->status = mechc_rk_stage(run, head->t, run->y, MECHC_RATE(run, 0));
}
#endif

static void mechc_rk_start(mechc_run *head, const mechc_options *options)
{
    mechc_rk_run *run = (mechc_rk_run *)head;
    memset(run, 0, sizeof *run);
    mechc_rk_use(run, mechc_tableaus[options->method]);
    run->method = options->method;
    run->t1 = options->t1;
    run->direction = options->t1 >= options->t0 ? 1.0 : -1.0;
    run->rtol = options->rtol;
    run->has_tolerances = options->atol != 0;
    run->max_step = options->max_step;
    run->max_steps = options->max_steps;
    run->on_change_point = options->on_change_point;
    run->may_stiffen = options->may_stiffen;
    run->allowed = 1.0;
    const int collocation = mechc_rk_is_collocation(run);
    if (options->atol) memcpy(run->tolerance, options->atol, sizeof run->tolerance);
    memcpy(run->y, options->y0, sizeof run->y);
    memcpy(run->p, options->p, MECHC_PASSED * sizeof(double));
    mechc_constants_at(options->t0, run->y, run->p, run->k);
    head->t = options->t0;
    head->stats.least_singular = head->stats.critical_gap = HUGE_VAL;
    head->stats.coordinate = -1;
    head->trajectory.width = MECHC_NX;
    const int whole = MECHC_NH > 0 || run->may_stiffen; /* other tables may take part */
    run->most_dense = run->own->dense_rows;
    if (whole && run->most_dense < MECHC_BRIDGE.dense_rows)
        run->most_dense = MECHC_BRIDGE.dense_rows;
    head->trajectory.dense_rows = options->dense ? run->most_dense : 0;
    head->status = mechc_rk_stage(run, head->t, run->y, MECHC_RATE(run, 0));
    if (!mechc_append(&head->trajectory, head->t, run->y)) head->status = MECHC_NO_MEMORY;
    if (collocation && !mechc_gauss_make(run)) head->status = MECHC_NO_MEMORY;
    if (head->status != MECHC_RUNNING) return;
    mechc_rk_begin(run);
    if (head->status != MECHC_RUNNING) return;
    mechc_rk_first_scale(run, options->scale);
#if MECHC_NI > 0
    mechc_rk_widen_for_inputs(run, options->scale);
#endif
    run->step = options->first_step > 0.0 ? options->first_step : mechc_rk_first_step(run);
    if (options->t0 == options->t1) head->status = MECHC_FINISHED;
}
