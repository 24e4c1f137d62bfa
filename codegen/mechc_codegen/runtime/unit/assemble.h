/* Assembly: loops are closed by the coordinates that are not held, from a configuration near a closed one. */
#pragma once

#include <math.h>
#include <string.h>
#include "abi/codes.h"
#include "dynamics/project.h"

#define MECHC_ASSEMBLE_ITERATIONS 100
/* The longest change of a coordinate at once: the gap is taken as linear over it. */
#define MECHC_ASSEMBLE_STEP 0.3
#define MECHC_FORBIDDEN 0.01 /* of a residual: a smaller rest was not left whole */
#define MECHC_LEFT_BY_ROUNDING 64.0 /* units, of the terms */

#if MECHC_NC_MAX > 0
/* Remove held speeds from the equations: their columns of the rows vanish, and their inertia acts
 * on no other speed. */
MECHC_STATIC void mechc_hold(mechc_scalar_place *place, const unsigned char *held)
{
    for (int j = 0; held && j < MECHC_NU; j++) {
        if (!held[j]) continue;
        for (int i = 0; i < MECHC_NC; i++) place->jacobian[i * MECHC_NU + j] = 0.0;
        for (int k = 0; k < MECHC_NU; k++)
            if (k != j) place->mass[j * MECHC_NU + k] = place->mass[k * MECHC_NU + j] = 0.0;
    }
}

/* The least change of the speeds that are not held by which the rows take these values. */
MECHC_STATIC void mechc_change_beside(mechc_scalar_place *place, const mechc_scalar_given *given,
                                      const unsigned char *held, const double *values, double *step)
{
    mechc_scalar_factors rows;
    mechc_hold(place, held);
    mechc_scalar_factor_rows(place->jacobian, place->mass, place->length, MECHC_NC,
                             given->k[MECHC_ROWS_THAT_COUNT], &rows);
    mechc_scalar_least_change(&rows, MECHC_NC, values, step);
}

/* Speeds that satisfy the constraints; MECHC_NOT_CLOSED where those that are held forbid it. */
MECHC_STATIC int mechc_speeds_beside(double t, double *y, const mechc_scalar_given *given,
                                     const unsigned char *held)
{
    double before[MECHC_NC_MAX], after[MECHC_NC_MAX], step[MECHC_NU_MAX], *u = y + MECHC_NQ;
    mechc_scalar_place place;
    mechc_scalar_locate_all(t, y, given, &place);
    mechc_scalar_velocity_residual(&place, u, before);
    for (int i = 0; i < MECHC_NC; i++) before[i] = -before[i];
    mechc_change_beside(&place, given, held, before, step);
    for (int j = 0; j < MECHC_NU; j++) u[j] += step[j];
    mechc_scalar_locate_all(t, y, given, &place);
    mechc_scalar_velocity_residual(&place, u, after);
    double wanted = 0.0, left = 0.0, terms = 0.0;
    for (int i = 0; i < MECHC_NC; i++) {
        double sum = fabs(place.bias[i]);
        for (int j = 0; j < MECHC_NU; j++) sum += fabs(place.jacobian[i * MECHC_NU + j] * u[j]);
        terms = mechc_max(terms, sum);
        wanted = mechc_max(wanted, fabs(before[i]));
        left = mechc_max(left, fabs(after[i]));
    }
    /* the rows are linear in the speeds: what those that are held forbid is left whole */
    return left <= MECHC_FORBIDDEN * wanted || left <= MECHC_LEFT_BY_ROUNDING * DBL_EPSILON * terms
             ? MECHC_RUNNING : MECHC_NOT_CLOSED;
}
#endif

#if MECHC_NH_MAX > 0
/* Move q by a step, shortened if it is too long. */
MECHC_STATIC void mechc_move_beside(double t, double *q, const mechc_scalar_given *given,
                                    double *step)
{
    double longest = MECHC_ASSEMBLE_STEP;
    for (int j = 0; j < MECHC_NU; j++) longest = mechc_max(longest, fabs(step[j]));
    for (int j = 0; j < MECHC_NU; j++) step[j] *= MECHC_ASSEMBLE_STEP / longest;
    mechc_scalar_displace(t, q, given, step);
}

MECHC_STATIC int mechc_loops_beside(double t, double *q, const mechc_scalar_given *given,
                                    const unsigned char *held)
{
    double before = HUGE_VAL, rounding, values[MECHC_NC_MAX], step[MECHC_NU_MAX];
    mechc_scalar_place place;
    for (int iteration = 0; iteration < MECHC_ASSEMBLE_ITERATIONS; iteration++) {
        mechc_scalar_locate_all(t, q, given, &place);
        const double gap = mechc_scalar_gap(&place, q, &rounding);
        if (!(gap < HUGE_VAL)) return MECHC_NOT_FINITE;
        if (gap <= rounding || (gap <= MECHC_CLOSES * rounding && gap >= 0.25 * before))
            return MECHC_RUNNING;
        before = gap;
        mechc_scalar_gap_values(&place, values);
        mechc_change_beside(&place, given, held, values, step);
        mechc_move_beside(t, q, given, step);
    }
    return MECHC_NOT_CLOSED;
}
#endif

/* A state whose loops are closed to rounding; held speeds, and the coordinates that they move, do
 * not change. y is unchanged if there is none near. */
MECHC_ONCE int mechc_assemble_beside(double t, double *y, const mechc_scalar_given *given,
                                     const unsigned char *held)
{
#if MECHC_NC_MAX > 0
    double closed[MECHC_NX_MAX];
    int status = MECHC_RUNNING;
    memcpy(closed, y, MECHC_NX * sizeof *y);
#if MECHC_NH_MAX > 0
    status = mechc_loops_beside(t, closed, given, held);
#endif
    if (status == MECHC_RUNNING) status = mechc_speeds_beside(t, closed, given, held);
    if (status == MECHC_RUNNING) memcpy(y, closed, MECHC_NX * sizeof *y);
    return status;
#else
    (void)t, (void)y, (void)given, (void)held;
    return MECHC_RUNNING;
#endif
}
