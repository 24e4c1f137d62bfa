/* The rates at a step's ends against the polynomial of its stages.
 *
 * No stage lies before the first node or beyond the last one.  What the rates do there, as a steep but smooth
 * change of a force may, is in no coefficient of the polynomial; but it shows at the ends, whose rates are
 * known.  Where the motion is resolved they differ from the polynomial's by about its next coefficient.
 */
#pragma once

#include "methods/gauss/stiff.h"

/* The polynomial at the step's start and end, in place of the integrals of mechc_gauss_sums. */
enum { MECHC_CONTINUED_TO_START, MECHC_CONTINUED_TO_END };

MECHC_INLINE void mechc_gauss_ends_sums(const double *rates, mechc_sums *sums)
{
    *sums = (mechc_sums){0.0, 0.0, 0.0, 0.0};
    for (int j = 0; j < MECHC_STAGES; j++)
        *sums += rates[j] * (mechc_sums){mechc_gauss_continued[MECHC_STAGES - 1 - j],
                                         mechc_gauss_continued[j], mechc_gauss_top[j],
                                         mechc_gauss_next[j]};
}

/* The root of the error, over what is tolerated, by what the rates do between the ends that are judged and
 * the nodes next to them. */
MECHC_STATIC double mechc_gauss_ends_error(const mechc_integration *run, double h, int start, int end)
{
    const mechc_gauss *g = mechc_gauss_of(run);
    const double *ends = MECHC_RATE(run, run->current->last_rate) + MECHC_FIRST_UNKNOWN;
    double most = 0.0;
    if ((MECHC_NH > 0 && g->closing != MECHC_UNPROJECTED) || g->stiff) return 0.0;
    for (int i = 0; i < MECHC_UNKNOWNS; i++) {
        mechc_sums sums;
        mechc_gauss_ends_sums(g->rates[i], &sums);
        const double left = fabs(sums[MECHC_DEGREE_7]) + fabs(sums[MECHC_DEGREE_6]);
        const double before = start ? fabs(g->ends[i] - sums[MECHC_CONTINUED_TO_START]) : 0.0;
        const double after = end ? fabs(ends[i] - sums[MECHC_CONTINUED_TO_END]) : 0.0;
        const double beyond = mechc_max(before, after) - MECHC_GAUSS_CONTINUES * left;
        most = mechc_max(most, beyond * g->weights[MECHC_FIRST_UNKNOWN + i]);
    }
    return sqrt(mechc_gauss_nodes[0] * fabs(h) * most);
}
