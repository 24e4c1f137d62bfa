/* Gauss-Legendre collocation with 8 stages in lockstep: a run in each lane, its stages one after
 * another.  The equations of a step, its error and its dense output are those of gauss.h.
 *
 * Stages in a loop may use what those before them have just given: the iteration sweeps over them as
 * Gauss and Seidel do, which contracts faster than all at once.  In the first sweep, from the
 * extrapolated polynomial of the last step, each stage besides corrects the prediction of the stages after
 * it: its difference from its own prediction is taken to vanish at the nodes before it, as an
 * interpolation's error does.
 *
 * Lanes converge each by itself.  One that has converged keeps its rates, however long others sweep.
 * One that does not converge continues alone by gauss8, which has Newton's iteration for stiff motions.
 */
#pragma once

#include "lockstep/advance.h"
#include "methods/gauss/stages.h"
#include "methods/traits.h"
#include "simd/bind_vector.h"
#include "simd/rough.h"
#include "simd/unbind.h"

#define MECHC_GAUSS_BACK 3 /* stages of the last step that the first sweep's differences vanish at */
#define MECHC_SWEEPS 20
#define MECHC_SWEEPS_LEFT 0.3 /* of what is tolerated: root of the sum of the changes' squares */
#define MECHC_GAUSS_FAR_BACK 1e6 /* steps: where a last step would be that says nothing of this one */

/* Rates at the stages of the last accepted step. */
typedef struct {
    double rates[MECHC_UNKNOWNS_MAX][MECHC_STAGES];
} mechc_gauss_last;

#if MECHC_LOCKSTEP_CODE && (MECHC_GENERAL || !MECHC_SWITCHES_MAX)
typedef struct {
    mechc_lockstep lanes;
    mechc_vector last[MECHC_UNKNOWNS_MAX][MECHC_STAGES], rates[MECHC_UNKNOWNS_MAX][MECHC_STAGES];
    mechc_vector weights[MECHC_UNKNOWNS_MAX]; /* the step over what is tolerated */
    mechc_vector error_weights[MECHC_UNKNOWNS_MAX];
    mechc_vector turns[MECHC_STAGES][MECHC_AT_LEAST_ONE(3 * MECHC_TURNS_MAX)]; /* see sine_cosine.h */
    mechc_vector floor;     /* changes that may be rounding */
    mechc_vector part;      /* of a change in the measured error */
    mechc_vector shrinking; /* from the second change to the third, squared; 0: no third */
    mechc_mask sweeping, failed;
} mechc_gauss_lanes;

MECHC_STATIC void mechc_gauss_lanes_load(mechc_lockstep *a, int lane, const mechc_integration *run)
{
    mechc_gauss_lanes *g = (mechc_gauss_lanes *)a;
    const mechc_gauss_last *last = run->work[MECHC_GAUSS8_LOCKSTEP];
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        for (int j = 0; j < MECHC_STAGES; j++) g->last[i][j][lane] = last->rates[i][j];
}

MECHC_STATIC void mechc_gauss_lanes_store(const mechc_lockstep *a, int lane, mechc_integration *run)
{
    const mechc_gauss_lanes *g = (const mechc_gauss_lanes *)a;
    mechc_gauss_last *last = run->work[MECHC_GAUSS8_LOCKSTEP];
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        for (int j = 0; j < MECHC_STAGES; j++) last->rates[i][j] = g->last[i][j][lane];
}

