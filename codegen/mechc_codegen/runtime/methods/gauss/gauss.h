/* Gauss-Legendre collocation with 8 stages, a stage of one trajectory in each lane.
 *
 * Where q' = u the accelerations are the only unknowns, and positions and speeds are their second
 * and first integrals; otherwise all rates are unknowns.  They are found by fixed-point iteration
 * from the extrapolated polynomial of the last step.
 *
 * Where the conditioning is good the stages are not projected, only the step's end is: the
 * equations keep an exact motion on the constraints, and a state at the distance d from them has
 * rates with an error in proportion to d.  Elsewhere every stage is on the constraints: the least
 * change that closes its loops is an unknown too, improved by one Gauss-Newton step in each
 * iteration, so that nothing is evaluated twice; speeds are projected exactly.
 */
#pragma once

#include "methods/gauss/ends.h"
#include "methods/traits.h"

#define MECHC_GAUSS_ITERATIONS 40
#define MECHC_GAUSS_CRITICAL 0.1 /* conditioning below which closing a loop varies fast */
#define MECHC_GAUSS_FARTHEST 3.0 /* lengths of the last step that one beside a crossing may begin by */
#define MECHC_GAUSS_ENDS_BESIDE 0.1 /* of its length: so near a crossing a last step ends beside it */
#define MECHC_GAUSS_STAYS 1e-11 /* scales that closing the loops may move a stage by in any case */
#define MECHC_GAUSS_SHOWS_END 10.0 /* error below which a step's end tells where it led */
/* Changes of a run's first or last step that may be rounding, of what the closure's rounding makes. */
#define MECHC_GAUSS_NOISES 16.0
/* Changes of a step over a crossing that may be rounding, in scales: so much over the conditioning,
 * or its square where several rows may be weak, between these. */
#define MECHC_GAUSS_FLOOR 5e-15
#define MECHC_GAUSS_FLOOR_LOWEST 1e-9
#define MECHC_GAUSS_FLOOR_HIGHEST 1e-7
#define MECHC_GAUSS_FLOOR_TOGETHER 1e-6
/* Conditioning above which stages are not projected. */
#define MECHC_GAUSS_PLAIN MECHC_CLEAR
/* Changes that grow so end a step; across a jump they need not shrink at all. */
#define MECHC_GAUSS_DIVERGES (MECHC_SWITCHES ? 1.0 : 2.0)

/* Start values: the last step's polynomial through its stages and its end, continued. */
MECHC_STATIC void mechc_gauss_extrapolate(mechc_gauss *g, double h)
{
    const double ratio = h / g->last_step;
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        mechc_vector before[MECHC_STAGES + 1], after = mechc_spread(1.0), sum[MECHC_UNKNOWNS_MAX];
        const mechc_vector x = 1.0 + ratio * mechc_take(mechc_gauss_nodes, block);
        before[0] = mechc_spread(1.0);
        for (int j = 0; j < MECHC_STAGES; j++)
            before[j + 1] = before[j] * (x - mechc_gauss_nodes[j]);
        for (int i = 0; i < MECHC_UNKNOWNS; i++) sum[i] = mechc_spread(0.0);
        for (int j = MECHC_STAGES; j >= 0; j--) {
            const mechc_vector weight = before[j] * after * mechc_gauss_barycentric[j];
            for (int i = 0; i < MECHC_UNKNOWNS; i++)
                MECHC_ADD(sum[i], weight, mechc_spread(j < MECHC_STAGES ? g->tried[i][j] : g->ends[i]));
            after *= x - mechc_gauss_nodes[j];
        }
        for (int i = 0; i < MECHC_UNKNOWNS; i++) mechc_put(sum[i], g->rates[i], block);
    }
}

MECHC_STATIC void mechc_gauss_predict(mechc_gauss *g, double h)
{
    memset(g->shift, 0, sizeof g->shift);
    if (g->last_step != 0.0 && fabs(h) <= MECHC_GAUSS_GROWTH * fabs(g->last_step)) {
        mechc_gauss_extrapolate(g, h);
        return;
    }
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        for (int j = 0; j < MECHC_STAGES; j++) g->rates[i][j] = g->ends[i];
}

MECHC_STATIC double mechc_sum(const double *weights, const double *x)
{
    double sum = weights[0] * x[0];
    for (int j = 1; j < MECHC_STAGES; j++) sum = mechc_scalar_fused(weights[j], x[j], sum);
    return sum;
}

