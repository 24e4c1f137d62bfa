/* The explicit pairs at critical configurations: see passage.h. */

/* Conditioning of the configuration rows; rows that are redundant everywhere do not count. */
MECHC_STATIC double mechc_rk_conditioning(const mechc_rk_run *run, const mechc_scalar_place *place)
{
#if MECHC_NH > 0
    if (MECHC_NC == MECHC_NH && (run->dip.rank == 0 || run->dip.rank == MECHC_NH))
        return mechc_scalar_conditioning(place);
    return mechc_weakest_ratio(place, run->dip.rank);
#else
    (void)run, (void)place;
    return 1.0;
#endif
}

MECHC_STATIC void mechc_rk_meet(mechc_rk_run *run, double t, const double *y,
                                const mechc_scalar_place *place)
{
#if MECHC_NC > 0
    mechc_stats *stats = &run->head.stats;
    const double singular = mechc_rk_conditioning(run, place);
    if (singular < stats->least_singular) {
        stats->least_singular = singular;
        stats->least_singular_time = t;
    }
    run->conditioning = singular;
    mechc_dip_meet(&run->dip, singular, y);
#else
    (void)run, (void)t, (void)y, (void)place;
#endif
}

/* Take from an error what the projection of the end will take from it. */
MECHC_STATIC void mechc_rk_keep(const mechc_scalar_place *place, double *error)
{
#if MECHC_NH > 0
    for (int part = MECHC_IDENTITY_KINEMATICS ? 0 : MECHC_NQ; part < MECHC_NX; part += MECHC_NQ) {
        double values[MECHC_NC], step[MECHC_NU];
        mechc_scalar_rates_of_rows(place, error + part, values);
        for (int i = 0; i < MECHC_NC; i++) values[i] = -values[i];
        mechc_scalar_least_step_at(place, values, step);
        for (int i = 0; i < MECHC_NU; i++) error[part + i] += step[i];
    }
#else
    (void)place, (void)error;
#endif
}

/* Back from the bridge to the method's own table and the step it had. */
MECHC_STATIC void mechc_rk_leave_bridge(mechc_rk_run *run)
{
    if (run->tableau == run->own) return;
    run->tableau = run->own;
    run->step = run->dip.wanted;
}

#if MECHC_NH > 0
/* Fractions of a step at which methods that keep no stages are looked at. */
#define MECHC_BETWEEN 8

/* On the cubic through both ends, its loops closed where they can be. */
MECHC_STATIC void mechc_rk_node(const mechc_rk_run *run, double h, const double *end, double s,
                                double *q)
{
    const double *start_rates = MECHC_RATE(run, 0);
    const double *end_rates = MECHC_RATE(run, run->tableau->stages), r = 1.0 - s;
    double closed[MECHC_NQ];
    long unused = 0;
    mechc_scalar_place place;
    for (int i = 0; i < MECHC_NQ; i++)
        q[i] = run->y[i] * r * r * (1.0 + 2.0 * s) + end[i] * s * s * (3.0 - 2.0 * s)
             + h * s * r * (start_rates[i] * r - end_rates[i] * s);
    memcpy(closed, q, sizeof closed);
    if (mechc_scalar_close_loops(run->head.t + s * h, closed, run->p, run->k, &place, &unused)
        == MECHC_RUNNING)
        memcpy(q, closed, sizeof closed);
}

/* Configurations along a step. */
MECHC_STATIC void mechc_rk_path(const mechc_rk_run *run, double h, const double *end,
                                mechc_path *path)
{
    const int collocation = mechc_rk_is_collocation(run);
    const int between = collocation ? run->tableau->stages - 1 : MECHC_BETWEEN - 1;
    path->count = between + 2;
    for (int i = 0; i < path->count; i++) {
        double *q = path->q[i];
        const double s = i == 0           ? 0.0
                       : i > between      ? 1.0
                       : collocation      ? run->tableau->nodes[i]
                                          : (double)i / MECHC_BETWEEN;
        path->fraction[i] = s;
        if (i == 0 || i > between) memcpy(q, i ? end : run->y, MECHC_NQ * sizeof *q);
        else if (collocation) mechc_gauss_stage(run->collocation, i - 1, q);
        else mechc_rk_node(run, h, end, s, q);
    }
}
#endif

