/* The size of the constraint rows at ordinary configurations.
 *
 * Conditioning compares rows with the longest of them.  Where links come in line all rows may vanish
 * together, the only row of a rod between two cranks for instance, and then the longest says
 * nothing.  A turn of an angle by a radian changes a row by as much as it has elsewhere; a tenth of
 * this is what rows are compared with where they are shorter, and what rounding of the loops' gaps
 * comes from.  Other coordinates have no scale of their own, and add nothing.
 */
#pragma once

#include "dynamics/scalar_stage.h"

#if MECHC_NH_MAX > 0 && !MECHC_WALKED && defined MECHC_ANGLES
/* rad: so little that rows change in proportion to it, and far from rounding */
#define MECHC_TURNED_BY 1e-3

/* Update by this change the longest row, squared, and the largest sum of the entries of one. */
MECHC_STATIC void mechc_meet_change(const mechc_scalar_place *here, const mechc_scalar_place *there,
                                    const double *weight, double *length, double *sum)
{
    for (int i = 0; i < MECHC_NH; i++) {
        double square = 0.0, entries = 0.0;
        for (int j = 0; j < MECHC_NU; j++) {
            const int k = i * MECHC_NU + j;
            const double change = there->jacobian[k] - here->jacobian[k];
            square += change * change * weight[j];
            entries += fabs(change);
        }
        if (square > *length && square < HUGE_VAL) *length = square;
        if (entries > *sum && entries < HUGE_VAL) *sum = entries;
    }
}

MECHC_ONCE void mechc_find_ordinary_rows(double t, const double *q, mechc_scalar_given *given)
{
#if MECHC_GENERAL
    const int *const angles = mechc_of_scene.angles, count = mechc_of_scene.angle_count;
#else
    static const int angles[] = {MECHC_ANGLES};
    const int count = sizeof angles / sizeof *angles;
#endif
    double moved[MECHC_NQ_MAX], masses[MECHC_NU_MAX], weight[MECHC_NU_MAX], length = 0.0, sum = 0.0;
    mechc_scalar_place here, there;
    mechc_scalar_locate_all(t, q, given, &here);
    mechc_scalar_moved_masses(here.mass, here.length, masses);
    for (int j = 0; j < MECHC_NU; j++) weight[j] = 1.0 / masses[j];
    memcpy(moved, q, MECHC_NQ * sizeof *q);
    for (int i = 0; i < count && !mechc_scalar_stopped(given); i++) {
        moved[angles[i]] += MECHC_TURNED_BY;
        mechc_scalar_locate_all(t, moved, given, &there);
        mechc_meet_change(&here, &there, weight, &length, &sum);
        moved[angles[i]] = q[angles[i]];
    }
    const double share = MECHC_OF_A_RADIAN / MECHC_TURNED_BY;
    given->k[MECHC_ORDINARY_LENGTH] = share * share * length;
    given->k[MECHC_ORDINARY_SUM] = share * sum;
}
#endif

#if MECHC_NH_MAX > 0 && defined MECHC_SLIDES
/* The unit of coordinates that are neither angles nor pure numbers, from the rows.
 *
 * It is the move of such a coordinate that changes some row as much as a radian of an angle does, or how
 * far they are from zero: in a single row the coordinate may act by its rounding alone.  Where no row
 * tells, it is the longest arm of a tree's links, or how far a mass is from its axis that turns with as much
 * inertia, and where nothing does, what a radian changes a row by.
 */
#define MECHC_UNMOVED 1e-8 /* of what angles do to rows: rows that no such coordinate moves */

MECHC_ONCE void mechc_find_length(double t, const double *q, mechc_scalar_given *given)
{
    double length = 0.0, most[2] = {0.0, 0.0}, arm = 0.0;
    mechc_scalar_place place;
    (void)arm;
    if (!MECHC_HAS_SLIDES) return;
    mechc_scalar_locate_all(t, q, given, &place);
    for (int i = 0; i < MECHC_NH; i++)
        for (int j = 0; j < MECHC_NU; j++) {
            double *kind = &most[mechc_slides[MECHC_NQ + j]];
            *kind = mechc_max(*kind, fabs(place.jacobian[i * MECHC_NU + j]));
        }
    if (most[1] > MECHC_UNMOVED * most[0]) length = most[0] / most[1];
#if MECHC_WALKED
    for (int link = 0; !(length > 0.0) && link < MECHC_LINKS; link++)
        arm = mechc_max(arm, mechc_scalar_sum_of_sizes(place.saved + link * MECHC_ARM, MECHC_ARM));
    length = mechc_max(length, arm);
#else
    double moved[2] = {0.0, 0.0}; /* the most mass, by turns and by slides */
    for (int j = 0; j < MECHC_NU; j++) {
        double *kind = &moved[mechc_slides[MECHC_NQ + j]];
        *kind = mechc_max(*kind, place.mass[j * MECHC_NU + j]);
    }
    if (!(length > 0.0) && moved[1] > 0.0) length = sqrt(moved[0] / moved[1]);
#endif
    for (int i = 0; i < MECHC_NQ - MECHC_STATES; i++)
        if (mechc_slides[i]) length = mechc_max(length, fabs(q[i]));
    if (!(length > 0.0)) length = most[0];
    if (length > 0.0 && length < HUGE_VAL) given->k[MECHC_LENGTH] = length;
}
#endif