/* Weights of this step's errors.  Tolerances looser than the bound, and stages too inaccurate to
 * extrapolate, cost more by rejected steps than they save. */
MECHC_STATIC void mechc_gauss_weigh(const mechc_integration *run, mechc_gauss *g)
{
    g->tolerated = 0.0;
    for (int i = 0; i < MECHC_NX; i++) {
        const double scale = run->scale[i], tolerance = mechc_tolerance(run, i, run->y);
        const double bound = mechc_min(tolerance, MECHC_GAUSS_LOOSEST * scale);
        g->weights[i] = 1.0 / bound;
        g->tolerated = mechc_max(g->tolerated, bound / scale);
        if (i >= MECHC_FIRST_UNKNOWN)
            g->error_weights[i - MECHC_FIRST_UNKNOWN] =
                MECHC_GAUSS_SAFETY / (MECHC_UNKNOWNS * scale * bound);
    }
}

/* The root of the step's error over its tolerance.  The end is of order 16, twice that of the
 * stages: the error of the stages' polynomial, by its two coefficients of highest degree (one alone
 * may vanish), counts with its square. */
MECHC_STATIC double mechc_gauss_measure(const mechc_gauss *g, double h)
{
    double square = 0.0;
    for (int i = 0; i < MECHC_UNKNOWNS; i++) {
        mechc_sums sums;
        mechc_gauss_sums(g, i, &sums);
        const mechc_sums squares = sums * sums;
        square += (squares[MECHC_DEGREE_7] + squares[MECHC_DEGREE_6]) * g->error_weights[i];
    }
    return fabs(h) * sqrt(square);
}

MECHC_STATIC double mechc_gauss_error(mechc_integration *run, double h, const double *end)
{
    (void)h, (void)end;
    return mechc_gauss_of(run)->error;
}

MECHC_STATIC double mechc_gauss_factor(mechc_integration *run, double error)
{
    mechc_gauss *g = mechc_gauss_of(run);
    return mechc_predictive_factor(run, error, g->last_step, g->last_factor, &g->factor);
}

/* Choose how the loops are closed: near a critical configuration before the rates are computed. */
MECHC_INLINE void mechc_gauss_watch(mechc_gauss *g)
{
#if MECHC_NH_MAX > 0
    mechc_vector least = -mechc_take(g->least, 0);
    for (int block = 1; block < MECHC_BLOCKS; block++)
        least = mechc_greater(least, -mechc_take(g->least, block));
    const double square = g->lowest = -mechc_greatest(least);
    g->fine = g->crossing && mechc_is_fine(square);
    g->closing = square < MECHC_GAUSS_CRITICAL * MECHC_GAUSS_CRITICAL ? MECHC_CLOSE_BEFORE
               : square < MECHC_GAUSS_PLAIN * MECHC_GAUSS_PLAIN       ? MECHC_CLOSE_AFTER
                                                                      : MECHC_UNPROJECTED;
#else
    g->closing = MECHC_NC > 0 ? MECHC_CLOSE_AFTER : MECHC_UNPROJECTED;
#endif
}

/* Whether the run starts or ends with this step beside a crossing. */
MECHC_STATIC int mechc_is_beside(const mechc_integration *run, double h)
{
    const double after = run->monitor.ahead - fabs(h);
    return run->monitor.first < MECHC_TOO_NEAR
        || (mechc_is_last(run, h) && fabs(after) < MECHC_GAUSS_ENDS_BESIDE * fabs(h));
}

/* The rounding of the closure as the node next to a crossing magnifies it: q by the conditioning, speeds by
 * its square, accelerations by its cube. */
MECHC_STATIC double mechc_gauss_noise(const mechc_integration *run, double h)
{
    const double low = mechc_max(sqrt(mechc_gauss_of(run)->lowest), DBL_EPSILON);
    double fastest = 0.0;
    for (int i = 0; i < MECHC_NQ; i++)
        fastest = mechc_max(fastest, fabs(MECHC_RATE(run, 0)[i]) / run->scale[i]);
    return DBL_EPSILON / (low * low * low) * fabs(h) * fastest;
}

/* The changes that may be rounding.  In a step over a crossing the closure's rounding is magnified
 * into reactions, which the projection of the end removes; elsewhere it changes the motion. */
