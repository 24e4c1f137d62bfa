/* Step control: from a step's error to the length of the next, after Hairer, Norsett & Wanner
 * (1993), section II.4.
 */
#pragma once

#include "run/method.h"
#include "run/rates.h"

/* Of the step that an error allows: by itself, and where it is predicted from the last one besides. */
#define MECHC_SAFETY 0.9
#define MECHC_PREDICTED_SAFETY 0.85
/* The least factor from a step to the next, and after one whose error was rounding. */
#define MECHC_SHRINKS 0.2
/* A step is lengthened so much where it then is the last. */
#define MECHC_TO_END 1.01
/* Error of a step, in scales, whose end still tells where it led. */
#define MECHC_SMALL_ERROR 1e-3

/* The first step: Hairer, Norsett & Wanner (1993), section II.4.  Squares, over the tolerance, of a
 * state or rate that is none; a step for these; the change of an Euler step and its error; a step
 * after an Euler step that failed; a rate that is constant; Euler steps that the first may be long. */
#define MECHC_FIRST_NOTHING 1e-10
#define MECHC_FIRST_OF_SPAN 1e-6
#define MECHC_FIRST_ERROR 0.01
#define MECHC_FIRST_OF_GUESS 1e-3
#define MECHC_FIRST_CONSTANT 1e-15
#define MECHC_FIRST_LONGER 100.0

/* Conditioning below which rounding counts as it is magnified. */
#define MECHC_POOR 0.2

/* Errors that rounding near a crossing may leave, in units of each component's scale. */
#define MECHC_ROUNDING_ALLOWED 1e-9

/* Tolerated error of one step per component: a share of the user's atol + rtol |y|, or of rtol
 * times the scale; never less than rounding, as a poor conditioning magnifies it. */
MECHC_STATIC double mechc_tolerance(const mechc_integration *run, int i, const double *end)
{
    const double size = mechc_max(fabs(run->y[i]), fabs(end[i]));
    const double low = MECHC_NH > 0 ? mechc_max(run->monitor.first, MECHC_NARROW) : 1.0;
    const double rounding = DBL_EPSILON / (low < MECHC_POOR ? low : 1.0);
    const double asked = run->has_tolerances ? run->tolerance[i] + run->rtol * size
                                             : run->rtol * run->scale[i];
    return mechc_max(run->method->share * asked, rounding * size);
}

/* Whether a step with such a small error ends near enough to the motion to be examined. */
MECHC_STATIC int mechc_error_is_small(const mechc_integration *run, double error)
{
    return error * run->method->share * run->rtol < MECHC_SMALL_ERROR;
}

/* The factor from this step's length to the next, by its error. */
MECHC_STATIC double mechc_elementary_factor(mechc_integration *run, double error)
{
    return MECHC_SAFETY * pow(error, -1.0 / run->current->order);
}

/* The predictive factor: the error grows as it did since the last step, whose length and factor are
 * given.  Gustafsson (1991). *factor is kept for the next step. */
MECHC_STATIC double mechc_predictive_factor(const mechc_integration *run, double error,
                                            double last_step, double last_factor, double *factor)
{
    const double plain = pow(error, -1.0 / run->current->order);
    *factor = plain;
    if (!(last_factor > 0.0) || error > 1.0) return MECHC_PREDICTED_SAFETY * plain;
    const double trend = run->step / fabs(last_step) * (plain / last_factor);
    return MECHC_PREDICTED_SAFETY * plain * mechc_min(1.0, trend);
}

/* The predictive factor within the limits of the method. */
MECHC_STATIC double mechc_limited_factor(mechc_integration *run, double error)
{
    const double most = run->refused ? 1.0 : run->current->growth;
    const double factor = run->current->factor(run, error);
    if (factor >= 1.0 && factor < run->current->ignored) return 1.0;
    return error > 0.0 ? mechc_min(most, mechc_max(MECHC_SHRINKS, factor)) : most;
}

/* The shortest step: a few times the spacing of doubles at this time.  At t = 0 they are as near as one
 * likes, so a start may be as steep. */
MECHC_STATIC double mechc_smallest_step(const mechc_integration *run)
{
    return mechc_max(MECHC_SMALLEST_STEP * fabs(run->head.t), DBL_MIN);
}

