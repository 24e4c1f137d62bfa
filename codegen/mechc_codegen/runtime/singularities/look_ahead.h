/* Looking ahead: the next crossing is found before a step is tried, so that the step straddles it
 * with the crossing in a wide gap between its nodes, or ends well before it.
 */
#pragma once

#include "singularities/crossing.h"

#if MECHC_NH_MAX > 0
/* Steps within which the conditioning would vanish if it kept falling at this rate. */
#define MECHC_SOON 4.0

/* Gap over the length below which the motion past a near miss curves so sharply that the iteration
 * would magnify rounding there. */
#define MECHC_SHARP 1e-6

/* Time to the next crossing; it is searched for only where the conditioning is poor. */
MECHC_STATIC double mechc_look_ahead(const mechc_span *span, mechc_monitor *monitor)
{
    const double open = fabs(span->h);
    mechc_critical critical;
    mechc_scalar_place place;
    const int falls = !monitor->leaving
                   && (monitor->fall == 0.0 || monitor->first < MECHC_SOON * open * monitor->fall);
    if (monitor->first > MECHC_CLEAR || (monitor->first > MECHC_NARROW && !falls)) return HUGE_VAL;
    mechc_scalar_locate_all(span->t, span->start, span->given, &place);
    mechc_weakest weakest;
    mechc_find_weakest(place.jacobian, place.mass, place.length, place.ordinary_length, monitor->rank,
                       &weakest);
    const double reach =
        mechc_max(2.0 * mechc_reach(span, &place), mechc_beside(&weakest, &place));
    if (!mechc_find_near(span, span->start, &weakest, monitor, reach, &critical))
        return HUGE_VAL;
    if (!critical.curves) return HUGE_VAL;
    const double ahead = mechc_time_to(span, &critical);
    if (mechc_judge(&critical) == MECHC_CROSSING) return ahead;
    const int bend = fabs(critical.gap) < MECHC_SHARP * critical.rounding / DBL_EPSILON;
    monitor->bends = bend && (ahead < MECHC_AHEAD * open || monitor->first < MECHC_NARROW);
    return HUGE_VAL;
}

/* A step, usually no longer than that of the span, that ends well before the next crossing or has
 * it in a wide gap of its nodes.  reach: the longest step that the last step's polynomial may
 * begin; stages begun farther away could close on the other branch. */
MECHC_STATIC double mechc_plan_ahead(const mechc_span *span, mechc_monitor *monitor, int refused,
                                     double reach)
{
    double open = fabs(span->h);
    if (isnan(monitor->ahead)) monitor->ahead = mechc_look_ahead(span, monitor);
    /* so near that errors grow with every step that ends before it: cross it at once */
    if (monitor->first < MECHC_NARROW && monitor->ahead < HUGE_VAL && !refused)
        open = mechc_min(mechc_max(open, 2.0 * monitor->ahead), span->left);
    if (monitor->ahead >= MECHC_AHEAD * open) return open;
    const double most = mechc_min(open, reach);
    const double planned = most >= span->left
                         ? mechc_plan_to_end(span->nodes, monitor->ahead, most)
                         : mechc_plan(span->nodes, monitor->ahead, most);
    if (planned < open && !monitor->wanted) monitor->wanted = open;
    return planned;
}
#endif