MECHC_STATIC double mechc_gauss_floor(const mechc_integration *run, double h)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    double most = 0.0;
    for (int i = 0; i < MECHC_NX; i++) most = mechc_max(most, run->scale[i] * g->weights[i]);
    if (MECHC_NH > 0 && (run->monitor.ahead < fabs(h) || mechc_is_beside(run, h))) {
        const int together = MECHC_NC > 2; /* several rows may be nearly dependent */
        const double magnified = together ? g->lowest * g->lowest : g->lowest;
        const double highest = together ? MECHC_GAUSS_FLOOR_TOGETHER : MECHC_GAUSS_FLOOR_HIGHEST;
        const double floor = mechc_max(MECHC_GAUSS_FLOOR_LOWEST,
                                       mechc_min(highest, MECHC_GAUSS_FLOOR / magnified));
        if (!mechc_is_beside(run, h)) return most * floor;
        return most * MECHC_GAUSS_NOISES * mechc_gauss_noise(run, h);
    }
    double turn = MECHC_GAUSS_LARGE; /* the last digit of a coordinate that has grown large */
    for (int i = 0; i < MECHC_NQ; i++) turn = mechc_max(turn, fabs(run->y[i]) / run->scale[i]);
    const double digit = MECHC_GAUSS_DIGIT / MECHC_GAUSS_LARGE * turn;
    return most * (MECHC_NH > 0 ? mechc_min(MECHC_GAUSS_FLOOR_LOWEST, digit / sqrt(g->lowest))
                                : MECHC_GAUSS_DIGITS_FREE * digit);
}

/* Iterate until the change is negligible, or down to rounding: small changes that no longer shrink
 * by a third.  Where loops are closed one iteration late, changes may shrink in every second
 * iteration only.  A step whose error is too large after three iterations is rejected at once. */
MECHC_STATIC int mechc_gauss_converge(mechc_integration *run, double h)
{
    mechc_gauss *g = mechc_gauss_of(run);
    const double left = MECHC_GAUSS_LEFT * mechc_part_of_share(run->head.stats.steps);
    double before = HUGE_VAL, rate_before = 0.0;
    g->shrinking = 0.0;
    g->left = mechc_knows_crossing(&run->monitor) ? 0.0 : 0.25; /* rounding is reactions */
    for (int iteration = 0; iteration < MECHC_GAUSS_ITERATIONS; iteration++) {
        if (mechc_scalar_stopped(&run->given)) return MECHC_INTERRUPTED;
        if (iteration == 1 || g->closing != MECHC_UNPROJECTED) mechc_gauss_watch(g);
        /* A correction that closed the loops of stages far from convergence also moved them along the
         * motion, and no later correction undoes that: they are begun again until such a part is negligible. */
        if (g->closing != MECHC_UNPROJECTED && before * before * g->tolerated > MECHC_GAUSS_LEFT)
            memset(g->shift, 0, sizeof g->shift);
        const double change = mechc_gauss_iterate(g, run->head.t, run->y, h, iteration == 0);
        const double rate = change / before;
        if (iteration == 2) g->shrinking = rate;
        run->head.stats.rhs_evaluations += MECHC_STAGES;
        if (!(change < HUGE_VAL)) return MECHC_NOT_FINITE;
        /* the first changes shrink faster than later ones */
        if (iteration > 0 && change * mechc_max(rate, MECHC_GAUSS_FASTEST) <= left)
            return MECHC_RUNNING;
        if (iteration > 1 && rate > MECHC_GAUSS_STALLS) {
            const int noise = change <= mechc_gauss_floor(run, h);
            if (noise && rate * rate_before > MECHC_GAUSS_STALLS * MECHC_GAUSS_STALLS) return MECHC_RUNNING;
            if (!noise && iteration > 3 && rate > MECHC_GAUSS_DIVERGES) return MECHC_NOT_CLOSED;
            /* changes that stay equal are gaps of one rounding unit, closed back and forth */
            if (!noise && iteration > 3)
                g->left = mechc_min(mechc_max(2.0 * g->left, 0.5), MECHC_GAUSS_MOST_LEFT);
        }
        if (iteration == 2 && mechc_gauss_measure(g, h) > mechc_max(MECHC_GAUSS_HOPELESS, 2.0 * run->allowed))
            return MECHC_RUNNING;
        before = change;
        rate_before = rate;
    }
    return MECHC_NOT_CLOSED;
}

/* Whether closing the loops moved the stages little.  Their distance is the polynomial's error;
 * stages moved farther are on another branch or in another assembly of the mechanism. */
