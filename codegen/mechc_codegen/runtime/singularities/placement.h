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

/* The longest step, up to `open`, that suits a crossing so far ahead: the crossing is in a wide gap
 * between the nodes, or well beyond the end. */
MECHC_STATIC double mechc_plan(mechc_nodes nodes, double ahead, double open)
{
    if (!(ahead < 1.5 * open)) return open;
    for (int i = 1; ahead < open && i < nodes.count; i++) {
        const double gap = nodes.at[i + 1] - nodes.at[i];
        const double middle = nodes.at[i] + 0.5 * gap, low = middle - 0.2 * gap;
        if (gap < 0.08 || middle > 0.9 || ahead > (middle + 0.2 * gap) * open) continue;
        return ahead < low * open ? ahead / middle : open;
    }
    return mechc_min(open, 0.53 * ahead); /* and the next, a third longer, straddles it */
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
