/* Placement of a crossing in a step: in the middle of a wide gap between the nodes, since the
 * nearest node decides how much the rounding of the closure is magnified. */
#pragma once

#include "simd/lanes.h"

/* The nodes of a method's rates, as fractions of the step; the last is the step's end. */
typedef struct {
    int count; /* before the end */
    const double *at;
} mechc_nodes;

/* Of the gap between a step's end and the node next to it, the part that a crossing may lie in. */
#define MECHC_BEFORE_A_NODE 0.4
/* Of a gap, on both sides of its middle: where a crossing is well inside. */
#define MECHC_WELL_INSIDE 0.2
/* Of the step: narrower gaps hold no crossing, nor those whose middle is beyond the second. */
#define MECHC_WIDE_GAP 0.08
#define MECHC_LAST_GAP 0.9
/* Steps ahead that a crossing still changes this one. */
#define MECHC_AHEAD 1.5
/* Of the time to a crossing, a step that ends before it; the next, a third longer, straddles it. */
#define MECHC_WELL_BEFORE 0.53

/* The longest step, up to `open`, that suits a crossing so far ahead: the crossing is in a wide gap
 * between the nodes, or well beyond the end. */
MECHC_STATIC double mechc_plan(mechc_nodes nodes, double ahead, double open)
{
    if (!(ahead < MECHC_AHEAD * open) || ahead < MECHC_BEFORE_A_NODE * nodes.at[1] * open)
        return open;
    for (int i = 1; ahead < open && i < nodes.count; i++) {
        const double gap = nodes.at[i + 1] - nodes.at[i];
        const double middle = nodes.at[i] + 0.5 * gap, near = MECHC_WELL_INSIDE * gap;
        if (gap < MECHC_WIDE_GAP || middle > MECHC_LAST_GAP || ahead > (middle + near) * open)
            continue;
        return ahead < (middle - near) * open ? ahead / middle : open;
    }
    return mechc_min(open, MECHC_WELL_BEFORE * ahead);
}

/* The longest step that suits a crossing and reaches the run's end.  A crossing near the end of the run lies
 * behind the step's last node, or in the middle of the gap before that node, in this step or the next. */
MECHC_STATIC double mechc_plan_to_end(mechc_nodes nodes, double ahead, double open)
{
    const double last = nodes.at[nodes.count - 1], before = nodes.at[nodes.count - 2];
    const double middle = 0.5 * (last + before), near = MECHC_WELL_INSIDE * (last - before);
    if (ahead >= (1.0 - MECHC_BEFORE_A_NODE * (1.0 - last)) * open) return open;
    if (ahead < (middle - near) * open) return mechc_plan(nodes, ahead, open);
    return ahead < (middle + near) * open ? open : open - (open - ahead) / (1.0 - middle);
}

/* The widest gap between a step's nodes, its middle, and the distance from the middle that is still
 * well inside. */
MECHC_STATIC void mechc_widest_gap(mechc_nodes nodes, double *low, double *best, double *high)
{
    double widest = 0.0;
    for (int i = 0; i < nodes.count; i++) {
        double next = 1.0;
        for (int j = 0; j < nodes.count; j++)
            if (nodes.at[j] > nodes.at[i]) next = mechc_min(next, nodes.at[j]);
        const double gap = next - nodes.at[i];
        if (gap <= widest) continue;
        widest = gap;
        *best = nodes.at[i] + 0.5 * gap;
    }
    *low = *best - MECHC_WELL_INSIDE * widest;
    *high = *best + MECHC_WELL_INSIDE * widest;
}