MECHC_STATIC int mechc_gauss_stays(const mechc_integration *run)
{
    mechc_vector most = {0};
    const double tolerated = mechc_gauss_of(run)->tolerated;
    if (mechc_gauss_of(run)->closing == MECHC_UNPROJECTED) return 1;
    for (int i = 0; i < MECHC_NQ; i++) {
        const double weight = 1.0 / run->scale[i];
        for (int block = 0; block < MECHC_BLOCKS; block++)
            most = mechc_larger(most, mechc_gauss_of(run)->shift[i][block] * weight);
    }
    return mechc_greatest(most) < MECHC_GAUSS_STAYS + sqrt(tolerated / MECHC_GAUSS_SAFETY);
}

MECHC_INLINE void mechc_gauss_gain(mechc_gauss *g, const double *y, double gain, int i,
                                   double *end)
{
    const double whole = gain + g->compensation[i];
    end[i] = y[i] + whole;
    const double moved = end[i] - y[i];
    g->next_compensation[i] = (y[i] - (end[i] - moved)) + (whole - moved);
}

/* The end of the step with compensated sums, before it is projected. */
MECHC_STATIC void mechc_gauss_end(mechc_gauss *g, const double *y, double h, double *end)
{
    for (int i = 0; i < MECHC_UNKNOWNS; i++) {
        mechc_sums sums;
        mechc_gauss_sums(g, i, &sums);
        mechc_gauss_gain(g, y, h * sums[MECHC_ONCE_INTEGRATED], MECHC_FIRST_UNKNOWN + i, end);
        if (!MECHC_IDENTITY_KINEMATICS) continue;
        const double speed = y[MECHC_NQ + i] + g->compensation[MECHC_NQ + i];
        mechc_gauss_gain(g, y, h * mechc_scalar_fused(h, sums[MECHC_TWICE_INTEGRATED], speed), i, end);
    }
}

/* Conditioning of the configuration rows at a stage: see mechc_conditioning. */
MECHC_STATIC double mechc_gauss_conditioning(const mechc_integration *run, double h, int stage,
                                             const double *q)
{
#if MECHC_NH_MAX > 0
    const mechc_gauss *g = mechc_gauss_of(run);
    if (MECHC_NC == MECHC_NH && run->monitor.rank == MECHC_NH)
        return sqrt(g->least[stage]);
    return mechc_conditioning_at(run, run->head.t + mechc_gauss_nodes[stage] * h, q);
#else
    (void)run, (void)h, (void)stage, (void)q;
    return 1.0;
#endif
}

/* The configuration at a node between the step's ends. */
MECHC_STATIC void mechc_gauss_node(const mechc_integration *run, int node, double *q)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    const int stage = node - 1;
    for (int i = 0; i < MECHC_NQ; i++)
        q[i] = g->q[i][stage / MECHC_LANES][stage % MECHC_LANES];
}

/* The conditioning at the stages. */
MECHC_STATIC void mechc_gauss_meet(mechc_integration *run, double h)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    if (g->lowest > MECHC_CLEAR * MECHC_CLEAR) return;
    for (int stage = 0; MECHC_NH > 0 && stage < MECHC_STAGES; stage++) {
        double q[MECHC_NQ_MAX];
        mechc_gauss_node(run, stage + 1, q);
        mechc_monitor_meet(&run->monitor, mechc_gauss_conditioning(run, h, stage, q), q);
    }
}

/* Compute the end of a step if the step will be accepted or its end is needed to place a crossing. */
MECHC_STATIC int mechc_gauss_reached_end(const mechc_integration *run, double error)
{
    return error <= run->allowed
        || (mechc_gauss_of(run)->closing == MECHC_CLOSE_BEFORE && error < MECHC_GAUSS_SHOWS_END);
}

/* Compute the projected end, and its rates.  No rates are needed at the end of a run so near a
 * crossing that they would be rounding. */
MECHC_STATIC int mechc_gauss_end_rates(mechc_integration *run, double h, double *end)
{
    double *rates = MECHC_RATE(run, run->current->last_rate), sum[MECHC_NX_MAX];
    memcpy(sum, end, MECHC_NX * sizeof *end);
    const int status = mechc_rates_at(run, run->head.t + h, end, rates);
#if MECHC_NH_MAX > 0
    const int near = run->conditioning < MECHC_TOO_NEAR || status == MECHC_NOT_CLOSED;
    if (near && mechc_is_last(run, h) && mechc_knows_crossing(&run->monitor)) {
        memcpy(end, sum, MECHC_NX * sizeof *end);
        return mechc_rates_beside(run, run->head.t + h, -1.0, run->scale, end, rates);
    }
#endif
    return status;
}

