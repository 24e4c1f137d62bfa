/* Switching functions: arguments of Abs, sign, Max, Piecewise and the like, at whose zeros the
 * equations have a corner or a jump.  Between two zeros the motion is smooth, so steps end at them;
 * see Hairer, Norsett & Wanner (1993), section II.6.
 *
 * A step is judged by the values at its nodes and by the polynomial through them.  Where one
 * vanishes before the last node, rates of both forms are mixed in the step: it is cut so that the
 * zero lies between the last node and the end.  There all rates are of one form, and the step leads
 * on beyond the zero as that form would: where the polynomial vanishes the step has to end.  What
 * this does not settle in some attempts, as a body that dry friction holds, is left to the explicit
 * pair for a number of steps, each time twice as many.
 */
#pragma once

#include "run/zeros.h"
#include "stepping/chatter.h"
#include "stepping/control.h"
#include "stepping/knots.h"

#define MECHC_SWITCH_NODES (MECHC_MOST_NODES + 1)
#define MECHC_SWITCH_PIECES 4        /* between two nodes, in which a sign is looked for */
#define MECHC_SWITCH_HALVINGS 52     /* of the part of a step that holds a zero */
#define MECHC_SWITCH_SECTIONS 40     /* of the part that may hold two */
#define MECHC_SWITCH_NEAR 1e-3       /* of the step: the end is corrected by one step of Newton's method */
#define MECHC_SWITCH_EXACT 3e-3      /* of rtol: the end of a step is so near to a zero, as a fraction of the step */
#define MECHC_SWITCH_FEATURE 2.0     /* the change of a feature's edges over the feature */
#define MECHC_SWITCH_ATTEMPTS 12
#define MECHC_SWITCH_ROW 16          /* steps in a row that end at zeros, within one that was planned */
#define MECHC_SWITCH_REST 32         /* steps that are left to the pair, at first */

/* Where in a step of any method they are evaluated: at the nodes of collocation. */
MECHC_STATIC const mechc_nodes *mechc_switch_nodes(const mechc_integration *run)
{
    return &run->methods[MECHC_GAUSS8]->nodes;
}

/* Whether a step's start or end is at a corner or a jump, where rounding decides which form its rates
 * have; those at the edge of a feature are smooth. */
MECHC_STATIC int mechc_is_at_switch(const int *at_zero)
{
    for (int k = 0; k < MECHC_FIRST_FEATURE; k++)
        if (at_zero[k]) return 1;
    return 0;
}

/* A switching function along a step: the polynomial through its values, divided by the fraction of
 * the step where it vanishes at the start. */
typedef struct {
    int first, last; /* nodes */
    const double *at;
    double noise; /* values as small are zero */
    double least; /* fraction of a step: no step is as short */
    double value[MECHC_SWITCH_NODES], weight[MECHC_SWITCH_NODES];
} mechc_switch_curve;

MECHC_STATIC void mechc_switch_weigh(mechc_switch_curve *curve)
{
    for (int i = curve->first; i <= curve->last; i++) {
        double product = 1.0;
        for (int j = curve->first; j <= curve->last; j++)
            if (j != i) product *= curve->at[i] - curve->at[j];
        curve->weight[i] = 1.0 / product;
    }
}

/* The value of a function, by the barycentric form. */
MECHC_STATIC double mechc_switch_value(void *context, double s)
{
    const mechc_switch_curve *curve = context;
    double above = 0.0, below = 0.0;
    for (int i = curve->first; i <= curve->last; i++) {
        if (s == curve->at[i]) return curve->value[i];
        const double part = curve->weight[i] / (s - curve->at[i]);
        above += part * curve->value[i];
        below += part;
    }
    return above / below;
}

/* Whether no value is as near to zero as the next one is to it. */
MECHC_STATIC int mechc_switch_is_far(const mechc_switch_curve *curve)
{
    double low = fabs(curve->value[curve->last]), change = 0.0;
    for (int i = curve->first; i < curve->last; i++) {
        low = mechc_min(low, fabs(curve->value[i]));
        change = mechc_max(change, fabs(curve->value[i + 1] - curve->value[i]));
    }
    return low > change;
}

