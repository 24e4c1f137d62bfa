/* Adaptive explicit Runge-Kutta with every stage taken on the constraint manifold.
 *
 * A stage first closes the loops at its own time and then takes accelerations there, because
 * off the manifold by d they are wrong by d over the smallest singular value of the Jacobian.
 * Step control after Hairer, Norsett & Wanner (1993), section II.4.
 */

typedef struct mechc_radau mechc_radau; /* in radau.h */
struct mechc_gauss;                      /* in gauss.h */

typedef struct {
    mechc_run head;
    const mechc_tableau *tableau, *own; /* of this step; of the method */
    const mechc_tableau *resume; /* the method that stepped aside at a crossing; NULL: none */
    int missed;                  /* crossings in a row that collocation could not step over */
    int method, has_tolerances;
    double t1, rtol, max_step, step, direction;
    long max_steps;
    int refused; /* the last attempt failed: do not let the step grow */
    int failure; /* why a stage of it could not be taken; 0 */
    int on_change_point, most_dense;
    mechc_dip dip;
    mechc_passing passing;
    double conditioning;       /* of the configuration rows at the last stage taken */
    double low, best, high;    /* where in a step a crossing is placed best */
    double horizon;            /* steps ahead that crossings are looked for */
    double allowed;            /* error of a step over its tolerance; above 1 where rounding rules */
    double refused_t, refused_step, refused_error; /* the last step that its error refused */
    double p[MECHC_AT_LEAST_ONE(MECHC_PASSED)], k[MECHC_CONSTANTS];
    double left_over[MECHC_NX], next_left_over[MECHC_NX]; /* of y, which is too coarse for it */
    double time_left_over;
    double y[MECHC_NX], tolerance[MECHC_NX], scale[MECHC_NX];
    double rates[MECHC_MOST_RATES * MECHC_NX];
    mechc_radau *implicit;     /* work space, made when first needed */
    struct mechc_gauss *collocation; /* work space of that method */
    int may_stiffen;           /* go over to the implicit method where stability limits the step */
    int stiff, easy;           /* steps in a row that were limited so; that were not */
    int alone;                 /* too near a critical configuration to run abreast of others */
    double last_step, last_factor; /* of the last step taken so: its length, and by which its error
                                      would have let it grow; 0: none */
} mechc_rk_run;

/* Share of the tolerance that one step may use: local errors accumulate over a run, and what was
 * asked for is judged at its end. */
#define MECHC_RK_SHARE 0.03
#define MECHC_RK_SHARE_OF_MANY 0.01 /* of a method of low order, whose steps are many */
/* A collocation polynomial is worth nothing farther ahead. */
#define MECHC_GAUSS_GROWTH 2.0

/* Conditioning below which rounding counts as it is magnified. */
#define MECHC_RK_POOR 0.2

/* Errors that rounding near a crossing may leave, in units of each component's scale. */
#define MECHC_RK_ROUNDING 1e-9

#define MECHC_RATE(run, i) ((run)->rates + (i) * MECHC_NX)

/* In rk_passage.h. */
MECHC_STATIC void mechc_rk_keep(const mechc_scalar_place *place, double *error);
MECHC_STATIC void mechc_rk_leave_bridge(mechc_rk_run *run);
MECHC_STATIC void mechc_rk_meet(mechc_rk_run *run, double t, const double *y,
                                const mechc_scalar_place *place);
MECHC_STATIC int mechc_rk_judge(mechc_rk_run *run, double h, const double *end);
MECHC_STATIC int mechc_rk_record(mechc_rk_run *run, double h, const double *rows);
MECHC_STATIC void mechc_rk_begin(mechc_rk_run *run);
MECHC_STATIC double mechc_rk_approach(mechc_rk_run *run, double open);
MECHC_STATIC int mechc_rk_step_aside(mechc_rk_run *run, double h);
MECHC_STATIC void mechc_rk_leave_to_pair(mechc_rk_run *run, double h);
MECHC_STATIC void mechc_rk_come_back(mechc_rk_run *run);

/* In abreast.h. */
MECHC_STATIC int mechc_abreast_fits(const mechc_rk_run *run);
MECHC_STATIC void mechc_abreast_come_back(mechc_rk_run *run);

/* In stiffness.h. */
MECHC_STATIC void mechc_rk_watch_stiffness(mechc_rk_run *run, double h, const double *end,
                                           double error);

