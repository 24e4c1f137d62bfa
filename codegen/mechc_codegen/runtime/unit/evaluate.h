/* Outputs of many states, MECHC_LANES at a time; a last block that is not full repeats its last
 * state, so that a result never depends on how many states were asked for. */
#pragma once

#include "abi/model.h"
#include "singularities/generic_rank.h"
#include "simd/bind_vector.h"
#include "dynamics/alone.h"
#include "scene_program.h"
#include "unit/jacobians.h"
#include "simd/unbind.h"
#include "simd/transpose.h"

typedef void mechc_vector_output(mechc_vector t, const mechc_vector *q, const mechc_vector *u,
                                 const mechc_vector_given *given, mechc_vector *out);

MECHC_ONCE void mechc_gather(mechc_rows rows, ptrdiff_t first, ptrdiff_t count, int width,
                             mechc_vector *out)
{
    const int some = count - first < MECHC_LANES ? (int)(count - first) : MECHC_LANES;
    mechc_fill_from(rows.data + first * rows.stride, rows.stride, some, width, out);
}

/* Evaluate blocks of states; inlined where `f` and `width` are constants. */
MECHC_INLINE void mechc_evaluate_blocks(mechc_vector_output *f, int width, ptrdiff_t count,
                                        mechc_rows t, mechc_rows y, mechc_rows p,
                                        const mechc_inputs *inputs, mechc_rows forces,
                                        double *out)
{
    mechc_vector time[1], state[MECHC_NX_MAX], added[MECHC_NU_MAX];
    mechc_vector values[MECHC_AT_LEAST_ONE(MECHC_WIDEST_MAX)];
    mechc_vector_given given;
    if (count < 1) return;
    mechc_gather(t, 0, count, 1, time);
    for (int lane = 0; lane < MECHC_LANES; lane++) given.inputs[lane] = inputs;
    mechc_gather(p, 0, count, MECHC_NP, given.p);
    mechc_vector_make_constants(&given);
    given.count = mechc_rows_of_state;
    for (ptrdiff_t first = 0; first < count; first += MECHC_LANES) {
        const int whole = count - first >= MECHC_LANES;
        if (first > 0 && p.stride) {
            mechc_gather(p, first, count, MECHC_NP, given.p);
            mechc_vector_make_constants(&given);
            given.count = mechc_rows_of_state;
        }
        if (first > 0 && t.stride) mechc_gather(t, first, count, 1, time);
        if (whole) mechc_gather_block(y.data + first * y.stride, y.stride, MECHC_NX, state);
        else mechc_gather(y, first, count, MECHC_NX, state);
        if (forces.data) {
            mechc_gather(forces, first, count, MECHC_NU, added);
            given.forces = added;
        }
        f(time[0], state, state + MECHC_NQ, &given, values);
        mechc_empty_lanes(values, whole ? MECHC_LANES : (int)(count - first), width, out + first * width);
    }
}

MECHC_INLINE void mechc_vector_output_rates(mechc_vector t, const mechc_vector *q,
                                            const mechc_vector *u, const mechc_vector_given *given,
                                            mechc_vector *out)
{
    (void)u; /* follows q in the state */
    mechc_vector_rates(t, q, given, out);
}

/* The rates with further forces. */
MECHC_RARE_ONCE void mechc_vector_output_forced_rates(mechc_vector t, const mechc_vector *q,
                                                      const mechc_vector *u,
                                                      const mechc_vector_given *given,
                                                      mechc_vector *out)
{
    mechc_vector_place place;
    mechc_vector_coordinate_rates_of(t, q, u, given, out);
    mechc_vector_solve(t, q, u, given, &place, out + MECHC_NQ, 0);
}

/* Evaluate any output but the rates; compiled once for all of them. */
MECHC_ONCE void mechc_evaluate_by(mechc_vector_output *f, int width, ptrdiff_t count,
                                  mechc_rows t, mechc_rows y, mechc_rows p,
                                  const mechc_inputs *inputs, mechc_rows forces, double *out)
{
    mechc_evaluate_blocks(f, width, count, t, y, p, inputs, forces, out);
}

#define MECHC_EVALUATE(label, width, count, t, y, p, inputs, forces, out)                         \
    if (mechc_vector_output_##label != mechc_vector_output_rates)                                 \
        mechc_evaluate_by(mechc_vector_output_##label, width, count, t, y, p, inputs, forces, out); \
    else if (forces.data)                                                                         \
        mechc_evaluate_by(mechc_vector_output_forced_rates, width, count, t, y, p, inputs, forces, \
                          out);                                                                   \
    else                                                                                          \
        mechc_evaluate_blocks(mechc_vector_output_rates, width, count, t, y, p, inputs,           \
                              MECHC_NO_FORCES, out)
#include "unit/outputs.h"
#undef MECHC_EVALUATE
