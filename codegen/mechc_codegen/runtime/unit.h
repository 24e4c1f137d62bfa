/* One scene compiled for one instruction set.  The including file has set MECHC_LANES and
 * MECHC_UNIT and included the scene's sizes. */

#include <stdlib.h>
#include "model.h"
#include "inputs.h"
#include "lanes.h"
#include "tableaus.h"
#include "trajectory.h"

#define MECHC_NX (MECHC_NQ + MECHC_NU)

#include "use_scalar.h"
#include "equations.h"

#include "use_lanes.h"
#include "equations.h"
#include "unuse.h"

#include "evaluate.h"
#include "project.h"
#include "generic_rank.h"
#include "critical.h"
#include "passage.h"
#include "explicit_rk.h"
#include "rk_start.h"
#include "rk_passage.h"
#include "radau.h"
#include "gauss_table.h"
#include "gauss_stages.h"
#include "gauss.h"
#include "approach.h"
#include "stiffness.h"
#include "rk_dense.h"
#include "abreast.h"

static void mechc_unit_rates(double t, const double *y, const double *p, const double *k,
                             double *out)
{
    mechc_scalar_rates(t, y, p, k, out);
}

static void mechc_unit_prepare(const double *p, double *k) { mechc_scalar_constants(p, k); }

static int mechc_unit_project(double t, double *y, const double *p, double *moved)
{
    double k[MECHC_CONSTANTS];
    mechc_constants_at(t, y, p, k);
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