/* Solve for the stages, by Newton's iteration where the plain one does not contract. */
MECHC_STATIC int mechc_gauss_solve(mechc_integration *run, double h)
{
    mechc_gauss *g = mechc_gauss_of(run);
    mechc_gauss_predict(g, h);
#if MECHC_NEWTON_CODE
    if (!MECHC_NEWTON) return mechc_gauss_converge(run, h);
    mechc_newton equations;
    mechc_gauss_prepare(run, h, &equations);
    int status = mechc_gauss_converge(run, h);
    if (status == MECHC_NOT_CLOSED && !g->stiff && g->closing == MECHC_UNPROJECTED) {
        mechc_gauss_stiffen(g);
        mechc_gauss_predict(g, h);
        mechc_gauss_prepare(run, h, &equations);
        if (g->newton) status = mechc_gauss_converge(run, h);
    }
    g->newton = NULL;
    return status;
#else
    return mechc_gauss_converge(run, h);
#endif
}

/* Make a step from the run's state; the end's rates are left where the explicit pairs leave them. */
MECHC_STATIC int mechc_gauss_step(mechc_integration *run, double h, double *end)
{
    mechc_gauss *g = mechc_gauss_of(run);
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        g->ends[i] = MECHC_RATE(run, 0)[MECHC_FIRST_UNKNOWN + i];
    memcpy(end, run->y, MECHC_NX * sizeof *end);
#if MECHC_NH_MAX > 0
    g->crossing = mechc_knows_crossing(&run->monitor) ? &run->monitor.known : NULL;
    g->alone = &run->given;
#endif
    mechc_gauss_weigh(run, g);
    const int status = mechc_gauss_solve(run, h);
    if (status != MECHC_RUNNING) return status;
    g->error = mechc_max(mechc_gauss_measure(g, h), mechc_gauss_stiff_error(run, h));
    if (!mechc_gauss_reached_end(run, g->error)) return status;
    if (!mechc_gauss_stays(run)) return MECHC_NOT_CLOSED;
    mechc_gauss_meet(run, h);
    mechc_gauss_end(g, run->y, h, end);
    return mechc_gauss_end_rates(run, h, end);
}

#if MECHC_SWITCHES_MAX
/* Switching functions at the step's start, its stages and its end. */
MECHC_RARE void mechc_gauss_switching(mechc_integration *run, double h, double *values)
{
    mechc_gauss *g = mechc_gauss_of(run);
    const int nodes = MECHC_STAGES + 2;
    const double t = run->head.t;
    double value[MECHC_SWITCHES_MAX], end[MECHC_NX_MAX];
    mechc_scalar_output_switching(t, run->y, run->y + MECHC_NQ, &run->given, value);
    for (int i = 0; i < MECHC_SWITCHES; i++) values[i * nodes] = value[i];
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        mechc_vector state[MECHC_NX_MAX], found[MECHC_SWITCHES_MAX];
        const mechc_vector time = t + h * mechc_take(mechc_gauss_nodes, block);
        mechc_gauss_states(g, run->y, h, block, state);
        for (int i = 0; i < MECHC_NQ; i++) state[i] += g->shift[i][block];
        mechc_vector_output_switching(time, state, state + MECHC_NQ, &g->given, found);
        for (int i = 0; i < MECHC_SWITCHES; i++)
            for (int lane = 0; lane < MECHC_LANES; lane++)
                values[i * nodes + 1 + block * MECHC_LANES + lane] = found[i][lane];
    }
    memcpy(end, run->y, MECHC_NX * sizeof *end);
    mechc_gauss_end(g, run->y, h, end);
    mechc_scalar_output_switching(t + h, end, end + MECHC_NQ, &run->given, value);
    for (int i = 0; i < MECHC_SWITCHES; i++) values[i * nodes + nodes - 1] = value[i];
}
#endif

MECHC_STATIC int mechc_gauss_limited(const mechc_integration *run, double h, const double *end,
                                     double error)
{
    (void)h, (void)end;
    return mechc_gauss_of(run)->shrinking > MECHC_GAUSS_SLOW && error < MECHC_GAUSS_NEEDLESS;
}

