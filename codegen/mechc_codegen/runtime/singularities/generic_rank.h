/* The number of constraint rows that are independent at generic configurations of the loops.
 *
 * Rows may be redundant on closed configurations only (Bennett's and Bricard's linkages, parallel
 * cranks).  At others the rest of a redundant row is the closure error, as large as an independent
 * row near a change point.  Their sizes do not distinguish them, but the rank does: it is found
 * once, at closed configurations, and every factorisation keeps as many rows.
 */
#pragma once

#include "abi/inputs.h"
#include "singularities/ordinary_rows.h"

#if MECHC_NC_MAX > 0
/* How much farther configurations near the start may be once their loops are closed: there may be
 * other ways to assemble the mechanism. */
#define MECHC_STILL_NEAR 10.0
/* Of a step a quarter as long: what closes the loops, between a quarter and a sixteenth. */
#define MECHC_SECOND_ORDER 0.125
/* Of one: how the components of a direction without symmetry differ. */
#define MECHC_UNEVEN 0.7

/* All rows at a configuration, of which so many count. */
MECHC_ONCE void mechc_factor_all(double t, const double *q, const mechc_scalar_given *given, double rank,
                                 mechc_scalar_place *place, mechc_scalar_factors *rows)
{
    mechc_scalar_locate_all(t, q, given, place);
    mechc_scalar_factor_rows(place->jacobian, place->mass, place->length, MECHC_NC, rank, rows);
}

MECHC_ONCE int mechc_rank_at(double t, const double *q, const mechc_scalar_given *given)
{
    mechc_scalar_place place;
    mechc_scalar_factors rows;
    double scale = 1.0;
    int rank = 1;
    mechc_factor_all(t, q, given, (double)MECHC_NC, &place, &rows);
    if (!(rows.norm[0] < HUGE_VAL)) return MECHC_NC;
    const double radian = place.ordinary_length / (MECHC_OF_A_RADIAN * MECHC_OF_A_RADIAN);
    const double longest = mechc_max(rows.norm[0], radian);
    for (; rank < MECHC_NC; rank++) {
        scale *= rows.scale[rank - 1];
        if (!(rows.norm[rank] > MECHC_NO_ROW * MECHC_NO_ROW * longest * (scale * scale)))
            break;
    }
    return rank;
}

#if MECHC_NH_MAX > 0
/* The rank where speed j has moved a little and the loops are closed again; 0: they cannot be. */
MECHC_STATIC int mechc_rank_beside(double t, const double *y, const mechc_scalar_given *given,
                                   int j)
{
    double step[MECHC_NU_MAX] = {0}, q[MECHC_NQ_MAX], farthest = 0.0;
    long unused = 0;
    mechc_scalar_place place;
    step[j] = MECHC_NEARBY * mechc_given_unit(given, MECHC_NQ + j);
    memcpy(q, y, MECHC_NQ * sizeof *q);
    mechc_scalar_displace(t, q, given, step);
    if (mechc_close_loops(t, q, given, &place, &unused) != MECHC_RUNNING) return 0;
    for (int i = 0; i < MECHC_NQ; i++)
        farthest = mechc_max(farthest, fabs(q[i] - y[i]) / mechc_given_unit(given, i));
    return farthest <= MECHC_STILL_NEAR * MECHC_NEARBY ? mechc_rank_at(t, q, given) : 0;
}
#endif

#if MECHC_NH_MAX > 0 && MECHC_NC_MAX == MECHC_NH_MAX
/* The size of the correction that closes the loops after q has moved by `step`; HUGE_VAL: none does. */
MECHC_STATIC double mechc_correction(double t, const double *q, const mechc_scalar_given *given,
                                     const double *step)
{
    double moved[MECHC_NQ_MAX], closed[MECHC_NQ_MAX], most = 0.0;
    long unused = 0;
    mechc_scalar_place place;
    memcpy(moved, q, MECHC_NQ * sizeof *q);
    mechc_scalar_displace(t, moved, given, step);
    memcpy(closed, moved, MECHC_NQ * sizeof *moved);
    if (mechc_close_loops(t, closed, given, &place, &unused) != MECHC_RUNNING)
        return HUGE_VAL;
    for (int i = 0; i < MECHC_NQ; i++)
        most = mechc_max(most, fabs(closed[i] - moved[i]) / mechc_given_unit(given, i));
    return most;
}

