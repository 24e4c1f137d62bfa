/* Where in a step a crossing is placed: in the middle of a wide gap between the nodes, since the
 * nearest node decides how much the rounding of the closure is magnified.
 */
#pragma once

#include "simd/lanes.h"

/* The nodes of a method's rates, as fractions of the step; the last is the step's end. */
typedef struct {
    int count; /* before the end */
    const double *at;
} mechc_nodes;

/* Of the gap between a step's end and the node next to it, the part that a crossing may lie in. */
#define MECHC_BEFORE_A_NODE 0.4

/* The longest step, up to `open`, that suits a crossing so far ahead: the crossing is in a wide gap
 * between the nodes, or well beyond the end. */
MECHC_STATIC double mechc_plan(mechc_nodes nodes, double ahead, double open)
{
    if (!(ahead < 1.5 * open) || ahead < MECHC_BEFORE_A_NODE * nodes.at[1] * open) return open;
    for (int i = 1; ahead < open && i < nodes.count; i++) {
        const double gap = nodes.at[i + 1] - nodes.at[i];
        const double middle = nodes.at[i] + 0.5 * gap, low = middle - 0.2 * gap;
        if (gap < 0.08 || middle > 0.9 || ahead > (middle + 0.2 * gap) * open) continue;
        return ahead < low * open ? ahead / middle : open;
    }
    return mechc_min(open, 0.53 * ahead); /* and the next, a third longer, straddles it */
}

/* The same of a step that reaches the run's end: a crossing near it lies behind the last node, in the
 * middle of the gap before that one, or will of the next step. */
MECHC_STATIC double mechc_plan_to_end(mechc_nodes nodes, double ahead, double open)
{
    const double last = nodes.at[nodes.count - 1], before = nodes.at[nodes.count - 2];
    const double middle = 0.5 * (last + before), near = 0.2 * (last - before);
    if (ahead >= (1.0 - MECHC_BEFORE_A_NODE * (1.0 - last)) * open) return open;
    if (ahead < (middle - near) * open) return mechc_plan(nodes, ahead, open);
    return ahead < (middle + near) * open ? open : open - (open - ahead) / (1.0 - middle);
}

/* The widest gap between a step's nodes, its middle, and how far from the middle is still well
 * inside. */
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
    *low = *best - 0.2 * widest;
    *high = *best + 0.2 * widest;
}
