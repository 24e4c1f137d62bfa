/* Radau IIA of order 5 for stiff scenes: three implicit stages by simplified Newton iteration.
 *
 * The rates are those of the projected state, so that a stage's closure is part of the equations
 * solved; their Jacobian is taken by differences in compiled code, and kept with its factors while
 * the iteration shrinks fast with it.  Hairer & Wanner (1996), section IV.8.
 */
#pragma once

#include "methods/lu.h"
#include "methods/traits.h"

#define MECHC_RADAU_SIZE (MECHC_RADAU_STAGES * MECHC_NX)
#define MECHC_RADAU_SIZE_MAX (MECHC_RADAU_STAGES * MECHC_NX_MAX)
#define MECHC_RADAU_ITERATIONS 10
#define MECHC_RADAU_LEFT 1e-2 /* of the tolerance, to the iteration */
#define MECHC_RADAU_CONTRACTS 0.95 /* the slowest contraction that is one */
#define MECHC_RADAU_NOISE 16.0 /* roundings of the state that a correction may be made of, */
#define MECHC_RADAU_ROUNDING 2e-16 /* of a component: of which a correction is made */
#define MECHC_RADAU_FLOORS 8.0 /* and that may be left */
#define MECHC_RADAU_SAME_TIME 1e-9 /* of a step, by which the end of it and a state differ */

/* A Jacobian is kept while the iteration shrinks to less than this a round with it. */
#define MECHC_RADAU_FAST 0.02
/* The polynomial is extrapolated to steps at most this many times as long. */
#define MECHC_RADAU_REACH 8.0

/* Work space of one implicit step, with the values kept from the last one. */
typedef struct {
    double jacobian[MECHC_NX_MAX * MECHC_NX_MAX];
    double jacobian_time;         /* of the state that it was taken at */
    double factored_step;         /* that the factors are for; 0: none */
    double contraction;           /* of the last iteration */
    double taken[MECHC_RADAU_SIZE_MAX], taken_step; /* stages of the last accepted step; 0: none */
    double tried_step, tried_end; /* of the last attempt */
    double system[MECHC_RADAU_SIZE_MAX * MECHC_RADAU_SIZE_MAX], filter[MECHC_NX_MAX * MECHC_NX_MAX];
    int system_rows[MECHC_RADAU_SIZE_MAX], filter_rows[MECHC_NX_MAX];
    double z[MECHC_RADAU_SIZE_MAX]; /* stages less the start */
    double error[MECHC_NX_MAX];
} mechc_radau;

MECHC_STATIC mechc_radau *mechc_radau_of(const mechc_integration *run)
{
    return run->work[MECHC_RADAU5];
}

/* The derivative of the projected rates by the state at the step's start, by differences. */
MECHC_STATIC int mechc_radau_jacobian(mechc_integration *run)
{
    mechc_radau *radau = mechc_radau_of(run);
    for (int j = 0; j < MECHC_NX; j++) {
        double y[MECHC_NX_MAX], rates[MECHC_NX_MAX];
        memcpy(y, run->y, MECHC_NX * sizeof *y);
        const double change = mechc_small_change(run->scale[j], y[j]);
        y[j] += change;
        const int status = mechc_rates_at(run, run->head.t, y, rates);
        if (status != MECHC_RUNNING) return status;
        for (int i = 0; i < MECHC_NX; i++)
            radau->jacobian[i * MECHC_NX + j] = (rates[i] - MECHC_RATE(run, 0)[i]) / change;
    }
    return MECHC_RUNNING;
}

