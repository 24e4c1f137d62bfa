/* Derivatives over the jumps of a law, at the zeros of switching functions.
 *
 * Where g(t, y, p) vanishes and the rates jump from f to f + d, columns S become
 * S - d (g_y S + g_p) / g', g' = g_t + g_y f: another motion comes to the zero later or earlier
 * (the saltation matrix; Leine & Nijmeijer 2004, chapter 7, without a reset).  Corners have no jump,
 * and change nothing.  Rates on both sides, and g's derivatives, are differences.
 */
#pragma once

#include "abi/variation.h"
#include "run/dense_output.h"
#include "stepping/knots.h"
#include "variational/states.h"

#if MECHC_VARIATIONAL && MECHC_SWITCHES_MAX
#define MECHC_JUMP_APART 1e-5  /* of a step: how far beside a zero differences are taken, */
#define MECHC_JUMP_LEAST 1e-9  /* at least, of the time in which a component moves by its unit */
#define MECHC_JUMP_MOVE 1e-4   /* of an argument, for differences of fourth order */
#define MECHC_JUMP_NONE 1e-7   /* of the rates: a smaller jump is the rounding of these differences */
#define MECHC_JUMP_REST 1e-12  /* of the largest rate: what rests moves by as much rounding */
#define MECHC_JUMP_GRAZES 1e-6 /* of what a function changes by in a step: as slow a change is none */
#define MECHC_JUMP_ALIKE 1e-6  /* of a derivative: zeros at one instant that differ by more are two */

/* A step of a run whose jumps are looked for. */
typedef struct {
    const mechc_trajectory *record;
    const mechc_given_twice *given;
    ptrdiff_t step;
    double t, h; /* its start and length */
    double zero[MECHC_SWITCHES_MAX]; /* of its functions: 0, or the knot at which it ends */
} mechc_jump_place;

/* A zero of a switching function in a step; t: NaN where there is none. */
typedef struct {
    int which;
    double t;
} mechc_jump_zero;

/* How the time of a zero moves, and by how much the rates jump there. */
typedef struct {
    double later[MECHC_SLOPES_MAX], jump[MECHC_NX_MAX];
} mechc_jump;

/* The state of the run at a time in this step or beside it. */
MECHC_STATIC void mechc_jump_state(const mechc_jump_place *at, double t, double *y)
{
    const mechc_trajectory *record = at->record;
    const ptrdiff_t step = mechc_step_near(record, at->step, t);
    const double start = record->t[step];
    mechc_dense_polynomial(record->y + step * MECHC_NX,
                           record->dense + step * MECHC_NX * record->dense_rows, record->dense_rows,
                           (t - start) / (record->t[step + 1] - start), y);
}

MECHC_STATIC double mechc_jump_value(const mechc_scalar_given *given, int which, double t, const double *y)
{
    double values[MECHC_SWITCHES_MAX];
    mechc_scalar_output_switching(t, y, y + MECHC_NQ, given, values);
    return values[which];
}

MECHC_STATIC double mechc_jump_value_at(const mechc_jump_place *at, int which, double t)
{
    double y[MECHC_NX_MAX];
    mechc_jump_state(at, t, y);
    return mechc_jump_value(&at->given->scalar, which, t, y) - at->zero[which];
}

/* The time, a little after the start of a step, from which its zeros count. */
MECHC_STATIC double mechc_jump_from(const mechc_trajectory *record, ptrdiff_t step)
{
    const double *t = record->t + step;
    return step + 1 < record->count ? t[0] + MECHC_JUMP_APART * (t[1] - t[0])
                                    : t[0] - MECHC_JUMP_APART * (t[0] - t[-1]);
}

/* The first zero after `from` up to `last`, where functions have another sign. */
MECHC_STATIC mechc_jump_zero mechc_jump_first(const mechc_jump_place *at, double from, double last)
{
    mechc_jump_zero first = {0, NAN};
    double before[MECHC_SWITCHES_MAX], after[MECHC_SWITCHES_MAX], y[MECHC_NX_MAX];
    mechc_jump_state(at, from, y);
    mechc_scalar_output_switching(from, y, y + MECHC_NQ, &at->given->scalar, before);
    mechc_jump_state(at, last, y);
    mechc_scalar_output_switching(last, y, y + MECHC_NQ, &at->given->scalar, after);
    for (int k = 0; k < MECHC_SWITCHES; k++) {
        if ((before[k] > at->zero[k]) == (after[k] > at->zero[k])) continue;
        double low = from, high = last;
        for (int i = 0; i < 60; i++) {
            const double middle = 0.5 * (low + high);
            if ((mechc_jump_value_at(at, k, middle) > 0.0) == (after[k] > at->zero[k])) high = middle;
            else low = middle;
        }
        if (isnan(first.t) || fabs(high - from) < fabs(first.t - from))
            first = (mechc_jump_zero){k, high};
    }
    return first;
}