/* The part of the limits that holds t or begins after it; count if there is none. */
MECHC_STATIC ptrdiff_t mechc_limit_at(const mechc_step_limits *limits, double t, double direction)
{
    ptrdiff_t low = 0, high = limits->count;
    while (low < high) {
        const ptrdiff_t middle = low + (high - low) / 2;
        const double end = limits->times[direction > 0.0 ? middle + 1 : limits->count - 1 - middle];
        if (direction * (end - t) > 0.0) high = middle;
        else low = middle + 1;
    }
    return low;
}

/* A step shortened to what the limits allow: over parts with different limits the shares add up to
 * one.  Near a critical configuration the crossing decides instead. */
MECHC_RARE double mechc_within_limits(const mechc_integration *run, double step)
{
    const mechc_step_limits *limits = run->limits;
    const ptrdiff_t last = limits->count - 1;
    const double forwards = run->direction, t = run->head.t;
    double share = 1.0, before = 0.0;
    if (MECHC_NH > 0 && mechc_nears_critical(&run->monitor, run->horizon)) return step;
    for (ptrdiff_t n = mechc_limit_at(limits, t, forwards); n <= last && before < step; n++) {
        const ptrdiff_t part = forwards > 0.0 ? n : last - n;
        const double begin = limits->times[forwards > 0.0 ? part : part + 1];
        const double end = limits->times[forwards > 0.0 ? part + 1 : part];
        before = mechc_max(before, forwards * (begin - t));
        const double to_end = forwards * (end - t), longest = limits->longest[part];
        if (before + share * longest < to_end) return mechc_min(step, before + share * longest);
        share -= (to_end - before) / longest;
        before = to_end;
    }
    return step;
}

/* A step of this length, cut to the run's end or to half of the rest; returns 1 if it is the last. */
MECHC_STATIC int mechc_fit_to_end(const mechc_integration *run, double step, double *h)
{
    const double left = run->t1 - run->head.t;
    *h = run->direction * step;
    if (fabs(left) <= MECHC_TO_END * step) {
        *h = left;
        return 1;
    }
    if (fabs(left) < 2.0 * step) *h = 0.5 * left;
    return 0;
}

/* The change of the rates over a step by a rounding of the state to one side, over what is tolerated:
 * root mean square; HUGE_VAL where there are no rates. */
MECHC_RARE double mechc_rounding_beside(mechc_integration *run, double side, double h, const double *end)
{
    double y[MECHC_NX_MAX], rates[MECHC_NX_MAX], square = 0.0;
    const double t = run->head.t, by = side * DBL_EPSILON;
    for (int i = 0; i < MECHC_NX; i++) y[i] = run->y[i] + by * fabs(run->y[i]);
    if (mechc_rates_at(run, t + by * fabs(t), y, rates) != MECHC_RUNNING) return HUGE_VAL;
    for (int i = 0; i < MECHC_NX; i++)
        square += mechc_squared(h * (rates[i] - MECHC_RATE(run, 0)[i]) / mechc_tolerance(run, i, end));
    return sqrt(square / MECHC_NX);
}

/* The rounding in an explicit step's error, over what is tolerated: shorter steps do not lower it as an
 * error, and an estimate below it says nothing.  It is large beside gimbal lock, for instance.  The
 * estimate is a sum of rates, which round as the state's do and count by their weights.  At a jump one
 * side has no rounding, so the lesser one counts.  Near change points see mechc_learn_rounding. */
MECHC_RARE double mechc_rounding_of_error(mechc_integration *run, double h, const double *end)
{
    const mechc_tableau *tableau = run->current->tableau;
    const double conditioning = run->conditioning;
    double weights = 0.0, least = HUGE_VAL;
    if (!tableau || tableau->stability == 0.0 || run->outer) return 0.0;
    if (MECHC_NH > 0 && mechc_nears_critical(&run->monitor, run->horizon)) return 0.0;
    for (int i = 0; i <= tableau->stages; i++) weights += fabs(tableau->error[i]);
    for (double side = -1.0; side <= 1.0; side += 2.0)
        least = mechc_min(least, mechc_rounding_beside(run, side, h, end));
    run->conditioning = conditioning;
    return least < HUGE_VAL ? mechc_max(weights, 1.0) * least : 0.0;
}