/* In radau.h. */
MECHC_STATIC int mechc_radau_step(mechc_rk_run *run, double h, double *end);
MECHC_STATIC double mechc_radau_error(mechc_rk_run *run, double h, const double *end);
MECHC_STATIC void mechc_radau_dense(const mechc_rk_run *run, const double *end, int count,
                                    double *rows);

/* In gauss.h. */
MECHC_STATIC int mechc_gauss_step(mechc_rk_run *run, double h, double *end);
MECHC_STATIC double mechc_gauss_error(const mechc_rk_run *run);
MECHC_STATIC double mechc_gauss_factor(const mechc_rk_run *run, double error);
MECHC_STATIC int mechc_gauss_reached_end(const mechc_rk_run *run, double error);
MECHC_STATIC void mechc_gauss_accept(mechc_rk_run *run, double h);
MECHC_STATIC void mechc_gauss_stage(const struct mechc_gauss *g, int stage, double *q);
MECHC_STATIC int mechc_gauss_make(mechc_rk_run *run);
MECHC_STATIC void mechc_gauss_renew(const mechc_rk_run *run);
MECHC_STATIC void mechc_gauss_rows(const mechc_rk_run *run, double h, const double *end,
                                   double *rows);

MECHC_STATIC int mechc_rk_is_collocation(const mechc_rk_run *run)
{
    return run->tableau == &mechc_gauss8;
}

MECHC_STATIC double mechc_rk_share(const mechc_rk_run *run)
{
    return run->own == &mechc_dopri5 ? MECHC_RK_SHARE_OF_MANY : MECHC_RK_SHARE;
}

MECHC_STATIC int mechc_rk_is_implicit(const mechc_rk_run *run)
{
    return run->tableau == &mechc_radau5;
}

/* Why rates are not finite: the mass matrix is factored only here where constraints are solved in
 * their free directions. */
MECHC_ONCE int mechc_rk_not_finite(const mechc_scalar_place *place, mechc_stats *stats)
{
#if MECHC_ARTICULATED
    for (int i = 0; i < MECHC_AT_SAVED; i++)
        if (!(fabs(place->saved[i]) < HUGE_VAL)) return MECHC_NOT_FINITE;
    stats->coordinate = place->bad;
#else
    mechc_scalar_mass_factors unused;
    const double *mass = place->mass;
#if MECHC_LINKS > 0
    double written_out[MECHC_NU * MECHC_NU];
    mechc_scalar_composite_mass(place->saved, written_out);
    mass = written_out;
#endif
    for (int i = 0; i < MECHC_NU * MECHC_NU; i++)
        if (!(fabs(mass[i]) < HUGE_VAL)) return MECHC_NOT_FINITE;
    stats->coordinate = mechc_scalar_factor_mass(mass, MECHC_NU, &unused);
#endif
    return stats->coordinate >= 0 ? MECHC_SINGULAR_MASS : MECHC_NOT_FINITE;
}

/* Project y onto the constraints and take its rates. */
MECHC_ONCE int mechc_rk_stage(mechc_rk_run *run, double t, double *y, double *rates)
{
    mechc_scalar_place place;
    mechc_stats *stats = &run->head.stats;
    const int status =
        mechc_scalar_close_loops(t, y, run->p, run->k, &place, &stats->closure_iterations);
    stats->rhs_evaluations++;
    if (status != MECHC_RUNNING) {
        stats->coordinate = place.bad;
        return status;
    }
    mechc_scalar_steady(&place, y + MECHC_NQ);
    mechc_scalar_coordinate_rates_of(t, y, y + MECHC_NQ, run->p, run->k, rates);
    mechc_scalar_accelerate(t, y, y + MECHC_NQ, run->p, run->k, &place, rates + MECHC_NQ, 0);
    mechc_rk_meet(run, t, y, &place);
    for (int i = 0; i < MECHC_NX; i++)
        if (!(fabs(rates[i]) < HUGE_VAL)) return mechc_rk_not_finite(&place, stats);
    return MECHC_RUNNING;
}

/* sum_j row[j] rate_j */
MECHC_INLINE void mechc_rk_sum(const mechc_rk_run *run, const double *row, int rates, double *sum)
{
    for (int i = 0; i < MECHC_NX; i++) sum[i] = 0.0;
    for (int j = 0; j < rates; j++)
        if (row[j] != 0.0)
            for (int i = 0; i < MECHC_NX; i++) sum[i] += row[j] * MECHC_RATE(run, j)[i];
}