/* The start of a curve that was divided: the function's rate there.  It counts where the function, if
 * it turns back from there, goes farther than noise: by about its square over four of the largest. */
MECHC_STATIC int mechc_switch_sample_start(mechc_switch_curve *curve, mechc_point *points)
{
    double most = 0.0;
    const double rate = mechc_switch_value(curve, 0.0);
    for (int i = curve->first; i <= curve->last; i++)
        most = mechc_max(most, fabs(curve->value[i]));
    points[0] = (mechc_point){0.0, rate};
    return curve->first && rate * rate > curve->noise * most;
}

/* Sample the nodes and points between them, except where the function is zero; returns how many. */
MECHC_STATIC int mechc_switch_sample(mechc_switch_curve *curve, mechc_point *points)
{
    int count = mechc_switch_sample_start(curve, points);
    for (int i = curve->first; i <= curve->last; i++)
        for (int piece = MECHC_SWITCH_PIECES - 1; piece >= 0; piece--) {
            const double back = i > curve->first ? curve->at[i] - curve->at[i - 1] : 0.0;
            const double at = curve->at[i] - back * piece / MECHC_SWITCH_PIECES;
            const double value = mechc_switch_value(curve, at);
            const int repeated = piece > 0 && back == 0.0;
            if (repeated || fabs(value) * (curve->first ? at : 1.0) <= curve->noise) continue;
            points[count++] = (mechc_point){at, value};
        }
    return count;
}

/* The zero before a point, or the first of the zeros on both sides of it; infinite: there is none.  A parabola
 * with zeros near the middle of three points is nearer to zero there than one of the others is to it. */
MECHC_STATIC double mechc_switch_before(const mechc_searched *function, const mechc_point *here, int is_last)
{
    mechc_point low = here[-1], high = here[0], vertex;
    if (!(high.value * low.value < 0.0)) {
        if (is_last || !mechc_dips(here - 1, 0, 0, &vertex)
            || 2.0 * fabs(high.value) > mechc_max(fabs(low.value), fabs(here[1].value)))
            return HUGE_VAL;
        high = mechc_find_least(function, copysign(1.0, low.value), low, high, here[1], 0.0, MECHC_SWITCH_SECTIONS);
        if (!(high.value * low.value < 0.0)) return HUGE_VAL;
    }
    mechc_find_zero(function, &low, &high, 0.0, MECHC_SWITCH_HALVINGS, 0);
    return high.at;
}

/* The first zero, as a fraction of the step; infinite: there is none. */
MECHC_STATIC double mechc_switch_zero(mechc_switch_curve *curve)
{
    const mechc_searched function = {mechc_switch_value, curve};
    mechc_point points[MECHC_SWITCH_NODES * MECHC_SWITCH_PIECES];
    if (mechc_switch_is_far(curve)) return HUGE_VAL;
    const int count = mechc_switch_sample(curve, points);
    for (int i = 1; i < count; i++) {
        const double zero = mechc_switch_before(&function, points + i, i + 1 == count);
        if (zero < HUGE_VAL && zero >= curve->least) return zero;
    }
    return HUGE_VAL;
}

MECHC_STATIC void mechc_switch_curve_of(const mechc_integration *run, double h, int which,
                                        const double *values, double noise, mechc_switch_curve *curve)
{
    curve->least = 2.0 * MECHC_SMALLEST_STEP * mechc_max(fabs(run->head.t), fabs(run->t1 - run->head.t)) / fabs(h);
    curve->at = mechc_switch_nodes(run)->at;
    curve->last = mechc_switch_nodes(run)->count;
    curve->noise = noise;
    for (int i = 0; i <= curve->last; i++)
        curve->noise = mechc_max(curve->noise, MECHC_SWITCH_NOISE * DBL_EPSILON * fabs(values[i]));
    curve->first = run->switches.at_start[which] || fabs(values[0]) <= curve->noise;
    for (int i = curve->first; i <= curve->last; i++)
        curve->value[i] = curve->first ? values[i] / curve->at[i] : values[i];
    mechc_switch_weigh(curve);
}

