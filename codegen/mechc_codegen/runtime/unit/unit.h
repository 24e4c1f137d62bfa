/* One scene compiled for one instruction set.  The including file has set MECHC_LANES and
 * MECHC_UNIT and included the scene's sizes. */

#include <stdlib.h>
#include "abi/model.h"
#include "abi/inputs.h"
#include "simd/lanes.h"
#include "methods/tableaus.h"
#include "run/trajectory.h"

#define MECHC_NX (MECHC_NQ + MECHC_NU)

#include "simd/bind_scalar.h"
#include "dynamics/equations.h"

#include "simd/bind_vector.h"
#include "dynamics/equations.h"
#include "simd/unbind.h"

#include "unit/evaluate.h"
#include "dynamics/project.h"
#include "singularities/critical.h"
#include "singularities/crossing.h"
#include "stepping/attempt.h"
#include "stepping/start.h"
#include "stepping/crossings.h"
#include "methods/radau.h"
#include "methods/gauss_tableau.h"
#include "methods/gauss_stages.h"
#include "methods/gauss.h"
#include "singularities/look_ahead.h"
#include "stepping/stiffness.h"
#include "run/dense_output.h"
#include "lockstep/advance.h"

static void mechc_unit_rates(double t, const double *y, const double *p, const double *k,
                             double *out)
{
    mechc_scalar_rates(t, y, p, k, out);
}

static void mechc_unit_prepare(const double *p, double *k) { mechc_scalar_hoist(p, k); }

static int mechc_unit_project(double t, double *y, const double *p, double *moved)
{
    double k[MECHC_AT_LEAST_ONE(MECHC_NK)];
    mechc_scalar_hoist(p, k);
    return mechc_project_state(t, y, p, k, moved);
}

extern const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT);
__attribute__((visibility("hidden"))) const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT) = {
    MECHC_QUOTE(MECHC_UNIT),
    MECHC_LANES,
    (int)(sizeof mechc_output_list / sizeof mechc_output_list[0]),
    mechc_output_list,
    mechc_unit_rates,
    mechc_unit_prepare,
    mechc_unit_project,
    sizeof(mechc_rk_run),
    mechc_rk_start,
    mechc_unit_advance,
    mechc_unit_advance_abreast,
    mechc_rk_release,
    mechc_rk_interpolate,
#if MECHC_NI > 0
    mechc_rk_extend,
#else
    0,
#endif
};