/* y + h sum_j row[j] rate_j */
MECHC_STATIC void mechc_rk_combine(const mechc_rk_run *run, const double *row, int rates, double h,
                                   double *out)
{
    double sum[MECHC_NX];
    mechc_rk_sum(run, row, rates, sum);
    for (int i = 0; i < MECHC_NX; i++) out[i] = run->y[i] + h * sum[i];
}

/* The same for the step's end, with what rounding has left of the steps before.  Kahan (1965). */
MECHC_STATIC void mechc_rk_end(mechc_rk_run *run, const double *row, int rates, double h,
                               double *end)
{
    double sum[MECHC_NX];
    mechc_rk_sum(run, row, rates, sum);
    for (int i = 0; i < MECHC_NX; i++) {
        const double gain = h * sum[i] + run->left_over[i];
        end[i] = run->y[i] + gain;
        run->next_left_over[i] = gain - (end[i] - run->y[i]);
    }
}

/* Rates first .. last of the tableau; `end` receives the state of the last. */
MECHC_STATIC int mechc_rk_rates(mechc_rk_run *run, int first, int last, double h, double *end)
{
    const mechc_tableau *tableau = run->tableau;
    for (int i = first; i <= last; i++) {
        const double *row = tableau->matrix + i * MECHC_MOST_RATES;
        if (i == tableau->stages) mechc_rk_end(run, row, i, h, end);
        else mechc_rk_combine(run, row, i, h, end);
        const double t = run->head.t + tableau->nodes[i] * h;
        const int status = mechc_rk_stage(run, t, end, MECHC_RATE(run, i));
        if (status != MECHC_RUNNING) return status;
    }
    return MECHC_RUNNING;
}

/* Rounding of a state, as a poor conditioning magnifies it. */
MECHC_STATIC double mechc_rk_digit(const mechc_rk_run *run)
{
    const double low = MECHC_NH > 0 ? mechc_max(run->dip.first, MECHC_NARROW) : 1.0;
    return 2.220446049250313e-16 / (low < MECHC_RK_POOR ? low : 1.0);
}

/* Tolerated error of one step per component: a share of the user's atol + rtol |y|, or of rtol
 * times the scale; never less than rounding. */
MECHC_STATIC double mechc_rk_tolerance(const mechc_rk_run *run, int i, const double *end)
{
    const double size = mechc_max(fabs(run->y[i]), fabs(end[i]));
    const double asked = run->has_tolerances ? run->tolerance[i] + run->rtol * size
                                             : run->rtol * run->scale[i];
    return mechc_max(mechc_rk_share(run) * asked, mechc_rk_digit(run) * size);
}

/* Root mean square of the step's error by one set of weights over what is tolerated, squared. */
MECHC_STATIC double mechc_rk_norm(const mechc_rk_run *run, const double *weights, double h,
                                  const double *end, const mechc_scalar_place *place)
{
    double error[MECHC_NX], square = 0.0;
    for (int i = 0; i < MECHC_NX; i++) {
        double sum = 0.0;
        for (int j = 0; j <= run->tableau->stages; j++) sum += weights[j] * MECHC_RATE(run, j)[i];
        error[i] = h * sum;
    }
    if (place) mechc_rk_keep(place, error);
    for (int i = 0; i < MECHC_NX; i++) square += pow(error[i] / mechc_rk_tolerance(run, i, end), 2);
    return square / MECHC_NX;
}

/* Root mean square of the step's error over what is tolerated.  Near a change point only what the
 * projection of the end will keep of it counts: the rest is the closure's magnified rounding. */
MECHC_STATIC double mechc_rk_error(mechc_rk_run *run, double h, const double *end)
{
    const mechc_tableau *tableau = run->tableau;
    mechc_scalar_place at_end, *place = 0;
    if (mechc_rk_is_collocation(run)) return mechc_gauss_error(run);
    if (mechc_rk_is_implicit(run)) return mechc_radau_error(run, h, end);
    if (MECHC_NH > 0 && mechc_dipped(&run->dip, run->horizon)) {
        place = &at_end;
        mechc_scalar_locate(run->head.t + h, end, run->p, run->k, place);
    }
    const double first = mechc_rk_norm(run, tableau->error, h, end, place);
    if (!tableau->second_error) return sqrt(first);
    const double second = mechc_rk_norm(run, tableau->second_error, h, end, place);
    return first > 0.0 ? first / sqrt(first + 0.01 * second) : 0.0;
}