/* Factor I - h A (x) J and I - h g J. */
MECHC_STATIC int mechc_radau_factor(mechc_integration *run, double h)
{
    mechc_radau *radau = mechc_radau_of(run);
    const double *matrix = run->current->tableau->matrix;
    for (int a = 0; a < MECHC_RADAU_STAGES; a++)
        for (int b = 0; b < MECHC_RADAU_STAGES; b++) {
            const double weight = h * matrix[(a + 1) * MECHC_MOST_RATES + b + 1];
            for (int i = 0; i < MECHC_NX; i++)
                for (int j = 0; j < MECHC_NX; j++)
                    radau->system[(a * MECHC_NX + i) * MECHC_RADAU_SIZE + b * MECHC_NX + j] =
                        (a == b && i == j) - weight * radau->jacobian[i * MECHC_NX + j];
        }
    for (int i = 0; i < MECHC_NX; i++)
        for (int j = 0; j < MECHC_NX; j++)
            radau->filter[i * MECHC_NX + j] =
                (i == j) - h * MECHC_RADAU_GAMMA * radau->jacobian[i * MECHC_NX + j];
    return mechc_lu_factor(radau->system, radau->system_rows, MECHC_RADAU_SIZE, &run->given)
        && mechc_lu_factor(radau->filter, radau->filter_rows, MECHC_NX, &run->given);
}

/* Rates at the stages without projection. */
MECHC_STATIC int mechc_radau_rates(mechc_integration *run, double h, double *end)
{
    mechc_radau *radau = mechc_radau_of(run);
    for (int a = 0; a < MECHC_RADAU_STAGES; a++) {
        for (int i = 0; i < MECHC_NX; i++) end[i] = run->y[i] + radau->z[a * MECHC_NX + i];
        const double t = run->head.t + run->current->tableau->nodes[a + 1] * h;
        const int status = mechc_rates_at(run, t, end, MECHC_RATE(run, a + 1));
        if (status != MECHC_RUNNING) return status;
    }
    return MECHC_RUNNING;
}

/* One Newton correction of the stages; its size over what is tolerated. */
MECHC_STATIC double mechc_radau_correct(mechc_integration *run, double h)
{
    mechc_radau *radau = mechc_radau_of(run);
    double change[MECHC_RADAU_SIZE_MAX], square = 0.0;
    for (int a = 0; a < MECHC_RADAU_STAGES; a++) {
        const double *row = run->current->tableau->matrix + (a + 1) * MECHC_MOST_RATES;
        for (int i = 0; i < MECHC_NX; i++) {
            double sum = -radau->z[a * MECHC_NX + i];
            for (int b = 1; b <= MECHC_RADAU_STAGES; b++)
                sum = mechc_scalar_fused(h * row[b], MECHC_RATE(run, b)[i], sum);
            change[a * MECHC_NX + i] = sum;
        }
    }
    mechc_lu_solve(radau->system, radau->system_rows, MECHC_RADAU_SIZE, change);
    for (int n = 0; n < MECHC_RADAU_SIZE; n++) {
        radau->z[n] += change[n];
        square += mechc_squared(change[n] / mechc_tolerance(run, n % MECHC_NX, run->y));
    }
    return sqrt(square / MECHC_RADAU_SIZE);
}

/* Set the rates that the next step begins with. */
MECHC_STATIC int mechc_radau_end(mechc_integration *run, double h, double *end)
{
    const int last = MECHC_RADAU_STAGES - 1;
    for (int i = 0; i < MECHC_NX; i++)
        end[i] = run->y[i] + mechc_radau_of(run)->z[last * MECHC_NX + i];
    return mechc_rates_at(run, run->head.t + h, end, MECHC_RATE(run, last + 1));
}

/* Solve for the stages; MECHC_NOT_CLOSED where the iteration does not converge.  A small
 * correction proves nothing until a second one shows that they contract: a Jacobian differenced
 * across a jump makes all of them small. */
