/* A scene's outputs only: state rates and outputs of one state after the other, no integrators.
 *
 * It is compiled in a fraction of the time of unit.h and serves until that is there.  The including
 * file has set MECHC_UNIT, MECHC_OUTPUTS_ONLY, and MECHC_LANES to 1. */
#ifndef MECHC_OUTPUTS_ONLY_H
#define MECHC_OUTPUTS_ONLY_H

#include <stddef.h>
#include "abi/model.h"
#include "dynamics/sizes.h"
#include "simd/bind_scalar.h"
#include "dynamics/stage.h"
#include "scene_program.h"
#include "unit/jacobians.h"
#include "unit/solved.h"
#include "simd/unbind.h"
#include "simd/lanes.h"

typedef void mechc_scalar_output(double t, const double *q, const double *u, const double *p,
                                 const double *k, double *out);

static void mechc_plain_rates(double t, const double *y, const double *p, const double *k,
                              double *out)
{
    mechc_scalar_place place;
    mechc_scalar_coordinate_rates_of(t, y, y + MECHC_NQ, p, k, out);
    mechc_scalar_solve(t, y, y + MECHC_NQ, p, k, &place, out + MECHC_NQ, 0);
}

static void mechc_scalar_output_rates(double t, const double *q, const double *u, const double *p,
                                      const double *k, double *out)
{
    (void)u; /* follows q in the state */
    mechc_plain_rates(t, q, p, k, out);
}

MECHC_ONCE void mechc_plain_evaluate(mechc_scalar_output *f, int width, ptrdiff_t count,
                                     mechc_rows t, mechc_rows y, mechc_rows p, double *out)
{
    double k[MECHC_AT_LEAST_ONE(MECHC_NK)];
    for (ptrdiff_t i = 0; i < count; i++) {
        const double *state = y.data + i * y.stride, *parameters = p.data + i * p.stride;
        if (i == 0 || p.stride) mechc_scalar_hoist(parameters, k);
        f(t.data[i * t.stride], state, state + MECHC_NQ, parameters, k, out + i * width);
    }
}

#define MECHC_EVALUATE(label, width, ...) \
    mechc_plain_evaluate(mechc_scalar_output_##label, width, __VA_ARGS__)
#include "unit/outputs.h"

static void mechc_plain_prepare(const double *p, double *k) { mechc_scalar_hoist(p, k); }

extern const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT);
__attribute__((visibility("hidden"))) const mechc_unit MECHC_JOIN(mechc_unit_, MECHC_UNIT) = {
    .instruction_set = MECHC_QUOTE(MECHC_UNIT),
    .lanes = MECHC_LANES,
    .output_count = (int)(sizeof mechc_output_list / sizeof mechc_output_list[0]),
    .outputs = mechc_output_list,
    .rates = mechc_plain_rates,
    .prepare = mechc_plain_prepare,
};

#endif