/* The first `count` rows of the dense output, from all rates of the step. */
MECHC_STATIC void mechc_rk_dense(const mechc_rk_run *run, double h, const double *end, int count,
                                 double *rows)
{
    const mechc_tableau *tableau = run->tableau;
    const double *first = MECHC_RATE(run, 0), *last = MECHC_RATE(run, tableau->stages);
    if (mechc_rk_is_collocation(run)) {
        mechc_gauss_rows(run, h, end, rows);
        return;
    }
    if (mechc_rk_is_implicit(run)) {
        mechc_radau_dense(run, end, count, rows);
        return;
    }
    for (int i = 0; i < MECHC_NX; i++) {
        const double r0 = end[i] - run->y[i], r1 = h * first[i] - r0;
        rows[i] = r0;
        rows[MECHC_NX + i] = r1;
        rows[2 * MECHC_NX + i] = r0 - h * last[i] - r1;
        for (int row = tableau->dense_rows; row < count; row++) rows[row * MECHC_NX + i] = 0.0;
        for (int row = 3; row < tableau->dense_rows; row++) {
            const double *weights = tableau->dense + (row - 3) * MECHC_MOST_RATES;
            double sum = 0.0;
            for (int j = 0; j < tableau->rates; j++) sum += weights[j] * MECHC_RATE(run, j)[i];
            rows[row * MECHC_NX + i] = h * sum;
        }
    }
}

/* Speeds are judged against the largest met so far. */
MECHC_STATIC void mechc_rk_widen_scale(mechc_rk_run *run)
{
    for (int i = MECHC_NQ; i < MECHC_NX; i++)
        run->scale[i] = mechc_max(run->scale[i], fabs(run->y[i]));
}

/* Rows of the dense output where they are kept or wanted for a passage. */
MECHC_STATIC int mechc_rk_finish(mechc_rk_run *run, double h, const double *end)
{
    mechc_trajectory *trajectory = &run->head.trajectory;
    const int crosses = run->passing.action == MECHC_CROSSES;
    double unused[MECHC_NX], own[MECHC_MOST_DENSE * MECHC_NX], *rows = own;
    const int wanted = trajectory->dense_rows || crosses;
    if (!wanted && MECHC_NH == 0) return MECHC_RUNNING;
    if (!mechc_make_room(trajectory)) return MECHC_NO_MEMORY;
    /* whether its stages close decides about the step, so they are taken in any case */
    const int status =
        mechc_rk_rates(run, run->tableau->stages + 1, run->tableau->rates - 1, h, unused);
    if (status != MECHC_RUNNING || !wanted) return status;
    if (trajectory->dense_rows)
        rows = trajectory->dense
             + (trajectory->count - 1) * trajectory->width * trajectory->dense_rows;
    mechc_rk_dense(run, h, end,
                   trajectory->dense_rows ? trajectory->dense_rows : run->most_dense, rows);
    return crosses ? mechc_rk_record(run, h, rows) : MECHC_RUNNING;
}

/* The method from here on, and where in its steps crossings are looked for. */
MECHC_STATIC void mechc_rk_use(mechc_rk_run *run, const mechc_tableau *tableau)
{
    run->tableau = run->own = tableau;
    memset(run->next_left_over, 0, sizeof run->next_left_over);
    const int collocation = mechc_rk_is_collocation(run);
    mechc_widest_gap(collocation ? tableau : &MECHC_BRIDGE, &run->low, &run->best, &run->high);
    run->horizon = collocation ? 1.3 : tableau == &MECHC_BRIDGE ? 2.0 : 8.0;
}

/* Take over an accepted step. */
MECHC_STATIC int mechc_rk_accept(mechc_rk_run *run, double h, double t, const double *end,
                                 double error)
{
    const double conditioning = run->conditioning;
    const int status = mechc_rk_finish(run, h, end);
    if (status != MECHC_RUNNING) return status;
    mechc_rk_watch_stiffness(run, h, end, error);
    if (mechc_rk_is_collocation(run)) mechc_gauss_accept(run, h);
    memcpy(run->y, end, sizeof run->y);
    memcpy(run->left_over, run->next_left_over, sizeof run->left_over);
    memcpy(MECHC_RATE(run, 0), MECHC_RATE(run, run->tableau->stages), sizeof run->y);
    run->time_left_over = h + run->time_left_over - (t - run->head.t);
    run->head.t = t;
    run->refused_step = 0.0;
    run->failure = 0;
    if (run->dip.leaving && conditioning > (MECHC_NC > 2 ? 0.2 : 0.1))
        mechc_rk_come_back(run);
    if (!mechc_dipped(&run->dip, run->horizon)) run->allowed = 1.0;
    run->dip.leaving = conditioning > run->dip.first;
    run->dip.fall = (run->dip.first - conditioning) / fabs(h);
    run->dip.first = conditioning;
    run->dip.tries = 0;
    run->dip.ahead = NAN;
    if (run->stiff >= 15) mechc_rk_use(run, &mechc_radau5);
    mechc_rk_widen_scale(run);
    mechc_abreast_come_back(run);
    run->head.stats.steps++;
    return mechc_append(&run->head.trajectory, t, run->y) ? MECHC_RUNNING : MECHC_NO_MEMORY;
}

