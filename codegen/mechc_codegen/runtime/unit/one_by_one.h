/* What a unit offers of one state after the other: rates, outputs, parameters and constants as they are given. */
#pragma once

#include "abi/model.h"
#include "unit/scalar_outputs.h"

typedef void mechc_scalar_output(double t, const double *q, const double *u,
                                 const mechc_scalar_given *given, double *out);

static void mechc_plain_rates(double t, const double *y, const mechc_given *given, double *out)
{
    mechc_scalar_output_rates(t, y, y + MECHC_NQ, (const mechc_scalar_given *)given, out);
}

MECHC_ONCE void mechc_plain_evaluate(mechc_scalar_output *f, int width, ptrdiff_t count,
                                     mechc_rows t, mechc_rows y, mechc_rows p,
                                     const mechc_inputs *inputs, mechc_rows forces, double *out)
{
    mechc_scalar_given given;
    for (ptrdiff_t i = 0; i < count; i++) {
        const double *state = y.data + i * y.stride;
        if (i == 0 || p.stride) mechc_give_alone(p.data + i * p.stride, inputs, &given);
        given.forces = forces.data ? forces.data + i * forces.stride : 0;
        f(t.data[i * t.stride], state, state + MECHC_NQ, &given, out + i * width);
    }
}

static void mechc_plain_give(const double *p, const mechc_inputs *inputs, mechc_given *given)
{
    mechc_give_alone(p, inputs, (mechc_scalar_given *)given);
}