/* See mechc_gauss_weigh and mechc_gauss_floor. */
MECHC_INLINE void mechc_gauss_lanes_weigh(mechc_gauss_lanes *g)
{
    const mechc_lockstep *a = &g->lanes;
    const mechc_vector step = mechc_size_of(a->h);
    mechc_vector most = mechc_spread(0.0), loosest = most, turn = mechc_spread(MECHC_GAUSS_LARGE);
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_vector size = mechc_size_of(a->y[i]), scale = a->scale[i];
        const mechc_vector asked = a->of_scale * scale + (a->floor[i] + a->of_size * size);
        const mechc_vector digit = DBL_EPSILON * size;
        const mechc_vector tolerated = mechc_choose(asked > digit, asked, digit);
        const mechc_vector bound = mechc_lesser(tolerated, MECHC_GAUSS_LOOSEST * scale);
        const mechc_vector inverse = mechc_vector_rough_inverse(scale);
        const mechc_vector weight = mechc_vector_rough_inverse(bound);
        const int k = i - MECHC_FIRST_UNKNOWN;
        most = mechc_greater(most, scale * weight);
        loosest = mechc_greater(loosest, bound * inverse);
        if (i < MECHC_NQ) turn = mechc_greater(turn, size * inverse);
        if (k < 0) continue;
        g->weights[k] = step * weight;
        g->error_weights[k] = MECHC_GAUSS_SAFETY / MECHC_UNKNOWNS * (inverse * weight);
    }
    const double digits = MECHC_GAUSS_DIGIT / MECHC_GAUSS_LARGE;
    const mechc_vector noise =
        (MECHC_NC > 0 ? digits / MECHC_LOCKSTEP_LOW : MECHC_GAUSS_DIGITS_FREE * digits) * turn * most;
    g->floor = noise * noise;
    g->part = MECHC_GAUSS_SAFETY / MECHC_UNKNOWNS * loosest;
}

/* Start values: the last step's polynomial through its stages and its end, continued; without one
 * the rates at its end. */
MECHC_ONCE void mechc_gauss_lanes_predict(mechc_gauss_lanes *g)
{
    const mechc_lockstep *a = &g->lanes;
    const mechc_vector size = mechc_size_of(a->h);
    const mechc_mask known =
        (a->last_step > 0.0) & (size <= MECHC_GAUSS_GROWTH * a->last_step);
    const mechc_vector ratio = mechc_choose(known, size / a->last_step, mechc_spread(0.0));
    for (int i = 0; i < MECHC_STAGES; i++) {
        mechc_vector before[MECHC_STAGES + 1], after = mechc_spread(1.0), sum[MECHC_UNKNOWNS_MAX];
        const mechc_vector x = 1.0 + ratio * mechc_gauss_nodes[i];
        before[0] = after;
        for (int j = 0; j < MECHC_STAGES; j++) before[j + 1] = before[j] * (x - mechc_gauss_nodes[j]);
        const mechc_vector of_end = before[MECHC_STAGES] * mechc_gauss_barycentric[MECHC_STAGES];
        for (int k = 0; k < MECHC_UNKNOWNS; k++)
            sum[k] = of_end * a->rates[0][MECHC_FIRST_UNKNOWN + k];
        after = x - 1.0;
        for (int j = MECHC_STAGES - 1; j >= 0; j--) {
            const mechc_vector weight = before[j] * after * mechc_gauss_barycentric[j];
            for (int k = 0; k < MECHC_UNKNOWNS; k++) MECHC_ADD(sum[k], weight, g->last[k][j]);
            after *= x - mechc_gauss_nodes[j];
        }
        for (int k = 0; k < MECHC_UNKNOWNS; k++)
            g->rates[k][i] = mechc_choose(known, sum[k], a->rates[0][MECHC_FIRST_UNKNOWN + k]);
    }
}

/* How the difference at a node continues to those after it, as a product over the last step's end and
 * its last stages; the first step's prediction is right at its start alone. */
MECHC_INLINE void mechc_gauss_lanes_continue(const mechc_gauss_lanes *g, mechc_vector *products)
{
    const mechc_lockstep *a = &g->lanes;
    const mechc_vector size = mechc_size_of(a->h);
    const mechc_mask known =
        (a->last_step > 0.0) & (size <= MECHC_GAUSS_GROWTH * a->last_step);
    const mechc_vector back = mechc_choose(known, a->last_step / size, mechc_spread(MECHC_GAUSS_FAR_BACK));
    for (int j = 0; j < MECHC_STAGES; j++) {
        products[j] = mechc_spread(mechc_gauss_nodes[j]);
        for (int m = MECHC_STAGES - MECHC_GAUSS_BACK; m < MECHC_STAGES; m++)
            products[j] *= mechc_gauss_nodes[j] + (1.0 - mechc_gauss_nodes[m]) * back;
    }
}