MECHC_STATIC void mechc_rk_refuse(mechc_rk_run *run, double factor)
{
    run->head.stats.rejected++;
    run->step *= factor;
    run->refused = 1;
    mechc_rk_leave_bridge(run);
    run->dip.wanted = 0.0;
}

/* Near a crossing an error that a shorter step hardly lowers is rounding, which grows the nearer
 * the nodes come: let it pass, for shrinking on would only creep onto the crossing. */
MECHC_STATIC void mechc_rk_learn_rounding(mechc_rk_run *run, double h, double error)
{
    const double t = run->head.t, shrunk = fabs(h) / run->refused_step;
    const int again = run->refused_t == t && run->refused_step > 0.0 && shrunk < 1.0;
    const double most = MECHC_RK_ROUNDING / (mechc_rk_share(run) * run->rtol);
    if (again && mechc_dipped(&run->dip, run->horizon) && mechc_knows_crossing(&run->dip)
        && error > run->refused_error * shrunk * shrunk * shrunk)
        run->allowed = mechc_min(mechc_max(run->allowed, 4.0 * error),
                            mechc_max(1.0, mechc_rk_is_collocation(run) ? sqrt(most) : most));
    run->refused_t = t;
    run->refused_step = fabs(h);
    run->refused_error = error;
}

/* A node that came near a crossing spoils a step more than its length does: place the crossing
 * between the nodes rather than shrink the step. */
MECHC_STATIC int mechc_rk_place_instead(mechc_rk_run *run, double h, const double *end,
                                        double error)
{
    const int good_enough_to_see = mechc_rk_is_collocation(run)
                                 ? mechc_gauss_reached_end(run, error)
                                 : error * mechc_rk_share(run) * run->rtol < 1e-3;
    if (!good_enough_to_see || run->dip.tries >= 4) return 0;
    return mechc_rk_judge(run, h, end) == MECHC_RUNNING && run->passing.action == MECHC_RETRY;
}

MECHC_STATIC double mechc_rk_factor(const mechc_rk_run *run, double error)
{
    const double most = run->refused                   ? 1.0
                      : mechc_rk_is_collocation(run) ? MECHC_GAUSS_GROWTH
                      : run->tableau->order > 5      ? 6.0 : 10.0;
    const double factor = mechc_rk_is_collocation(run)
                        ? mechc_gauss_factor(run, error)
                        : 0.9 * pow(error, -1.0 / run->tableau->order);
    if (mechc_rk_is_implicit(run) && factor >= 1.0 && factor < 1.2) return 1.0; /* factors kept */
    return error > 0.0 ? mechc_min(most, mechc_max(0.2, factor)) : most;
}

/* Beside a critical configuration the step shrinks because doubles cannot tell what comes next. */
MECHC_STATIC int mechc_rk_too_small(const mechc_rk_run *run)
{
    const int examined = run->head.stats.critical_gap < HUGE_VAL;
    if (run->failure == MECHC_NOT_FINITE) return MECHC_NOT_FINITE;
    if (MECHC_NH > 0 && examined && run->dip.least < MECHC_NARROW) return MECHC_UNDECIDED;
    return run->failure ? run->failure : MECHC_STEP_TOO_SMALL;
}

/* The step to attempt; 1 where it is the last. */
MECHC_STATIC int mechc_rk_next_step(mechc_rk_run *run, double *h)
{
    const double left = run->t1 - run->head.t, step = mechc_min(run->step, run->max_step);
    if (mechc_rk_is_collocation(run)) {
        const double open = mechc_min(step, fabs(left)), planned = mechc_rk_approach(run, open);
        *h = run->direction * planned;
        if (planned != open && planned < mechc_min(fabs(left), run->max_step)) return 0;
    }
    *h = run->direction * step;
    if (fabs(left) <= 1.01 * step) {
        *h = left;
        return 1;
    }
    if (fabs(left) < 2.0 * step) *h = 0.5 * left;
    return 0;
}

