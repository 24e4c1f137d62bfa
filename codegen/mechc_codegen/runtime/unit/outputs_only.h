/* A scene's outputs only: state rates and outputs of one state after the other, no integrators.
 *
 * It is compiled in a fraction of the time of unit.h and serves until that is there.  The including
 * file has set MECHC_UNIT, MECHC_LANES to 1, and MECHC_UNIT_LANES to those of the unit. */
#pragma once

#include "unit/one_by_one.h"

#ifndef MECHC_UNIT_LANES
#define MECHC_UNIT_LANES MECHC_LANES
#endif

#define MECHC_EVALUATE(label, width, ...) \
    mechc_plain_evaluate(mechc_scalar_output_##label, width, __VA_ARGS__)
#include "unit/outputs.h"
#undef MECHC_EVALUATE

#if MECHC_MASS_MATRIX
static void mechc_plain_mass(double t, const double *y, const mechc_given *given, double *out)
{
    mechc_scalar_output_mass_matrix(t, y, y + MECHC_NQ, (const mechc_scalar_given *)given, out);
}
#endif

extern const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT);
__attribute__((visibility("hidden"))) const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT) = {
    .instruction_set = MECHC_QUOTE(MECHC_UNIT),
    .lanes = MECHC_UNIT_LANES, /* of the parts that follow */
    .output_count = (int)(sizeof mechc_output_list / sizeof mechc_output_list[0]),
    .outputs = mechc_output_list,
    .identity_kinematics = MECHC_IDENTITY_KINEMATICS,
    .given_size = sizeof(mechc_scalar_given),
    .give = mechc_plain_give,
    .rates = mechc_plain_rates,
#if MECHC_MASS_MATRIX
    .mass = mechc_plain_mass,
#endif
};