/* The rounding of a function at the step's start, that of its terms: its slopes by the state, which are
 * differences, times the state.  Values that cancel, as of relative speeds in a motion that stays symmetric, are
 * no smaller. */
MECHC_RARE double mechc_switch_rounding(const mechc_integration *run, int which)
{
    double terms = 0.0;
#if MECHC_SWITCHES_MAX
    double y[MECHC_NX_MAX], here[MECHC_SWITCHES_MAX], beside[MECHC_SWITCHES_MAX];
    memcpy(y, run->y, MECHC_NX * sizeof *y);
    mechc_scalar_output_switching(run->head.t, y, y + MECHC_NQ, &run->given, here);
    for (int i = 0; i < MECHC_NX; i++) {
        const double change = MECHC_SWITCH_SLOPE * run->scale[i];
        y[i] = run->y[i] + change;
        mechc_scalar_output_switching(run->head.t, y, y + MECHC_NQ, &run->given, beside);
        y[i] = run->y[i];
        const double term = fabs((beside[which] - here[which]) / change * y[i]);
        if (term < HUGE_VAL) terms += term;
    }
#else
    (void)run, (void)which;
#endif
    return MECHC_SWITCH_NOISE * DBL_EPSILON * terms;
}

/* The tolerance, as a fraction of the step, for its end to be at a zero. */
MECHC_STATIC double mechc_switch_exact(const mechc_integration *run, double h, double noise,
                                       double slope)
{
    const double time = 4.0 * DBL_EPSILON * fabs(run->head.t / h);
    return mechc_max(MECHC_SWITCH_EXACT * run->rtol, mechc_max(time, 4.0 * noise / fabs(slope)));
}

/* The zero of one function, as a fraction of the step; infinite: there is none before its end, or it
 * is at the end, which is noted. */
MECHC_STATIC double mechc_switch_of(mechc_integration *run, double h, int which,
                                    const double *values)
{
    mechc_switches *switches = &run->switches;
    mechc_switch_curve curve;
    mechc_switch_curve_of(run, h, which, values, 0.0, &curve);
    double zero = mechc_switch_zero(&curve);
    if (zero < HUGE_VAL) { /* which may be one of rounding */
        mechc_switch_curve_of(run, h, which, values, mechc_switch_rounding(run, which), &curve);
        zero = mechc_switch_zero(&curve);
    }
    switches->at_start[which] = curve.first;
    const double last = curve.value[curve.last];
    const double slope = (last - mechc_switch_value(&curve, 1.0 - MECHC_SWITCH_SLOPE)) / MECHC_SWITCH_SLOPE;
    const double beyond = -last / slope;
    if (!(fabs(beyond) <= MECHC_SWITCH_NEAR && zero > 1.0 - MECHC_SWITCH_NEAR)) return zero;
    switches->at_end[which] = fabs(beyond) <= mechc_switch_exact(run, h, curve.noise, slope);
    return switches->at_end[which] ? HUGE_VAL : 1.0 + beyond;
}

#if MECHC_KNOTTED_MAX
/* The first knot that an argument of a table comes to, as mechc_switch_of. */
MECHC_RARE double mechc_first_knot(mechc_integration *run, double h, int which, const double *values)
{
    mechc_switches *switches = &run->switches;
    const int last = mechc_switch_nodes(run)->count, was = switches->at_start[which];
    const double nearest = mechc_nearest_knot(which, values[0]);
    double beside[MECHC_SWITCH_NODES], first = HUGE_VAL;
    int start = 0, end = 0;
    for (double number = nearest - 1.0; number <= nearest + 1.0; number += 1.0) {
        const double knot = mechc_knot(which, number);
        if (!(fabs(knot) < HUGE_VAL)) continue;
        for (int i = 0; i <= last; i++) beside[i] = values[i] - knot;
        switches->at_start[which] = was && number == nearest;
        switches->at_end[which] = 0;
        first = mechc_min(first, mechc_switch_of(run, h, which, beside));
        start |= switches->at_start[which];
        if (!switches->at_end[which]) continue;
        const double slope = (values[last] - values[last - 1]) / (1.0 - mechc_switch_nodes(run)->at[last - 1]);
        const double next = mechc_knot(which, number + (slope > 0.0 ? 1.0 : -1.0));
        switches->next = mechc_min(switches->next, fabs(h * (next - values[last]) / slope));
        end = 1;
    }
    switches->at_start[which] = start;
    switches->at_end[which] = end;
    return first;
}
#endif

