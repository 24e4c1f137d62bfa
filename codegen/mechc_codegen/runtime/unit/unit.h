/* One scene compiled for one instruction set, or parts of it (abi/parts.h).  The including file has set
 * MECHC_LANES and MECHC_UNIT. */
#pragma once

#include "abi/model.h"
#include "methods/methods.h"
#if MECHC_HAS(DRIVER)
#include "singularities/generic_rank.h"
#include "dynamics/project.h"
#include "run/dense_output.h"
#include "run/integration.h"
#include "run/method.h"
#include "run/saved.h"
#include "run/trajectory.h"
#include "stepping/advance.h"
#include "stepping/start.h"
#endif
#if MECHC_HAS(OUTPUTS)
#include "unit/evaluate.h"
#include "simd/bind_scalar.h"
#include "dynamics/alone.h"
#include "simd/unbind.h"
#endif
#if MECHC_HAS(DERIVATIVES) && MECHC_VARIATIONAL
#include "adjoint/covary.h"
#endif

#if MECHC_HAS(OUTPUTS)
static void mechc_unit_rates(double t, const double *y, const mechc_given *given, double *out)
{
    mechc_scalar_rates(t, y, (const mechc_scalar_given *)given, out);
}

#if MECHC_MASS_MATRIX
static void mechc_unit_mass(double t, const double *y, const mechc_given *given, double *out)
{
    mechc_scalar_output_mass_matrix(t, y, y + MECHC_NQ, (const mechc_scalar_given *)given, out);
}
#endif

static void mechc_unit_give(const double *p, const mechc_inputs *inputs, mechc_given *given)
{
    mechc_give_alone(p, inputs, (mechc_scalar_given *)given);
}
#endif

#if MECHC_HAS(DRIVER)
static int mechc_unit_project(double t, double *y, const double *p, const mechc_inputs *inputs,
                              double *moved)
{
    mechc_scalar_given given;
    mechc_give_at(t, y, p, inputs, 0, &given);
    return mechc_project_state(t, y, &given, moved);
}

MECHC_RARE void mechc_unit_start(mechc_run *run, const mechc_options *options)
{
    const mechc_method *const *methods = options->methods ? options->methods : mechc_methods;
    mechc_integration_start(run, options, methods, &mechc_driver_of_run);
}

static void mechc_unit_release(mechc_run *run)
{
    mechc_free(&run->trajectory);
    mechc_free_work((mechc_integration *)run);
}

#endif

extern const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT);
__attribute__((visibility("hidden"))) const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT) = {
    .instruction_set = MECHC_QUOTE(MECHC_UNIT),
    .lanes = MECHC_LANES,
    .methods = mechc_methods,
#if MECHC_HAS(OUTPUTS)
    .output_count = (int)(sizeof mechc_output_list / sizeof mechc_output_list[0]),
    .outputs = mechc_output_list,
    .identity_kinematics = MECHC_IDENTITY_KINEMATICS,
    .given_size = sizeof(mechc_scalar_given),
    .give = mechc_unit_give,
    .rates = mechc_unit_rates,
#if MECHC_MASS_MATRIX
    .mass = mechc_unit_mass,
#endif
#endif
#if MECHC_HAS(DRIVER)
    .project = mechc_unit_project,
    .run_size = sizeof(mechc_integration),
    .start = mechc_unit_start,
    .release = mechc_unit_release,
    .interpolate = mechc_interpolate,
    .extend = mechc_integration_extend,
    .saved_size = mechc_saved_size,
    .save = mechc_save,
    .restore = mechc_restore,
    .advance = mechc_advance_run,
    .advance_lockstep = mechc_advance_runs,
#endif
#if MECHC_HAS(DERIVATIVES) && MECHC_VARIATIONAL
    .vary = mechc_vary,
    .covary = mechc_covary,
    .project_columns = mechc_project_columns,
#endif
};

#ifdef MECHC_PART_NAME
#define MECHC_PART_VISIBLE __attribute__((visibility("hidden")))
#else /* found by name in a shared object of its own */
#define MECHC_PART_NAME mechc_part_of_unit
#define MECHC_PART_VISIBLE MECHC_SHOWN
#endif
#if MECHC_UNIT_PARTS != MECHC_ALL_PARTS
extern MECHC_PART_VISIBLE const mechc_part MECHC_PART_NAME;
MECHC_PART_VISIBLE const mechc_part MECHC_PART_NAME = {
    MECHC_ABI, MECHC_UNIT_PARTS, &MECHC_JOIN(mechc_unit_, MECHC_UNIT),
};
#endif
