/* The conditioning monitor: how well conditioned the rows are along a step, and whether a critical
 * configuration may be near.
 */
#pragma once

#include "singularities/critical.h"

/* The conditioning within one step, and what is known of critical configurations. */
typedef struct {
    double first, least, most;
    double q[MECHC_NQ_MAX]; /* time where it was least */
    int rank;           /* of the configuration rows at a generic place; 0: not known yet */
    int at_critical;    /* at the start fewer rows are independent */
    int tries;          /* since the last accepted step */
    double patience;    /* time before the crossing from which one step may cross it */
    double wanted;      /* the step that the error would have allowed, before it was shortened to
                           place a crossing; 0: was not */
    double ahead;       /* time to the next crossing; infinite: none near; NaN: not looked for */
    int leaving;        /* over the last step the conditioning rose */
    int bends;          /* a near miss ahead is so narrow that the motion curves sharply */
    int stayed;         /* times in a row that a shorter step did not lower the whole error */
    double fall;        /* of the conditioning in time, over the last step; 0: not known */
    mechc_critical known; /* the last one found */
    int has_known;
} mechc_monitor;

MECHC_STATIC void mechc_monitor_meet(mechc_monitor *monitor, double conditioning, const double *q)
{
    if (conditioning > monitor->most) monitor->most = conditioning;
    if (conditioning >= monitor->least) return;
    monitor->least = conditioning;
    memcpy(monitor->q, q, MECHC_NQ * sizeof *q);
}

/* Conditioning below which even short steps, with little change of it, are examined. */
#define MECHC_NARROW 0.03

/* Conditioning above which no crossing is near, however fast it falls. */
#define MECHC_CLEAR 0.4

/* Could the smallest singular value have reached zero on the way, or so many steps ahead? */
MECHC_STATIC int mechc_nears_critical(const mechc_monitor *monitor, double horizon)
{
    const int nearest_at_start = monitor->least >= monitor->first && monitor->first > MECHC_NARROW;
    return monitor->least < MECHC_CLEAR && !(nearest_at_start && monitor->leaving)
        && monitor->least <= mechc_max(MECHC_NARROW, horizon * (monitor->most - monitor->least));
}

/* Times after which what is left of an error is rounding: of a step far too long it stays once. */
#define MECHC_STAYED 3

MECHC_STATIC int mechc_only_rounding_is_left(const mechc_monitor *monitor)
{
    return monitor->stayed >= MECHC_STAYED;
}

/* Was the bend of a near miss found nearby? */
MECHC_STATIC int mechc_knows_bend(const mechc_monitor *monitor)
{
    return MECHC_NH > 0 && monitor->has_known && mechc_judge(&monitor->known) == MECHC_NEAR_MISS;
}

/* Was a crossing found nearby?  Beyond a near miss all is regular. */
MECHC_STATIC int mechc_knows_crossing(const mechc_monitor *monitor)
{
    return MECHC_NH > 0 && monitor->has_known && mechc_judge(&monitor->known) == MECHC_CROSSING;
}