#if MECHC_WATCHED_BY_ALL_MAX
/* Switching functions at the nodes of a step of a method that does not keep its path: along the cubic
 * through states and rates of both ends. */
MECHC_RARE void mechc_switches_of_cubic(const mechc_integration *run, double h, const double *end,
                                        double *values)
{
    const double *before = MECHC_RATE(run, 0), *after = MECHC_RATE(run, run->current->last_rate);
    const mechc_nodes *nodes = mechc_switch_nodes(run);
    for (int node = 0; node <= nodes->count; node++) {
        const double s = nodes->at[node], rest = 1.0 - s;
        double y[MECHC_NX_MAX], found[MECHC_SWITCHES_MAX];
        for (int i = 0; i < MECHC_NX; i++) {
            const double gain = end[i] - run->y[i];
            y[i] = run->y[i] + s * gain
                 + s * rest * (rest * (h * before[i] - gain) + s * (gain - h * after[i]));
        }
        mechc_scalar_output_switching(run->head.t + s * h, y, y + MECHC_NQ, &run->given, found);
        for (int k = 0; k < MECHC_SWITCHES; k++) values[k * (nodes->count + 1) + node] = found[k];
    }
}
#endif

/* Whether the nodes of a step see a feature, since the step is no longer than it. */
MECHC_STATIC int mechc_sees_feature(int which, const double *values, int count)
{
    double low = values[0], high = values[0];
    if (which < MECHC_FIRST_FEATURE) return 0;
    for (int i = 1; i < count; i++) {
        low = mechc_min(low, values[i]);
        high = mechc_max(high, values[i]);
    }
    return high - low <= MECHC_SWITCH_FEATURE;
}

/* The first zero among all functions; of a method that does not keep its path among features. */
MECHC_RARE double mechc_first_switch(mechc_integration *run, double h, const double *end)
{
    const int nodes = mechc_switch_nodes(run)->count + 1;
    mechc_switches *switches = &run->switches;
    double values[MECHC_AT_LEAST_ONE(MECHC_SWITCHES_MAX) * MECHC_SWITCH_NODES], first = HUGE_VAL;
#if MECHC_WATCHED_BY_ALL_MAX
    if (MECHC_WATCHED_BY_ALL && !run->current->switching)
        mechc_switches_of_cubic(run, h, end, values);
#else
    (void)end;
#endif
    if (run->current->switching) run->current->switching(run, h, values);
    switches->next = HUGE_VAL;
    for (int k = run->current->switching ? 0 : MECHC_FIRST_KNOTTED; k < MECHC_SWITCHES; k++) {
        const double *own = values + k * nodes;
        double *size = &switches->size[k];
        if (mechc_sees_feature(k, own, nodes)) continue;
        for (int i = 0; i < nodes; i++) *size = fmax(*size, fabs(own[i]));
#if MECHC_KNOTTED_MAX
        if (mechc_has_knots(k)) {
            first = mechc_min(first, mechc_first_knot(run, h, k, own));
            continue;
        }
#endif
        first = mechc_min(first, mechc_switch_of(run, h, k, own));
    }
    int ends = 0; /* at a zero: then one just beyond is for the next step, or it would lead past this one */
    for (int k = 0; k < MECHC_SWITCHES; k++) ends |= switches->at_end[k];
    return ends && first > 1.0 ? HUGE_VAL : first;
}

/* Leave zeros to the pair for a while if the method may change; else the step's error alone decides. */
MECHC_RARE int mechc_leave_switches(mechc_integration *run, double h)
{
    mechc_switches *switches = &run->switches;
    switches->unwatched = 1;
    if (!run->when_stiff) return 0;
    switches->rest = switches->rests = mechc_max(2 * switches->rests, MECHC_SWITCH_REST);
    run->step = fabs(h);
    run->head.status = mechc_use_method(run, run->methods[MECHC_DOP853]) ? MECHC_RUNNING
                                                                         : MECHC_NO_MEMORY;
    return 1;
}