/* The state at a stage, from the present rates. */
MECHC_INLINE void mechc_gauss_lanes_state(const mechc_gauss_lanes *g, int stage,
                                          mechc_vector *state)
{
    const mechc_lockstep *a = &g->lanes;
    const double *first = mechc_gauss_first + stage;
    mechc_vector once[MECHC_UNKNOWNS_MAX];
    for (int k = 0; k < MECHC_UNKNOWNS; k++) once[k] = first[0] * g->rates[k][0];
    const double *second = mechc_gauss_second + stage;
    mechc_vector twice[MECHC_NQ_MAX];
    for (int k = 0; k < MECHC_FIRST_UNKNOWN; k++) twice[k] = second[0] * g->rates[k][0];
    for (int j = 1; j < MECHC_STAGES; j++)
        for (int k = 0; k < MECHC_UNKNOWNS; k++) {
            MECHC_ADD(once[k], mechc_spread(first[j * MECHC_STAGES]), g->rates[k][j]);
            if (MECHC_IDENTITY_KINEMATICS)
                MECHC_ADD(twice[k], mechc_spread(second[j * MECHC_STAGES]), g->rates[k][j]);
        }
    for (int k = 0; k < MECHC_UNKNOWNS; k++) {
        const int i = MECHC_FIRST_UNKNOWN + k;
        state[i] = mechc_fused(a->h, once[k], a->y[i]);
        if (!MECHC_IDENTITY_KINEMATICS) continue;
        const mechc_vector change = mechc_fused(a->h, twice[k], mechc_gauss_nodes[stage] * a->y[i]);
        state[k] = mechc_fused(a->h, change, a->y[k]);
    }
}

/* Rates at a stage in the first sweep, with the conditioning. */
MECHC_ONCE void mechc_gauss_lanes_first(mechc_gauss_lanes *g, mechc_vector t, int stage,
                                        const mechc_vector *state, mechc_vector *rates)
{
    mechc_lockstep *a = &g->lanes;
    const mechc_vector met =
        mechc_lockstep_rates_at(a, t, state, g->turns[stage], 0, MECHC_NC == 0, rates);
    a->met = mechc_lesser(met, a->met);
}

/* Rates at a stage in later sweeps. */
MECHC_ONCE void mechc_gauss_lanes_again(mechc_gauss_lanes *g, mechc_vector t, int stage,
                                        const mechc_vector *state, mechc_vector *rates)
{
    mechc_lockstep_rates_at(&g->lanes, t, state, g->turns[stage], 1, 1, rates);
}

MECHC_INLINE void mechc_gauss_lanes_stage(mechc_gauss_lanes *g, int stage, int first,
                                          mechc_vector *rates)
{
    mechc_vector state[MECHC_NX_MAX];
    const mechc_vector t = g->lanes.t + mechc_gauss_nodes[stage] * g->lanes.h;
    mechc_gauss_lanes_state(g, stage, state);
    (first ? mechc_gauss_lanes_first : mechc_gauss_lanes_again)(g, t, stage, state, rates);
}

/* Sweep once over the stages; returns the sum of squares of the changes of rates over their tolerances. */
MECHC_ONCE mechc_vector mechc_gauss_lanes_sweep(mechc_gauss_lanes *g, int sweep)
{
    mechc_vector products[MECHC_STAGES], change = mechc_spread(0.0);
    if (sweep == 0) mechc_gauss_lanes_continue(g, products);
    for (int i = 0; i < MECHC_STAGES; i++) {
        mechc_vector rates[MECHC_NX_MAX], by[MECHC_UNKNOWNS_MAX];
        mechc_gauss_lanes_stage(g, i, sweep == 0, rates);
        for (int k = 0; k < MECHC_UNKNOWNS; k++) {
            by[k] = rates[MECHC_FIRST_UNKNOWN + k] - g->rates[k][i];
            const mechc_vector part = by[k] * g->weights[k];
            MECHC_ADD(change, part, part);
            g->rates[k][i] =
                mechc_choose(g->sweeping, rates[MECHC_FIRST_UNKNOWN + k], g->rates[k][i]);
        }
        if (sweep) continue;
        const mechc_vector inverse = 1.0 / products[i];
        for (int j = i + 1; j < MECHC_STAGES; j++) {
            const mechc_vector part = mechc_gauss_onward[i * MECHC_STAGES + j] * inverse * products[j];
            for (int k = 0; k < MECHC_UNKNOWNS; k++) MECHC_ADD(g->rates[k][j], part, by[k]);
        }
    }
    return change;
}

