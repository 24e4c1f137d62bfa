/* How many constraint rows are independent at generic configurations of the loops.
 *
 * Rows may be redundant on closed configurations only (Bennett's and Bricard's linkages, parallel
 * cranks).  At others the rest of a redundant row is the closure error, as large as an independent
 * row near a change point.  Their sizes do not distinguish them, but the rank does: it is found
 * once, at closed configurations, and every factorisation keeps as many rows.
 */
#pragma once

#include "abi/inputs.h"
#include "dynamics/scalar_stage.h"

#if MECHC_NC > 0
/* Of the longest row: a shorter one is redundant, or the start is near a change point. */
#define MECHC_NO_ROW 1e-6
/* How far each speed is moved to configurations near the start, and how much farther these may be
 * once their loops are closed: there may be other ways to assemble the mechanism. */
#define MECHC_NEARBY 1e-2
#define MECHC_STILL_NEAR 10.0

MECHC_ONCE int mechc_rank_at(double t, const double *q, const mechc_scalar_given *given)
{
    mechc_scalar_place place;
    mechc_scalar_factors rows;
    double scale = 1.0;
    int rank = 1;
    mechc_scalar_locate_all(t, q, given, &place);
    mechc_scalar_factor_rows(place.jacobian, place.mass, MECHC_NC, (double)MECHC_NC, &rows);
    if (!(rows.norm[0] < HUGE_VAL)) return MECHC_NC;
    for (; rank < MECHC_NC; rank++) {
        scale *= rows.scale[rank - 1];
        if (!(rows.norm[rank] > MECHC_NO_ROW * MECHC_NO_ROW * rows.norm[0] * (scale * scale)))
            break;
    }
    return rank;
}

#if MECHC_NH > 0
/* The rank where speed j has moved a little and the loops are closed again; 0: they cannot be. */
MECHC_STATIC int mechc_rank_beside(double t, const double *y, const mechc_scalar_given *given,
                                   int j)
{
    double step[MECHC_NU] = {0}, q[MECHC_NQ], farthest = 0.0;
    long unused = 0;
    mechc_scalar_place place;
    step[j] = MECHC_NEARBY;
    memcpy(q, y, sizeof q);
    mechc_scalar_displace(t, q, given, step);
    if (mechc_scalar_close_loops(t, q, given, &place, &unused) != MECHC_RUNNING) return 0;
    for (int i = 0; i < MECHC_NQ; i++) farthest = mechc_max(farthest, fabs(q[i] - y[i]));
    return farthest <= MECHC_STILL_NEAR * MECHC_NEARBY ? mechc_rank_at(t, q, given) : 0;
}
#endif

/* The most that is found at y and beside it.  The last of the constants is overwritten. */
MECHC_ONCE int mechc_count_rows(double t, const double *y, mechc_scalar_given *given)
{
    mechc_scalar_place place;
    mechc_scalar_locate(t, y, given, &place);
    if (mechc_scalar_conditioning_at(&place) > MECHC_NO_ROW) return MECHC_NC;
    const int here = mechc_rank_at(t, y, given);
    int most = here;
#if MECHC_NH > 0
    /* loops are closed by the rows that count here, or by all of them where more count elsewhere */
    for (int all = 0; here < MECHC_NC && all < 2; all++) {
        given->k[MECHC_NK] = all ? MECHC_NC : here;
        for (int j = 0; j < MECHC_NU && !mechc_scalar_stopped(given); j++) {
            const int rank = mechc_rank_beside(t, y, given, j);
            if (rank > most) most = rank;
        }
    }
#endif
    return most;
}
#endif

/* The same for a run that starts at a state. */
MECHC_STATIC void mechc_give_at(double t, const double *y, const double *p,
                                const mechc_inputs *inputs, const int *stop,
                                mechc_scalar_given *given)
{
    mechc_give(p, inputs, given);
    mechc_scalar_give_stop(given, stop);
#if MECHC_NC > 0
    given->k[MECHC_NK] = mechc_count_rows(t, y, given);
#else
    (void)t, (void)y;
#endif
}