MECHC_STATIC int mechc_radau_solve(mechc_integration *run, double h, double *end)
{
    double before = HUGE_VAL, floor = 0.0;
    mechc_radau_of(run)->contraction = 0.0;
    for (int i = 0; i < MECHC_NX; i++) /* rounding of the state itself */
        floor = mechc_max(floor, MECHC_RADAU_ROUNDING * fabs(run->y[i]) / mechc_tolerance(run, i, run->y));
    for (int iteration = 0; iteration < MECHC_RADAU_ITERATIONS; iteration++) {
        const int status = mechc_radau_rates(run, h, end);
        if (status != MECHC_RUNNING) return status;
        const double size = mechc_radau_correct(run, h);
        const double contraction = size / before;
        const int contracts = contraction <= MECHC_RADAU_CONTRACTS || size <= MECHC_RADAU_NOISE * floor;
        if (iteration) mechc_radau_of(run)->contraction = contraction;
        if (!(size < HUGE_VAL) || (iteration > 1 && !contracts)) return MECHC_NOT_CLOSED;
        const double left =
            iteration ? size * contraction / mechc_max(1.0 - contraction, 1.0 - MECHC_RADAU_CONTRACTS) : size;
        if ((iteration ? contracts : size <= MECHC_RADAU_NOISE * floor)
            && left <= mechc_max(MECHC_RADAU_LEFT, MECHC_RADAU_FLOORS * floor))
            return mechc_radau_end(run, h, end);
        before = size;
    }
    return MECHC_NOT_CLOSED;
}

/* The embedded error of order 3, filtered so that stiff components do not dominate it. */
MECHC_STATIC void mechc_radau_estimate(mechc_integration *run, double h, const double *rates)
{
    mechc_radau *radau = mechc_radau_of(run);
    for (int i = 0; i < MECHC_NX; i++) {
        double sum = h * rates[i];
        for (int a = 0; a < MECHC_RADAU_STAGES; a++)
            sum = mechc_scalar_fused(run->current->tableau->error[a + 1], radau->z[a * MECHC_NX + i], sum);
        radau->error[i] = MECHC_RADAU_GAMMA * sum;
    }
    mechc_lu_solve(radau->filter, radau->filter_rows, MECHC_NX, radau->error);
}

/* Start values: the polynomial through the last accepted step's start and stages, extrapolated. */
MECHC_STATIC void mechc_radau_predict(mechc_radau *radau, const double *nodes, double h)
{
    const double *stages = radau->taken, a = nodes[1], b = nodes[2];
    const double ratio = radau->taken_step != 0.0 ? h / radau->taken_step : HUGE_VAL;
    memset(radau->z, 0, sizeof radau->z);
    if (!(fabs(ratio) <= MECHC_RADAU_REACH)) return;
    for (int i = 0; i < MECHC_NX; i++) {
        const double chord = stages[2 * MECHC_NX + i];
        const double at_a = (stages[i] - a * chord) / (a * (1.0 - a));
        const double at_b = (stages[MECHC_NX + i] - b * chord) / (b * (1.0 - b));
        const double slope = (at_b - at_a) / (b - a);
        for (int stage = 0; stage < MECHC_RADAU_STAGES; stage++) {
            const double ahead = nodes[stage + 1] * ratio, x = 1.0 + ahead;
            radau->z[stage * MECHC_NX + i] =
                ahead * (chord - x * (at_a + (x - a) * slope));
        }
    }
}

/* Whether the state is that at which the last attempt ended. */
MECHC_STATIC int mechc_radau_follows(const mechc_integration *run)
{
    const mechc_radau *radau = mechc_radau_of(run);
    return !run->refused && radau->tried_step != 0.0
        && fabs(run->head.t - radau->tried_end) <= MECHC_RADAU_SAME_TIME * fabs(radau->tried_step);
}

/* Provide the Jacobian at this state, and factors for h, unless the present ones serve. */
MECHC_STATIC int mechc_radau_prepare(mechc_integration *run, double h, int anew)
{
    mechc_radau *radau = mechc_radau_of(run);
    if (anew && radau->jacobian_time != run->head.t) {
        const int status = mechc_radau_jacobian(run);
        if (status != MECHC_RUNNING) return status;
        radau->jacobian_time = run->head.t;
        radau->factored_step = 0.0;
    }
    if (radau->factored_step == h) return MECHC_RUNNING;
    radau->factored_step = 0.0;
    if (!mechc_radau_factor(run, h))
        return mechc_scalar_stopped(&run->given) ? MECHC_INTERRUPTED : MECHC_NOT_FINITE;
    radau->factored_step = h;
    return MECHC_RUNNING;
}