/* One attempt; the run's status after it. */
MECHC_STATIC int mechc_rk_attempt(mechc_rk_run *run)
{
    const double t = run->head.t;
    const double smallest = 16.0 * 2.220446049250313e-16 * mechc_max(fabs(t), fabs(run->t1 - t));
    double end[MECHC_NX], h;
    const int last = mechc_rk_next_step(run, &h);
    if (run->dip.bends && mechc_rk_is_collocation(run)) {
        mechc_rk_leave_to_pair(run, h);
        return MECHC_RUNNING;
    }
    if (!last && fabs(h) < smallest) return mechc_rk_too_small(run);
    mechc_dip_begin(&run->dip, run->y);
    const int status = mechc_rk_is_collocation(run) ? mechc_gauss_step(run, h, end)
                     : mechc_rk_is_implicit(run)    ? mechc_radau_step(run, h, end)
                     : mechc_rk_rates(run, 1, run->tableau->stages, h, end);
    if (status == MECHC_NO_MEMORY) return status;
    if (status != MECHC_RUNNING) {
        if (fabs(h) < smallest) return status;
        run->step = fabs(h);
        run->failure = status;
        if (mechc_rk_is_collocation(run) && mechc_rk_step_aside(run, h)) return MECHC_RUNNING;
        mechc_rk_refuse(run, mechc_rk_is_collocation(run) ? 0.7 : 0.3);
        return MECHC_RUNNING;
    }
    const double error = mechc_rk_error(run, h, end);
    mechc_stats *stats = &run->head.stats;
    run->step = fabs(h);
    const double factor = mechc_rk_factor(run, error);
    if (!(error <= run->allowed)) {
        if (fabs(h) < smallest) return mechc_rk_too_small(run);
        if (mechc_rk_place_instead(run, h, end, error)) return MECHC_RUNNING;
        mechc_rk_learn_rounding(run, h, error);
        mechc_rk_refuse(run, error > 1.0 ? factor : 0.2);
        return MECHC_RUNNING;
    }
    const int judged = mechc_rk_judge(run, h, end);
    if (judged != MECHC_RUNNING || run->passing.action == MECHC_RETRY) return judged;
    const int accepted = mechc_rk_accept(
        run, h, last ? run->t1 : t + (h + run->time_left_over), end, error);
    if (accepted == MECHC_NO_MEMORY || accepted == MECHC_STOPPED_AT_CHANGE_POINT) return accepted;
    if (accepted != MECHC_RUNNING) { /* the dense output's own stages could not be closed */
        mechc_rk_refuse(run, 0.5);
        return MECHC_RUNNING;
    }
    if (error > 1.0) {
        const double part = mechc_rk_is_collocation(run) ? error * error : error;
        stats->rounding = mechc_max(stats->rounding, part * mechc_rk_share(run) * run->rtol);
    }
    run->step = mechc_max(run->step * mechc_max(factor, error > 1.0), run->dip.wanted);
    if (mechc_rk_is_collocation(run)) run->step = mechc_min(run->step, MECHC_GAUSS_GROWTH * fabs(h));
    mechc_rk_leave_bridge(run);
    run->dip.wanted = 0.0;
    run->dip.patience = HUGE_VAL;
    run->refused = 0;
    return last ? MECHC_FINISHED : MECHC_RUNNING;
}

/* Up to `steps` attempts, fewer where the run is fit to go on abreast; the attempts made. */
MECHC_STATIC long mechc_rk_advance_alone(mechc_rk_run *run, long steps)
{
    mechc_run *head = &run->head;
    long made = 0;
    do {
        const int most = head->stats.steps + head->stats.rejected >= run->max_steps;
        head->status = most ? MECHC_TOO_MANY_STEPS : mechc_rk_attempt(run);
        made++;
    } while (head->status == MECHC_RUNNING && made < steps && !mechc_abreast_fits(run));
    return made;
}

static void mechc_rk_release(mechc_run *head)
{
    mechc_free(&head->trajectory);
    free(((mechc_rk_run *)head)->implicit);
    free(((mechc_rk_run *)head)->collocation);
    ((mechc_rk_run *)head)->implicit = 0;
    ((mechc_rk_run *)head)->collocation = 0;
}
