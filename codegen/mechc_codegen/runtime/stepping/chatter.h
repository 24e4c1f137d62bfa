/* Steps without end about one jump of the equations. */
#pragma once

#include "run/rates.h"
#include "stepping/knots.h"
#include "stepping/lockstep_fit.h"

#define MECHC_CHATTER_TURNS 8       /* ends of steps no nearer to the jump, among those watched */
#define MECHC_CHATTER_BESIDE 0.125  /* of the distance to a zero: places on both sides of it */
#define MECHC_CHATTER_LASTS 0.5     /* of the rate so far away: what a continuous rate is below there */
#define MECHC_CHATTER_EVEN 0.01     /* of a rate: differences so small are none */
#define MECHC_SWITCH_NOISE 64.0     /* roundings of the largest value of a step, or of its terms, that count as zero */
#define MECHC_SWITCH_SLOPE 1e-4     /* of the step, or of a component's scale, over which a slope is a difference */

#if MECHC_SWITCHES_MAX
/* A state with its switching functions, and what these are a moment later. */
typedef struct {
    double t, y[MECHC_NX_MAX], rates[MECHC_NX_MAX];
    double value[MECHC_SWITCHES_MAX], later[MECHC_SWITCHES_MAX];
} mechc_switch_place;

MECHC_RARE int mechc_switches_at(mechc_integration *run, double moment, mechc_switch_place *place)
{
    double ahead[MECHC_NX_MAX];
    if (mechc_rates_at(run, place->t, place->y, place->rates) != MECHC_RUNNING) return 0;
    for (int i = 0; i < MECHC_NX; i++) ahead[i] = place->y[i] + moment * place->rates[i];
    mechc_scalar_output_switching(place->t, place->y, place->y + MECHC_NQ, &run->given, place->value);
    mechc_scalar_output_switching(place->t + moment, ahead, ahead + MECHC_NQ, &run->given, place->later);
    return 1;
}

MECHC_STATIC int mechc_is_at_zero(const mechc_integration *run, const mechc_switch_place *place, int k)
{
    return fabs(place->value[k]) <= MECHC_SWITCH_NOISE * DBL_EPSILON * run->switches.size[k];
}

/* Whether a function goes back to its zero, on which side it may be. */
MECHC_STATIC int mechc_switch_returns(const mechc_switch_place *place, int k)
{
    return place->value[k] * (place->later[k] - place->value[k]) < 0.0;
}

/* The place so much later in a straight line; 0: it cannot be evaluated. */
MECHC_RARE int mechc_switches_after(mechc_integration *run, const mechc_switch_place *here, double way,
                                    double moment, mechc_switch_place *there)
{
    there->t = here->t + way;
    for (int i = 0; i < MECHC_NX; i++) there->y[i] = here->y[i] + way * here->rates[i];
    return mechc_switches_at(run, moment, there);
}

/* Whether the motion is led to a function's zero from both sides next to it, by a jump: where rates are
 * continuous, as in a motion that comes to rest, the function's rate goes to zero with it, by equal factors
 * at distances that shrink by equal factors if it goes as a power. */
MECHC_RARE int mechc_leads_back(mechc_integration *run, const mechc_switch_place *here, int k,
                                double moment)
{
    mechc_switch_place before, behind, nearer;
    const double value = here->value[k], change = here->later[k] - value;
    const double way = -moment * value / change, beside = MECHC_CHATTER_BESIDE * way;
    if (!mechc_switches_after(run, here, way - beside, moment, &before)) return 0;
    if (!mechc_switches_after(run, here, way + beside, moment, &behind)) return 0;
    if (!mechc_switches_after(run, here, way - MECHC_CHATTER_BESIDE * beside, moment, &nearer)) return 0;
    const double next = before.later[k] - before.value[k], last = nearer.later[k] - nearer.value[k];
    const int lasts = fabs(next) > MECHC_CHATTER_LASTS * fabs(change)
                   && fabs(next - last) <= MECHC_CHATTER_LASTS * fabs(change - next) + MECHC_CHATTER_EVEN * fabs(next);
    const int straight = before.value[k] * value > 0.0 && behind.value[k] * value < 0.0;
    return straight && lasts && mechc_switch_returns(&before, k) && mechc_switch_returns(&behind, k);
}

/* Look for a jump to which the motion is led back from both sides, as friction by sign(v) does: steps
 * go to and fro across it without end, since there is no motion off it (Filippov 1988).  Each of
 * them ends at the function's zero or where it goes back there, yet often no nearer than before. */
MECHC_RARE void mechc_watch_chatter(mechc_integration *run)
{
    mechc_switches *switches = &run->switches;
    mechc_switch_place here;
    const double moment = run->direction * MECHC_SWITCH_SLOPE * run->step;
    here.t = run->head.t;
    memcpy(here.y, run->y, MECHC_NX * sizeof *run->y);
    if (!mechc_switches_at(run, moment, &here)) return;
    for (int k = 0; k < MECHC_SWITCHES; k++) {
        const double before = switches->side[k], value = here.value[k];
        const int at_zero = mechc_is_at_zero(run, &here, k), returns = mechc_switch_returns(&here, k);
        const int nearer = before * value > 0.0 && fabs(value) < fabs(before);
        if (mechc_has_knots(k)) continue;
        switches->side[k] = at_zero ? 0.0 : value;
        if (at_zero) continue;
        switches->turns[k] = returns ? switches->turns[k] + !nearer : 0;
        if (switches->turns[k] <= MECHC_CHATTER_TURNS) continue;
        if (mechc_leads_back(run, &here, k, moment)) run->head.status = MECHC_CHATTERS;
        switches->turns[k] = 0;
    }
}

#else
MECHC_RARE void mechc_watch_chatter(mechc_integration *run) { (void)run; }
#endif

/* Watch some of the steps. */
MECHC_STATIC void mechc_watch_some_steps(mechc_integration *run)
{
    if (MECHC_IS_WATCHED(run->head.stats.steps)) mechc_watch_chatter(run);
    else memset(run->switches.turns, 0, sizeof run->switches.turns);
}