/* Root of the step's error over what is tolerated, squared: see mechc_gauss_measure. */
MECHC_INLINE mechc_vector mechc_gauss_lanes_measure(const mechc_gauss_lanes *g)
{
    mechc_vector squares = mechc_spread(0.0);
    for (int k = 0; k < MECHC_UNKNOWNS; k++) {
        mechc_vector top = mechc_gauss_top[0] * g->rates[k][0];
        mechc_vector next = mechc_gauss_next[0] * g->rates[k][0];
        for (int j = 1; j < MECHC_STAGES; j++) {
            MECHC_ADD(top, mechc_spread(mechc_gauss_top[j]), g->rates[k][j]);
            MECHC_ADD(next, mechc_spread(mechc_gauss_next[j]), g->rates[k][j]);
        }
        MECHC_ADD(squares, mechc_fused(next, next, top * top), g->error_weights[k]);
    }
    return g->lanes.h * g->lanes.h * squares;
}

/* The lanes that need no further sweep: see mechc_gauss_converge.  Changes and their rates are
 * squares.  A large error after three sweeps is the step's where it is more than what they still
 * change; where they contract slowly besides, the lane fails. */
MECHC_INLINE void mechc_gauss_lanes_settle(mechc_gauss_lanes *g, int sweep, mechc_vector change,
                                           mechc_vector rate, mechc_vector rate_before)
{
    const double fastest = MECHC_GAUSS_FASTEST * MECHC_GAUSS_FASTEST;
    const double stalls = MECHC_GAUSS_STALLS * MECHC_GAUSS_STALLS;
    const mechc_vector slowest = mechc_choose(rate > fastest, rate, mechc_spread(fastest));
    const mechc_vector left = MECHC_SWEEPS_LEFT * g->lanes.part;
    mechc_mask settled = change * slowest <= left * left;
    if (sweep > 1) {
        const mechc_mask noise = change <= g->floor;
        settled |= (rate > stalls) & noise & (rate * rate_before > stalls * stalls);
        if (sweep > 3) g->failed |= g->sweeping & ~noise & (rate > 4.0);
    }
    if (sweep == 2) {
        g->shrinking = mechc_choose(g->sweeping, rate, g->shrinking);
        const mechc_vector error = mechc_gauss_lanes_measure(g);
        const mechc_mask large = error > MECHC_GAUSS_HOPELESS * MECHC_GAUSS_HOPELESS;
        g->failed |= g->sweeping & large & (rate > MECHC_GAUSS_SLOW * MECHC_GAUSS_SLOW);
        settled |= large & (error > g->part * change);
    }
    g->failed |= g->sweeping & ~(change < HUGE_VAL);
    g->sweeping &= ~(settled | g->failed);
}

MECHC_INLINE void mechc_gauss_lanes_solve(mechc_gauss_lanes *g)
{
    mechc_vector before = mechc_spread(HUGE_VAL), rate_before = mechc_spread(0.0);
    g->sweeping = ~(mechc_mask){0};
    g->failed = (mechc_mask){0};
    g->shrinking = rate_before;
    for (int sweep = 0; sweep < MECHC_SWEEPS && mechc_any(g->sweeping); sweep++) {
        g->lanes.evaluations += g->sweeping & MECHC_STAGES;
        const mechc_vector change = mechc_gauss_lanes_sweep(g, sweep), rate = change / before;
        if (sweep) mechc_gauss_lanes_settle(g, sweep, change, rate, rate_before);
        before = change;
        rate_before = rate;
    }
    g->failed |= g->sweeping;
    g->lanes.stiff = (g->lanes.stiff & ~g->failed) | (g->failed & MECHC_GAUSS_LIMITED);
}