/* Judge a step that its error allows; passing.action MECHC_RETRY where it was taken back. */
MECHC_STATIC int mechc_rk_judge(mechc_rk_run *run, double h, const double *end)
{
    run->passing.action = MECHC_STANDS;
#if MECHC_NH > 0
    if (!mechc_dipped(&run->dip, run->horizon)) return MECHC_RUNNING;
    mechc_path path;
    mechc_rk_path(run, h, end, &path);
    const mechc_span span = {run->head.t, h, run->y, MECHC_RATE(run, 0), end,
                             MECHC_RATE(run, run->tableau->stages), run->p, run->k,
                             run->low, run->best, run->high, run->horizon,
                             run->tableau == &MECHC_BRIDGE || mechc_rk_is_collocation(run),
                             fabs(run->t1 - run->head.t - h) <= 1e-12 * fabs(h), &path,
                             mechc_rk_is_collocation(run) ? run->tableau : 0};
    mechc_stats *stats = &run->head.stats;
    run->passing.gap = HUGE_VAL;
    mechc_examine(&span, &run->dip, &run->passing);
    stats->examined++;
    if (fabs(run->passing.gap) < stats->critical_gap) {
        stats->critical_gap = fabs(run->passing.gap);
        stats->critical_time = run->head.t;
    }
    if (run->passing.action == MECHC_CANNOT_TELL) return MECHC_UNDECIDED;
    if (run->passing.action == MECHC_RETRY) {
        run->dip.tries++;
        stats->rejected++;
        run->step = fabs(h) * run->passing.factor;
        run->refused = run->dip.wanted == 0.0;
        if (!mechc_rk_is_collocation(run)) run->tableau = run->passing.bridge ? &MECHC_BRIDGE : run->own;
    }
#else
    (void)h, (void)end;
#endif
    return MECHC_RUNNING;
}

MECHC_STATIC void mechc_rk_polynomial(const double *y, const double *rows, int count, double s,
                                      double *out);

/* How far along its direction at `about` the dense output has passed the change point. */
MECHC_STATIC double mechc_rk_passed(const mechc_rk_run *run, const double *rows, double s,
                                    const double *along)
{
    double y[MECHC_NX], sum = 0.0;
    mechc_rk_polynomial(run->y, rows, run->tableau->dense_rows, s, y);
    for (int i = 0; i < MECHC_NQ - MECHC_STATES; i++)
        sum += (y[i] - run->passing.q[i]) * along[i];
    return sum;
}

/* Record the passage, its time refined on the dense output; stop there where that is asked for. */
MECHC_STATIC int mechc_rk_record(mechc_rk_run *run, double h, const double *rows)
{
    const double near = 1e-3;
    double s = run->passing.fraction, before[MECHC_NX], along[MECHC_NX];
    mechc_rk_polynomial(run->y, rows, run->tableau->dense_rows, s - near, before);
    mechc_rk_polynomial(run->y, rows, run->tableau->dense_rows, s + near, along);
    for (int i = 0; i < MECHC_NX; i++) along[i] -= before[i];
    for (int iteration = 0; iteration < 8; iteration++) {
        const double here = mechc_rk_passed(run, rows, s, along);
        const double slope = (mechc_rk_passed(run, rows, s + near, along)
                              - mechc_rk_passed(run, rows, s - near, along)) / (2.0 * near);
        if (slope == 0.0) break;
        s -= here / slope;
    }
    const double t = run->head.t + s * h;
    if (!mechc_append_passage(&run->head.trajectory, t, run->passing.gap, run->passing.q, MECHC_NQ))
        return MECHC_NO_MEMORY;
    return run->on_change_point == MECHC_STOP_BEFORE ? MECHC_STOPPED_AT_CHANGE_POINT
                                                     : MECHC_RUNNING;
}

#if MECHC_NH > 0
/* The rank of the configuration rows around a configuration: the most that is found when each speed
 * in turn has moved it a little and the loops are closed again. */
MECHC_STATIC int mechc_rk_generic_rank(const mechc_rk_run *run, const mechc_span *span)
{
    int rank = 0;
    for (int j = 0; j < MECHC_NU; j++) {
        double by[MECHC_NU] = {0}, q[MECHC_NX];
        long unused = 0;
        mechc_scalar_place place;
        mechc_weakest weakest;
        by[j] = 1e-2;
        mechc_displace(run->head.t, run->y, span->p, span->k, by, q);
        if (mechc_scalar_close_loops(run->head.t, q, span->p, span->k, &place, &unused)
            != MECHC_RUNNING)
            continue;
        mechc_weakest_of(&place, 0, &weakest);
        if (weakest.rank > rank) rank = weakest.rank;
    }
    return rank;
}
#endif

/* Learn at the start which rows are redundant everywhere, and refuse a start where more are. */
MECHC_STATIC void mechc_rk_begin(mechc_rk_run *run)
{
#if MECHC_NH > 0
    const mechc_span span = {.p = run->p, .k = run->k};
    mechc_weakest weakest;
    mechc_weakest_at(run->head.t, run->y, &span, 0, &weakest);
    run->dip.rank = weakest.rank;
    if (weakest.rank < MECHC_NH) {
        const int generic = mechc_rk_generic_rank(run, &span);
        if (generic > weakest.rank) run->head.status = MECHC_AT_CHANGE_POINT;
    }
    run->conditioning = weakest.ratio;
#endif
    run->dip.first = run->conditioning;
    run->dip.ahead = NAN;
}