/* Rates at four states of the run. */
MECHC_STATIC void mechc_jump_rates(const mechc_jump_place *at, const double *t, double (*rates)[MECHC_NX])
{
    double y[4 * MECHC_NX_MAX];
    mechc_vector time, state[MECHC_NX_MAX], rate[MECHC_NX_MAX], block[MECHC_NX_MAX * MECHC_SLOPES_MAX];
    for (int i = 0; i < 4; i++) mechc_jump_state(at, t[i], y + i * MECHC_NX);
    for (int first = 0; first < 4; first += MECHC_LANES) {
        const int count = 4 - first < MECHC_LANES ? 4 - first : MECHC_LANES;
        const mechc_mask all = MECHC_NC > 0 ? ~(mechc_mask){0} : (mechc_mask){0};
        mechc_fill_lanes(t + first, count, 1, &time);
        mechc_fill_lanes(y + first * MECHC_NX, count, MECHC_NX, state);
        if (MECHC_NC > 0) mechc_keep_lanes(at->given, t + first, count, all, state);
        mechc_vector_linearise(time, state, &at->given->vector, all, rate, block);
        mechc_empty_lanes(rate, count, MECHC_NX, rates[first]);
    }
}

/* The time beside a zero over which differences are taken. */
MECHC_STATIC double mechc_jump_apart(const mechc_jump_place *at)
{
    double fastest = 0.0;
    for (int i = 0; i < MECHC_NX; i++) {
        const double *start = at->record->y + at->step * MECHC_NX + i;
        const double change = (start[MECHC_NX] - start[0]) / mechc_given_unit(&at->given->scalar, i);
        fastest = mechc_max(fastest, fabs(change / at->h));
    }
    const double least = fastest > 0.0 ? MECHC_JUMP_LEAST / fastest : 0.0;
    return copysign(mechc_max(MECHC_JUMP_APART * fabs(at->h), least), at->h);
}

/* Inputs of which one is moved. */
typedef struct {
    mechc_inputs inputs;
    const mechc_inputs *own;
    int which;
    double by;
} mechc_moved_input;

MECHC_STATIC void mechc_evaluate_moved(const mechc_inputs *inputs, int first, int last, double t,
                                       const double *q, const double *u, double *values)
{
    const mechc_moved_input *moved = (const mechc_moved_input *)inputs;
    moved->own->evaluate(moved->own, first, last, t, q, u, values);
    if (first <= moved->which && moved->which < last) values[moved->which - first] += moved->by;
}

/* The value where argument k (of the state, the parameters, the inputs) is moved. */
MECHC_STATIC double mechc_jump_moved(const mechc_jump_place *at, int which, double t, const double *y, int k,
                                     double by)
{
    mechc_scalar_given given = at->given->scalar;
    double moved[MECHC_NX_MAX];
    memcpy(moved, y, MECHC_NX * sizeof *y);
    if (k < MECHC_NX) {
        moved[k] += by;
        return mechc_jump_value(&given, which, t, moved);
    }
    if (k < MECHC_NX + MECHC_NP) {
        given.p[k - MECHC_NX] += by;
        mechc_scalar_make_constants(&given);
        return mechc_jump_value(&given, which, t, moved);
    }
    const mechc_inputs *own = given.inputs[0];
    const mechc_moved_input input = {
        {mechc_evaluate_moved, own->needs_state}, own, k - MECHC_NX - MECHC_NP, by};
    given.inputs[0] = &input.inputs;
    return mechc_jump_value(&given, which, t, moved);
}