/* A direction that the rows that count allow, without symmetry; its largest component is 1. */
MECHC_STATIC void mechc_allowed_direction(double t, const double *q,
                                          const mechc_scalar_given *given, double *v)
{
    double still[MECHC_NU_MAX] = {0}, values[MECHC_NC_MAX] = {0}, of_time[MECHC_NC_MAX];
    double step[MECHC_NU_MAX];
    double most = 0.0;
    mechc_scalar_place place;
    mechc_scalar_factors rows;
    mechc_factor_all(t, q, given, given->k[MECHC_ROWS_THAT_COUNT], &place, &rows);
    for (int j = 0; j < MECHC_NU; j++)
        v[j] = (1.0 + MECHC_UNEVEN * sin(1.0 + 2.0 * j)) * mechc_given_unit(given, MECHC_NQ + j);
    mechc_scalar_velocity_residual(&place, v, values);
    mechc_scalar_velocity_residual(&place, still, of_time);
    for (int i = 0; i < MECHC_NC; i++) values[i] = of_time[i] - values[i];
    mechc_scalar_least_change(&rows, MECHC_NC, values, step);
    for (int j = 0; j < MECHC_NU; j++)
        most = mechc_max(most, fabs(v[j] += step[j]) / mechc_given_unit(given, MECHC_NQ + j));
    for (int j = 0; j < MECHC_NU; j++) v[j] /= mechc_max(most, DBL_MIN);
}

/* 1 where the configurations around q are a manifold whose tangents are all that the rows that
 * count allow.  Then what closes the loops after a step along a tangent is of second order in the
 * step; where branches meet it is of first order but for their own directions. */
MECHC_STATIC int mechc_manifold_at(double t, const double *q, const mechc_scalar_given *given)
{
    double v[MECHC_NU_MAX], less[MECHC_NU_MAX];
    mechc_allowed_direction(t, q, given, v);
    for (int j = 0; j < MECHC_NU; j++) less[j] = 0.25 * (v[j] *= MECHC_FOLLOWED);
    const double whole = mechc_correction(t, q, given, v);
    if (whole <= MECHC_NO_CORRECTION * MECHC_FOLLOWED) return 1;
    return whole < HUGE_VAL && mechc_correction(t, q, given, less) <= MECHC_SECOND_ORDER * whole;
}
#endif

/* The largest rank found at y and beside it.  The last of the constants is overwritten. */
MECHC_ONCE int mechc_count_rows(double t, const double *y, mechc_scalar_given *given)
{
    mechc_scalar_place place;
    mechc_locate(t, y, given, &place);
    if (mechc_scalar_conditioning_at(&place) > MECHC_NO_ROW) return MECHC_NC;
    const int here = mechc_rank_at(t, y, given);
    int most = here;
#if MECHC_NH_MAX > 0 && MECHC_NC_MAX == MECHC_NH_MAX
    given->k[MECHC_ROWS_THAT_COUNT] = here;
    if (MECHC_NC == MECHC_NH && here < MECHC_NC && mechc_manifold_at(t, y, given)) return here;
#endif
#if MECHC_NH_MAX > 0
    /* loops are closed by the rows that count here, or by all of them where more count elsewhere */
    for (int all = 0; here < MECHC_NC && all < 2; all++) {
        given->k[MECHC_ROWS_THAT_COUNT] = all ? MECHC_NC : here;
        for (int j = 0; j < MECHC_NU && !mechc_scalar_stopped(given); j++) {
            const int rank = mechc_rank_beside(t, y, given, j);
            if (rank > most) most = rank;
        }
    }
#endif
    return most;
}
#endif

/* Set what the constants say of the rows: their length, how they are elsewhere, how many count. */
MECHC_ONCE void mechc_know_rows(double t, const double *y, mechc_scalar_given *given)
{
#if MECHC_NC_MAX > 0
#if MECHC_NH_MAX > 0 && defined MECHC_SLIDES
    mechc_find_length(t, y, given);
#endif
#if MECHC_NH_MAX > 0 && !MECHC_WALKED && defined MECHC_ANGLES
    mechc_find_ordinary_rows(t, y, given);
#endif
    given->k[MECHC_ROWS_THAT_COUNT] = mechc_count_rows(t, y, given);
#else
    (void)t, (void)y, (void)given;
#endif
}

/* Set the constants, with the rank, for a run that starts at a state. */
MECHC_STATIC void mechc_give_at(double t, const double *y, const double *p,
                                const mechc_inputs *inputs, const int *stop,
                                mechc_scalar_given *given)
{
    mechc_give(p, inputs, given);
    given->stop = stop;
    mechc_know_rows(t, y, given);
}

/* The rows that count at a state by itself: as many as for a run that starts there. */
MECHC_RARE_ONCE int mechc_rows_of_state(double t, const double *q, const double *p,
                                        const mechc_inputs *inputs)
{
    mechc_scalar_given given;
    mechc_give(p, inputs, &given);
    mechc_know_rows(t, q, &given);
    return (int)given.k[MECHC_ROWS_THAT_COUNT];
}

/* Set the constants for states by themselves. */
MECHC_STATIC void mechc_give_alone(const double *p, const mechc_inputs *inputs,
                                   mechc_scalar_given *given)
{
    mechc_give(p, inputs, given);
    given->count = mechc_rows_of_state;
}