/* y plus a gain, by compensated summation. */
MECHC_INLINE void mechc_gauss_lanes_gain(mechc_lockstep *a, int i, mechc_vector gain)
{
    const mechc_vector whole = gain + a->compensation[i];
    a->end[i] = a->y[i] + whole;
    const mechc_vector moved = a->end[i] - a->y[i];
    a->next_compensation[i] = (a->y[i] - (a->end[i] - moved)) + (whole - moved);
}

/* The end of the step before it is projected. */
MECHC_INLINE void mechc_gauss_lanes_end(mechc_gauss_lanes *g)
{
    mechc_lockstep *a = &g->lanes;
    for (int k = 0; k < MECHC_UNKNOWNS; k++) {
        const int i = MECHC_FIRST_UNKNOWN + k;
        mechc_vector once = mechc_gauss_weights[0] * g->rates[k][0];
        for (int j = 1; j < MECHC_STAGES; j++)
            MECHC_ADD(once, mechc_spread(mechc_gauss_weights[j]), g->rates[k][j]);
        mechc_gauss_lanes_gain(a, i, a->h * once);
        if (!MECHC_IDENTITY_KINEMATICS) continue;
        mechc_vector twice = mechc_gauss_second_weights[0] * g->rates[k][0];
        for (int j = 1; j < MECHC_STAGES; j++)
            MECHC_ADD(twice, mechc_spread(mechc_gauss_second_weights[j]), g->rates[k][j]);
        const mechc_vector speed = a->y[i] + a->compensation[i];
        mechc_gauss_lanes_gain(a, k, a->h * mechc_fused(a->h, twice, speed));
    }
}

MECHC_ONCE void mechc_gauss_lanes_step(mechc_lockstep *a)
{
    mechc_gauss_lanes *g = (mechc_gauss_lanes *)a;
    mechc_gauss_lanes_weigh(g);
    mechc_gauss_lanes_predict(g);
    mechc_gauss_lanes_solve(g);
    mechc_gauss_lanes_end(g);
    mechc_lockstep_project(a, a->t + a->h, a->rates[MECHC_STAGES + 1]);
    a->evaluations += 1;
}

/* Root of the step's error over what is tolerated, squared, or of that beside its ends where this refuses
 * it: see mechc_gauss_ends_error. */
MECHC_INLINE mechc_vector mechc_gauss_lanes_error(mechc_lockstep *a)
{
    const mechc_gauss_lanes *g = (const mechc_gauss_lanes *)a;
    mechc_vector squares = mechc_spread(0.0), most = squares;
    for (int k = 0; k < MECHC_UNKNOWNS; k++) {
        const int i = MECHC_FIRST_UNKNOWN + k;
        mechc_vector before = a->rates[0][i], after = a->rates[MECHC_STAGES + 1][i];
        mechc_vector top = mechc_spread(0.0), next = top;
        for (int j = 0; j < MECHC_STAGES; j++) {
            MECHC_SUB(before, mechc_spread(mechc_gauss_continued[MECHC_STAGES - 1 - j]), g->rates[k][j]);
            MECHC_SUB(after, mechc_spread(mechc_gauss_continued[j]), g->rates[k][j]);
            MECHC_ADD(top, mechc_spread(mechc_gauss_top[j]), g->rates[k][j]);
            MECHC_ADD(next, mechc_spread(mechc_gauss_next[j]), g->rates[k][j]);
        }
        const mechc_vector off = mechc_greater(mechc_size_of(before), mechc_size_of(after));
        const mechc_vector left = mechc_size_of(top) + mechc_size_of(next);
        MECHC_ADD(squares, mechc_fused(next, next, top * top), g->error_weights[k]);
        most = mechc_greater(most, g->weights[k] * (off - MECHC_GAUSS_CONTINUES * left));
    }
    const mechc_vector inner = a->h * a->h * squares, beside = mechc_gauss_nodes[0] * most;
    const mechc_mask refused = (inner <= 1.0) & ~(beside <= 1.0);
    return mechc_choose(g->failed, mechc_spread(HUGE_VAL), mechc_choose(refused, beside, inner));
}