/* The size of an argument of which differences are taken. */
MECHC_STATIC double mechc_jump_size(const mechc_jump_place *at, const double *y, int k)
{
    const mechc_scalar_given *given = &at->given->scalar;
    if (k < MECHC_NX) return mechc_max(mechc_given_unit(given, k), fabs(y[k]));
    const double p = k < MECHC_NX + MECHC_NP ? fabs(given->p[k - MECHC_NX]) : 0.0;
    return p > 0.0 ? p : 1.0;
}

MECHC_STATIC double mechc_jump_slope(const mechc_jump_place *at, int which, double t, const double *y, int k)
{
    const double by = MECHC_JUMP_MOVE * mechc_jump_size(at, y, k);
    const double near = mechc_jump_moved(at, which, t, y, k, by) - mechc_jump_moved(at, which, t, y, k, -by);
    const double far = mechc_jump_moved(at, which, t, y, k, 2.0 * by)
                     - mechc_jump_moved(at, which, t, y, k, -2.0 * by);
    return (2.0 * near - 0.25 * far) / (3.0 * by);
}

/* Whether the rates jump from one side of a zero to the other, by more than their rounding: that of the
 * rates in the step, since a speed vanishes at its own zero, and of the largest, since parts may rest. */
MECHC_STATIC int mechc_jumps_beyond_rounding(const mechc_jump_place *at, const double *before,
                                             const double *after)
{
    const double end = at->t + at->h, t[] = {at->t, end, at->t, end};
    double all[4 * MECHC_NX_MAX], (*rates)[MECHC_NX] = (double (*)[MECHC_NX])all;
    double size[MECHC_NX_MAX], largest[2] = {0.0, 0.0}; /* of coordinates, of speeds */
    int jumps = 0;
    mechc_jump_rates(at, t, rates);
    for (int i = 0; i < MECHC_NX; i++) {
        double *most = &largest[i >= MECHC_NQ];
        size[i] = mechc_max(mechc_max(fabs(before[i]), fabs(after[i])),
                            mechc_max(fabs(rates[0][i]), fabs(rates[1][i])));
        *most = mechc_max(*most, size[i] / mechc_given_unit(&at->given->scalar, i));
    }
    for (int i = 0; i < MECHC_NX; i++) {
        const double rest = largest[i >= MECHC_NQ] * mechc_given_unit(&at->given->scalar, i);
        const double rounding = mechc_max(MECHC_JUMP_NONE * size[i], MECHC_JUMP_REST * rest);
        jumps |= fabs(after[i] - before[i]) > rounding;
    }
    return jumps;
}

/* The jump at a zero; 0 where the rates have none there.  The times of zeros that are only touched are no
 * numbers, and of those to which the motion is led back from both sides (Filippov 1988). */
MECHC_STATIC int mechc_jump_at(const mechc_jump_place *at, const mechc_jump_zero *zero, mechc_jump *out)
{
    double all[4 * MECHC_NX_MAX], (*rates)[MECHC_NX] = (double (*)[MECHC_NX])all;
    double y[MECHC_NX_MAX], before[MECHC_NX_MAX], after[MECHC_NX_MAX], beside[4];
    const double apart = mechc_jump_apart(at);
    const double t[] = {zero->t - 2.0 * apart, zero->t - apart, zero->t + apart, zero->t + 2.0 * apart};
    mechc_jump_rates(at, t, rates);
    for (int i = 0; i < MECHC_NX; i++) {
        before[i] = 2.0 * rates[1][i] - rates[0][i], after[i] = 2.0 * rates[2][i] - rates[3][i];
        out->jump[i] = after[i] - before[i];
    }
    if (!mechc_jumps_beyond_rounding(at, before, after)) return 0;
    mechc_jump_state(at, zero->t, y);
    const double value = mechc_jump_value_at(at, zero->which, zero->t);
    for (int i = 0; i < 4; i++) beside[i] = mechc_jump_value_at(at, zero->which, t[i]);
    const double rate = (3.0 * value - 4.0 * beside[1] + beside[0]) / (2.0 * apart);
    const double start = mechc_jump_value_at(at, zero->which, at->t);
    const int was = beside[1] > 0.0, is = beside[2] > 0.0;
    int passes = was != is && was == (beside[0] > 0.0) && is == (beside[3] > 0.0)
              && fabs(rate * at->h) >= MECHC_JUMP_GRAZES * fabs(start - value);
    double turn = 1.0; /* the function's rate after the jump, over that before */
    for (int k = 0; k < MECHC_SLOPES; k++) {
        out->later[k] = -mechc_jump_slope(at, zero->which, zero->t, y, k) / rate;
        if (k < MECHC_NX) turn -= out->later[k] * out->jump[k];
    }
    passes &= turn >= -MECHC_JUMP_NONE;
    for (int k = 0; k < MECHC_SLOPES && !passes; k++) out->later[k] = NAN;
    return 1;
}

