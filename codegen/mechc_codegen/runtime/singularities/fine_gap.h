/* Gaps of the loops beyond the rounding of doubles, near a crossing.
 *
 * Closing a loop whose gap has the rounding eps leaves q off the constraints by eps over the
 * conditioning, and from step to step by another amount: the level of the energy jumps by the work
 * of the reactions over that distance, and the direction of the motion is off by it over the
 * distance to the crossing.  A gap evaluated at the same q with a longer mantissa leaves the rounding
 * of q itself, whatever the conditioning is.
 *
 * The gap that lengths which make a crossing leave by their own rounding is no gap.  In the bend of
 * a near miss states are not closed so: what counts there is that stages which are closed to
 * rounding are left where they are, and follow each other smoothly.
 */
#pragma once

#include "singularities/gap.h"

#define MECHC_HAS_FINE_GAP (MECHC_NH_MAX > 0 && (MECHC_NI_MAX == 0 || MECHC_GENERAL))

#if MECHC_HAS_FINE_GAP
#include "dynamics/extended.h"

/* Conditioning below which loops are closed so. */
#define MECHC_CLOSED_FINELY (0.03 * (MECHC_WALKED ? MECHC_TOGETHER : 1.0))

/* Whether loops are closed finely, by the squared conditioning: not if it is as small as rounding. */
MECHC_INLINE int mechc_is_fine(double conditioning)
{
    return MECHC_NI == 0 && conditioning < MECHC_CLOSED_FINELY * MECHC_CLOSED_FINELY
        && conditioning > DBL_EPSILON;
}

/* The gaps at q minus those that the lengths leave at the crossing, rounded last. */
MECHC_ONCE void mechc_find_fine_gap(double t, const double *q, const mechc_scalar_given *given,
                                    const mechc_critical *crossing, double *gap)
{
    mechc_extended_given fine;
    long double at[MECHC_NQ_MAX], still[MECHC_NU_MAX], found[MECHC_NH_MAX];
    for (int i = 0; i < MECHC_NP; i++) fine.p[i] = given->p[i];
    for (int i = 0; i < MECHC_NQ; i++) at[i] = q[i];
    for (int i = 0; i < MECHC_NU; i++) still[i] = 0.0L;
    mechc_extended_hoist(fine.p, fine.k);
    mechc_extended_output_constraints(t, at, still, &fine, found);
    for (int i = 0; i < MECHC_NH; i++)
        gap[i] = (double)(found[i] - (long double)crossing->gap * crossing->normal[i]);
}

/* Near a crossing, loops that are closed to rounding are closed to that of q.  Newton's method leaves of a
 * correction its square over the distance to where rows vanish together. */
MECHC_RARE void mechc_close_finely(double t, double *y, const mechc_scalar_given *given,
                                   const mechc_critical *crossing, double conditioning,
                                   mechc_scalar_place *place)
{
    double before[MECHC_NQ_MAX], moved = HUGE_VAL;
    for (int i = 0; i < 4 && moved * moved > DBL_EPSILON * conditioning; i++) {
        memcpy(before, y, MECHC_NQ * sizeof *y);
        mechc_find_fine_gap(t, y, given, crossing, place->gap);
        mechc_scalar_correct(t, y, given, place);
        mechc_locate(t, y, given, place);
        moved = 0.0;
        for (int k = 0; k < MECHC_NQ; k++)
            moved = mechc_max(moved, fabs(y[k] - before[k]) / mechc_given_unit(given, k));
    }
}
#else
MECHC_INLINE int mechc_is_fine(double conditioning) { return (void)conditioning, 0; }
MECHC_INLINE void mechc_close_finely(double t, double *y, const mechc_scalar_given *given,
                                     const mechc_critical *crossing, double conditioning,
                                     mechc_scalar_place *place)
{
    (void)t, (void)y, (void)given, (void)crossing, (void)conditioning, (void)place;
}
#endif