/* Make a step, with a Jacobian of an earlier state if that still serves. */
MECHC_STATIC int mechc_radau_step(mechc_integration *run, double h, double *end)
{
    mechc_radau *radau = mechc_radau_of(run);
    if (mechc_radau_follows(run)) {
        memcpy(radau->taken, radau->z, sizeof radau->taken);
        radau->taken_step = radau->tried_step;
    } else if (!run->refused) {
        radau->taken_step = 0.0;
        radau->contraction = 1.0;
    }
    radau->tried_step = h;
    radau->tried_end = run->head.t + h;
    for (int anew = radau->contraction > MECHC_RADAU_FAST;; anew = 1) {
        const int prepared = mechc_radau_prepare(run, h, anew);
        if (prepared != MECHC_RUNNING) return prepared;
        mechc_radau_predict(radau, run->current->tableau->nodes, h);
        const int status = mechc_radau_solve(run, h, end);
        if (status == MECHC_RUNNING || radau->jacobian_time == run->head.t) return status;
    }
}

MECHC_STATIC double mechc_radau_size(const mechc_integration *run, const double *end)
{
    double square = 0.0;
    for (int i = 0; i < MECHC_NX; i++)
        square += mechc_squared(mechc_radau_of(run)->error[i] / mechc_tolerance(run, i, end));
    return sqrt(square / MECHC_NX);
}

MECHC_STATIC double mechc_radau_error(mechc_integration *run, double h, const double *end)
{
    mechc_radau_estimate(run, h, MECHC_RATE(run, 0));
    const double size = mechc_radau_size(run, end);
    if (size < 1.0 || !(run->refused || run->head.stats.steps == 0)) return size;
    double y[MECHC_NX_MAX], rates[MECHC_NX_MAX];
    for (int i = 0; i < MECHC_NX; i++) y[i] = run->y[i] + mechc_radau_of(run)->error[i];
    if (mechc_rates_at(run, run->head.t, y, rates) != MECHC_RUNNING) return size;
    mechc_radau_estimate(run, h, rates);
    return mechc_radau_size(run, end);
}

/* Rows of the dense output, from the collocation polynomial: its difference from the chord is s (1
 * - s)(r1 + s r2). */
MECHC_STATIC void mechc_radau_dense(mechc_integration *run, double h, const double *end,
                                    int count, double *rows)
{
    const double *nodes = run->current->tableau->nodes, a = nodes[1], b = nodes[2];
    (void)h;
    for (int i = 0; i < MECHC_NX; i++) {
        const double chord = end[i] - run->y[i];
        const double at_a = (mechc_radau_of(run)->z[i] - a * chord) / (a * (1.0 - a));
        const double at_b = (mechc_radau_of(run)->z[MECHC_NX + i] - b * chord) / (b * (1.0 - b));
        const double slope = (at_b - at_a) / (b - a);
        rows[i] = chord;
        rows[MECHC_NX + i] = at_a - a * slope;
        rows[2 * MECHC_NX + i] = slope;
        for (int row = 3; row < count; row++) rows[row * MECHC_NX + i] = 0.0;
    }
}

MECHC_STATIC void mechc_radau_make(mechc_integration *run)
{
    mechc_radau *radau = mechc_radau_of(run);
    memset(radau, 0, sizeof *radau);
    radau->jacobian_time = NAN;
    radau->contraction = 1.0;
}

static const mechc_method mechc_radau5 = {
    MECHC_RADAU5_TRAITS,
    .work_size = sizeof(mechc_radau),
    .make = mechc_radau_make,
    .step = mechc_radau_step,
    .error = mechc_radau_error,
    .factor = mechc_elementary_factor,
    .shows_end = mechc_error_is_small,
    .dense = mechc_radau_dense,
};