/* Whether two zeros at one instant are of one law: their times move alike. */
MECHC_STATIC int mechc_jumps_alike(const mechc_jump_place *at, double t, const mechc_jump *one,
                                   const mechc_jump *other)
{
    double y[MECHC_NX_MAX], apart = 0.0, most = 0.0;
    mechc_jump_state(at, t, y);
    for (int k = 0; k < MECHC_SLOPES; k++) {
        const double size = mechc_jump_size(at, y, k);
        apart = mechc_max(apart, size * fabs(other->later[k] - one->later[k]));
        most = mechc_max(most, size * fabs(one->later[k]));
    }
    return apart <= MECHC_JUMP_ALIKE * most;
}

/* Find the first jump after *from, which is moved past it; 0 where there is none up to `last`.  Its
 * derivatives are no numbers where different laws jump at that instant. */
MECHC_STATIC int mechc_next_jump(const mechc_jump_place *at, double *from, double last, mechc_jump *jump)
{
    for (;;) {
        const mechc_jump_zero zero = mechc_jump_first(at, *from, last);
        if (isnan(zero.t)) return 0;
        const double apart = mechc_jump_apart(at), after = zero.t + apart;
        const int jumps = mechc_jump_at(at, &zero, jump);
        *from = (after - last) * at->h < 0.0 ? after : last;
        for (int k = 0; jumps && k < MECHC_SWITCHES; k++) {
            const mechc_jump_zero beside = {k, zero.t};
            mechc_jump other;
            const int was = mechc_jump_value_at(at, k, zero.t - apart) > 0.0;
            const int is = mechc_jump_value_at(at, k, *from) > 0.0;
            if (k != zero.which && was != is && mechc_jump_at(at, &beside, &other)
                && !mechc_jumps_alike(at, zero.t, jump, &other))
                for (int i = 0; i < MECHC_SLOPES; i++) jump->later[i] = NAN;
        }
        if (jumps) return 1;
    }
}

/* The affine map of the columns at a step's end over the jumps in it: NX rows of MECHC_SLOPES; 0
 * where there is none.  Explicit pairs step over a jump by a step as short as the tolerance says, so that it
 * counts at its end. */
MECHC_RARE int mechc_jumps_of_step(const mechc_given_twice *given, const mechc_trajectory *record,
                                   ptrdiff_t step, double *map)
{
    if (!MECHC_SWITCHES) return 0;
    const double *end = record->y + (step + 1) * MECHC_NX;
    mechc_jump_place at = {
        record, given, step, record->t[step], record->t[step + 1] - record->t[step], {0.0}};
    mechc_scalar_output_switching(record->t[step + 1], end, end + MECHC_NQ, &given->scalar, at.zero);
    for (int k = 0; k < MECHC_SWITCHES; k++) at.zero[k] = mechc_zero_near(k, at.zero[k]);
    double from = mechc_jump_from(record, step);
    const double last = mechc_jump_from(record, step + 1);
    mechc_jump jump;
    int count = 0;
    for (; mechc_next_jump(&at, &from, last, &jump); count++) {
        double moved[MECHC_SLOPES_MAX];
        for (int i = 0; !count && i < MECHC_NX; i++)
            for (int k = 0; k < MECHC_SLOPES; k++) map[i * MECHC_SLOPES + k] = i == k ? 1.0 : 0.0;
        for (int k = 0; k < MECHC_SLOPES; k++) {
            moved[k] = k < MECHC_NX ? 0.0 : jump.later[k];
            for (int i = 0; i < MECHC_NX; i++) moved[k] += jump.later[i] * map[i * MECHC_SLOPES + k];
        }
        for (int i = 0; i < MECHC_NX; i++)
            for (int k = 0; jump.jump[i] != 0.0 && k < MECHC_SLOPES; k++)
                map[i * MECHC_SLOPES + k] -= jump.jump[i] * moved[k];
    }
    return count > 0;
}
#endif
