/* The unit of coordinates that are neither angles nor pure numbers, from the rows.
 *
 * It is the move of such a coordinate that changes a row as much as a radian of an angle does, or how
 * far they are from zero; where neither tells, what a radian changes a row by.
 */
#pragma once

#include "dynamics/scalar_stage.h"

#if MECHC_NH > 0 && defined MECHC_SLIDES
MECHC_ONCE void mechc_find_length(double t, const double *q, mechc_scalar_given *given)
{
    double length = 0.0, largest = 0.0;
    mechc_scalar_place place;
    mechc_scalar_locate_all(t, q, given, &place);
    for (int i = 0; i < MECHC_NH; i++) {
        double most[2] = {0.0, 0.0};
        for (int j = 0; j < MECHC_NU; j++) {
            double *kind = &most[mechc_slides[MECHC_NQ + j]];
            *kind = mechc_max(*kind, fabs(place.jacobian[i * MECHC_NU + j]));
        }
        if (most[1] > 0.0) length = mechc_max(length, most[0] / most[1]);
        largest = mechc_max(largest, most[0]);
    }
    for (int i = 0; i < MECHC_NQ - MECHC_STATES; i++)
        if (mechc_slides[i]) length = mechc_max(length, fabs(q[i]));
    if (!(length > 0.0)) length = largest;
    if (length > 0.0 && length < HUGE_VAL) given->k[MECHC_LENGTH] = length;
}
#elif MECHC_NC > 0
MECHC_INLINE void mechc_find_length(double t, const double *q, mechc_scalar_given *given)
{
    (void)t, (void)q, (void)given;
}
#endif