/* Store the polynomial of an accepted step. */
MECHC_STATIC void mechc_gauss_accept(mechc_integration *run, double h)
{
    mechc_gauss *g = mechc_gauss_of(run);
    memcpy(g->compensation, g->next_compensation, MECHC_NX * sizeof *g->compensation);
    memcpy(g->tried, g->rates, sizeof g->tried);
    g->last_step = h;
    g->last_factor = g->factor;
    mechc_gauss_count(g, mechc_gauss_limited(run, h, run->y, g->error));
}

MECHC_STATIC void mechc_gauss_dense(mechc_integration *run, double h, const double *end,
                                    int count, double *rows)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    for (int row = 0; row < MECHC_GAUSS_DENSE; row++)
        for (int i = 0; i < MECHC_NX; i++) {
            const double *first = mechc_gauss_first_dense + row * MECHC_STAGES;
            const double *second = mechc_gauss_second_dense + row * MECHC_STAGES;
            rows[row * MECHC_NX + i] =
                i < MECHC_FIRST_UNKNOWN ? h * h * mechc_sum(second, g->rates[i])
                                        : h * mechc_sum(first, g->rates[i - MECHC_FIRST_UNKNOWN]);
        }
    for (int i = 0; i < MECHC_NX; i++) rows[i] = end[i] - run->y[i];
    for (int i = MECHC_GAUSS_DENSE * MECHC_NX; i < count * MECHC_NX; i++) rows[i] = 0.0;
}

/* The longest step that can begin with the last step's polynomial. */
MECHC_STATIC double mechc_gauss_reach(const mechc_integration *run)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    if (g->last_step == 0.0) return HUGE_VAL;
    return fabs(g->last_step) * mechc_min(MECHC_GAUSS_FARTHEST, mechc_max(MECHC_GAUSS_HORIZON,
                                                                          MECHC_SAFETY * g->last_factor));
}

MECHC_STATIC void mechc_gauss_take_inputs(mechc_gauss *g, const mechc_integration *run)
{
    for (int lane = 0; lane < MECHC_LANES; lane++) g->given.inputs[lane] = run->given.inputs[0];
}

MECHC_STATIC void mechc_gauss_make(mechc_integration *run)
{
    mechc_gauss *g = mechc_gauss_of(run);
    memset(g, 0, sizeof *g);
    for (int j = 0; j < MECHC_STAGES; j++)
        g->columns[j] = (mechc_sums){mechc_gauss_weights[j], mechc_gauss_second_weights[j],
                                     mechc_gauss_top[j], mechc_gauss_next[j]};
    for (int i = 0; i < MECHC_NP; i++) g->given.p[i] = mechc_spread(run->given.p[i]);
    for (int i = 0; i < MECHC_CONSTANTS; i++) g->given.k[i] = mechc_spread(run->given.k[i]);
    mechc_gauss_take_inputs(g, run);
}

/* Begin without a polynomial to extrapolate, also for a run from lockstep whose steps Newton's
 * iteration limited. */
MECHC_STATIC void mechc_gauss_enter(mechc_integration *run)
{
    mechc_gauss *g = mechc_gauss_of(run);
    g->last_step = g->last_factor = 0.0;
    g->stiff = g->patience = g->slow = 0;
    if (run->alone && run->stiff) mechc_gauss_stiffen(g);
    run->stiff = 0;
    memset(g->compensation, 0, sizeof g->compensation);
}

/* Drop the polynomial at a kink of the inputs, over which it cannot be extrapolated. */
MECHC_STATIC void mechc_gauss_renew(mechc_integration *run)
{
    mechc_gauss *g = mechc_gauss_of(run);
    mechc_gauss_take_inputs(g, run);
    g->last_step = g->last_factor = 0.0;
}

static const mechc_method mechc_gauss8 = {
    MECHC_GAUSS8_TRAITS,
    .node = mechc_gauss_node,
#if MECHC_SWITCHES_MAX
    .switching = mechc_gauss_switching,
#endif
    .work_size = sizeof(mechc_gauss),
    .make = mechc_gauss_make,
    .enter = mechc_gauss_enter,
    .renew = mechc_gauss_renew,
    .step = mechc_gauss_step,
    .error = mechc_gauss_error,
    .ends_error = mechc_gauss_ends_error,
    .factor = mechc_gauss_factor,
    .shows_end = mechc_gauss_reached_end,
    .accept = mechc_gauss_accept,
    .limited = mechc_gauss_limited,
    .stays_alone = mechc_gauss_stays_alone,
    .reach = mechc_gauss_reach,
    .dense = mechc_gauss_dense,
};