MECHC_INLINE mechc_mask mechc_gauss_lanes_limited(const mechc_lockstep *a)
{
    const double needless = MECHC_GAUSS_NEEDLESS * MECHC_GAUSS_NEEDLESS;
    const double slow = MECHC_GAUSS_SLOW * MECHC_GAUSS_SLOW;
    return (((const mechc_gauss_lanes *)a)->shrinking > slow) & (a->error < needless);
}

/* Store the polynomials of accepted steps. */
MECHC_INLINE void mechc_gauss_lanes_accept(mechc_lockstep *a, mechc_mask accepted)
{
    mechc_gauss_lanes *g = (mechc_gauss_lanes *)a;
    for (int k = 0; k < MECHC_UNKNOWNS; k++)
        for (int j = 0; j < MECHC_STAGES; j++)
            g->last[k][j] = mechc_choose(accepted, g->rates[k][j], g->last[k][j]);
}

/* Integral of an unknown in a row of the dense output. */
MECHC_INLINE mechc_vector mechc_gauss_lanes_row(const mechc_vector *rates, const double *table,
                                                int row)
{
    const double *weights = table + row * MECHC_STAGES;
    mechc_vector sum = weights[0] * rates[0];
    for (int j = 1; j < MECHC_STAGES; j++) MECHC_ADD(sum, mechc_spread(weights[j]), rates[j]);
    return sum;
}

MECHC_ONCE void mechc_gauss_lanes_dense(mechc_lockstep *a, mechc_vector *rows)
{
    const mechc_gauss_lanes *g = (const mechc_gauss_lanes *)a;
    for (int row = 1; row < MECHC_GAUSS_DENSE; row++)
        for (int k = 0; k < MECHC_UNKNOWNS; k++) {
            const mechc_vector *rates = g->rates[k];
            rows[row * MECHC_NX + MECHC_FIRST_UNKNOWN + k] =
                a->h * mechc_gauss_lanes_row(rates, mechc_gauss_first_dense, row);
            if (MECHC_IDENTITY_KINEMATICS)
                rows[row * MECHC_NX + k] =
                    a->h * a->h * mechc_gauss_lanes_row(rates, mechc_gauss_second_dense, row);
        }
    for (int i = 0; i < MECHC_NX; i++) rows[i] = a->end[i] - a->y[i];
}

/* Its steps are those of gauss8, however they were solved. */
static const mechc_lockstep_method mechc_gauss8_lanes = {
    .number = MECHC_GAUSS8,
    .last_rate = MECHC_STAGES + 1,
    .dense_rows = MECHC_GAUSS_DENSE,
    .growth = MECHC_GAUSS_GROWTH,
    .load = mechc_gauss_lanes_load,
    .store = mechc_gauss_lanes_store,
    .step = mechc_gauss_lanes_step,
    .error = mechc_gauss_lanes_error,
    .limited = mechc_gauss_lanes_limited,
    .accept = mechc_gauss_lanes_accept,
    .dense = mechc_gauss_lanes_dense,
};

MECHC_LOCKSTEP_TOGETHER(mechc_gauss8_together, mechc_gauss_lanes, mechc_gauss8_lanes)
#else
#define mechc_gauss8_together 0
#endif

MECHC_STATIC void mechc_gauss_lanes_make(mechc_integration *run)
{
    memset(run->work[MECHC_GAUSS8_LOCKSTEP], 0, sizeof(mechc_gauss_last));
}

/* Drop a polynomial of another motion, or from before a kink of the inputs. */
MECHC_STATIC void mechc_gauss_lanes_renew(mechc_integration *run)
{
    run->last_step = run->last_factor = 0.0;
}

static const mechc_method mechc_gauss8_lockstep = {
    MECHC_GAUSS8_LOCKSTEP_TRAITS,
    .together = mechc_gauss8_together,
    .work_size = sizeof(mechc_gauss_last),
    .make = mechc_gauss_lanes_make,
    .enter = mechc_gauss_lanes_renew,
    .renew = mechc_gauss_lanes_renew,
};