/* Near a crossing an error that a shorter step hardly lowers is rounding, which grows the nearer
 * the nodes come: let it pass, for shrinking on would only creep onto the crossing.  In a bend it
 * passes as far as the projection of the step's end removes it. */
MECHC_STATIC void mechc_learn_rounding(mechc_integration *run, double h, double error)
{
    const double t = run->head.t, shrunk = fabs(h) / run->refused_step;
    const int again = run->refused_t == t && run->refused_step > 0.0 && shrunk < 1.0;
    const double most = MECHC_ROUNDING_ALLOWED / (run->method->share * run->rtol);
    const int stays = MECHC_NH > 0 && again && mechc_nears_critical(&run->monitor, run->horizon)
                   && error > run->refused_error * shrunk * shrunk * shrunk;
    if (stays && mechc_knows_crossing(&run->monitor))
        run->allowed = mechc_min(mechc_max(run->allowed, 4.0 * error),
                                 mechc_max(1.0, run->current->root_error ? sqrt(most) : most));
    if (!mechc_only_rounding_is_left(&run->monitor))
        run->monitor.stayed = stays && error <= most ? run->monitor.stayed + 1 : 0;
    run->refused_t = t;
    run->refused_step = fabs(h);
    run->refused_error = error;
}

/* Make an Euler step for the rates at its end, by which scales and the first step are chosen, no longer than
 * the longest.  Returns its length, negative where there are no rates. */
MECHC_STATIC double mechc_euler_step(mechc_integration *run, double longest)
{
    double state = 0.0, first = 0.0, largest = 0.0, end[MECHC_NX_MAX];
    for (int i = 0; i < MECHC_NX; i++) {
        const double tolerance = mechc_tolerance(run, i, run->y);
        state += mechc_squared(run->y[i] / tolerance);
        first += mechc_squared(MECHC_RATE(run, 0)[i] / tolerance);
        largest = mechc_max(largest, fabs(MECHC_RATE(run, 0)[i]) / tolerance);
    }
    const double span = fabs(run->t1 - run->head.t);
    double guess = state < MECHC_FIRST_NOTHING || first < MECHC_FIRST_NOTHING
                     ? MECHC_FIRST_OF_SPAN * span : MECHC_FIRST_ERROR * sqrt(state / first);
    if (!(first < HUGE_VAL)) guess = MECHC_FIRST_ERROR * (sqrt(state) / largest); /* squares overflow */
    guess = mechc_min(mechc_min(guess, longest), span);
    for (int i = 0; i < MECHC_NX; i++)
        end[i] = run->y[i] + run->direction * guess * MECHC_RATE(run, 0)[i];
    const double t = run->head.t + run->direction * guess;
    return mechc_rates_at(run, t, end, MECHC_RATE(run, 1)) == MECHC_RUNNING ? guess : -guess;
}

/* The first step, after an Euler step of the given length. */
MECHC_STATIC double mechc_first_step(const mechc_integration *run, double guess)
{
    if (guess <= 0.0) return -MECHC_FIRST_OF_GUESS * guess;
    double first = 0.0, second = 0.0;
    for (int i = 0; i < MECHC_NX; i++) {
        const double tolerance = mechc_tolerance(run, i, run->y);
        const double change = MECHC_RATE(run, 1)[i] - MECHC_RATE(run, 0)[i];
        first += mechc_squared(MECHC_RATE(run, 0)[i] / tolerance);
        second += mechc_squared(change / (guess * tolerance));
    }
    const double largest = sqrt(mechc_max(first, second) / MECHC_NX);
    if (!(largest < HUGE_VAL)) return guess;
    const double span = fabs(run->t1 - run->head.t);
    const double step = largest > MECHC_FIRST_CONSTANT
                        ? pow(MECHC_FIRST_ERROR / largest, 1.0 / run->method->order)
                        : mechc_max(MECHC_FIRST_OF_SPAN * span, MECHC_FIRST_OF_GUESS * guess);
    return mechc_min(mechc_min(MECHC_FIRST_LONGER * guess, step), run->max_step);
}