/* Return to switching functions after an accepted step of the pair. */
MECHC_STATIC void mechc_return_to_switches(mechc_integration *run)
{
    mechc_switches *switches = &run->switches;
    const int over = switches->rest > 0 && --switches->rest == 0;
    if (over && run->method == run->methods[MECHC_DOP853] && !run->resumed
        && !mechc_use_method(run, run->methods[run->number]))
        run->head.status = MECHC_NO_MEMORY;
}

/* Continue after a step that ended at a zero. */
MECHC_STATIC void mechc_leave_zero(mechc_integration *run)
{
    mechc_switches *switches = &run->switches;
    if (run->current->renew) run->current->renew(run);
    run->step = mechc_min(mechc_max(run->step, switches->planned), mechc_max(switches->next, mechc_smallest_step(run)));
    if (switches->row++ > 0) return;
    switches->row_t = run->head.t;
    switches->row_step = run->step;
}
/* Cut a step that can be judged, if a function vanishes in it. */
MECHC_RARE int mechc_cut_step(mechc_integration *run, double h, const double *end, int good)
{
    mechc_switches *switches = &run->switches;
    const mechc_nodes *nodes = mechc_switch_nodes(run);
    /* stages at the end of a step are of the form before a knot if it ends there at the latest */
    const int stages_at_end = MECHC_KNOTTED && !run->current->switching;
    const double last = stages_at_end ? 1.0 : nodes->at[nodes->count - 1], length = fabs(h);
    const double zero = mechc_first_switch(run, h, end);
    const int clean = zero > last; /* all rates are of one form */
    if (good && zero == HUGE_VAL) return 0;
    if (++switches->refused > MECHC_SWITCH_ATTEMPTS) return mechc_leave_switches(run, h);
    if (clean && (!good || zero * length >= fabs(run->t1 - run->head.t))) return 0;
    switches->planned = mechc_max(switches->planned, length);
    switches->cut = length * (clean ? zero : zero / (0.5 * (last + 1.0)));
    run->head.stats.rejected++;
    return 1;
}

/* Returns 1 if the step is to be tried again, since a switching function vanishes within it. */
MECHC_STATIC int mechc_cut_at_switch(mechc_integration *run, double h, const double *end, int status,
                                     double error)
{
    mechc_switches *switches = &run->switches;
    if (!MECHC_SWITCHES) return 0;
    memset(switches->at_end, 0, sizeof switches->at_end);
    switches->cut = 0.0;
    if (switches->unwatched || (!run->current->switching && !MECHC_WATCHED_BY_ALL)) return 0;
    if (status != MECHC_RUNNING && (status != MECHC_NOT_CLOSED || !run->current->switching)) return 0;
    return mechc_cut_step(run, h, end, error <= run->allowed);
}

/* Accept a step: the next one begins where it ended.  Returns the run's status. */
MECHC_STATIC int mechc_pass_switches(mechc_integration *run)
{
    mechc_switches *switches = &run->switches;
    int ended = 0, chatters = 0; /* steps from one knot to the next do not */
    if (!MECHC_SWITCHES) return MECHC_RUNNING;
    for (int k = 0; k < MECHC_SWITCHES; k++) {
        ended |= switches->at_end[k];
        chatters |= switches->at_end[k] && !mechc_has_knots(k);
    }
    memcpy(switches->at_start, switches->at_end, sizeof switches->at_start);
    if (ended) mechc_leave_zero(run);
    if (!chatters) switches->row = 0;
    mechc_watch_some_steps(run);
    switches->refused = switches->unwatched = 0;
    mechc_return_to_switches(run);
    if (switches->row > MECHC_SWITCH_ROW
        && fabs(run->head.t - switches->row_t) < switches->row_step)
        mechc_leave_switches(run, run->step);
    switches->planned = 0.0;
    return run->head.status;
}
