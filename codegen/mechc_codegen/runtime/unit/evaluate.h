/* Outputs of many states, MECHC_LANES at a time; a last block that is not full repeats its last
 * state, so that a result never depends on how many states were asked for. */
#pragma once

#include "abi/model.h"
#include "simd/bind_vector.h"
#include "dynamics/stage.h"
#include "scene_program.h"
#include "unit/jacobians.h"
#include "unit/solved.h"
#include "simd/unbind.h"
#include "simd/transpose.h"

typedef void mechc_vector_output(mechc_vector t, const mechc_vector *q, const mechc_vector *u,
                                 const mechc_vector_given *given, mechc_vector *out);

MECHC_ONCE void mechc_gather(mechc_rows rows, ptrdiff_t first, ptrdiff_t count, int width,
                             mechc_vector *out)
{
    for (int i = 0; i < width; i++) {
        double column[MECHC_LANES];
        for (int lane = 0; lane < MECHC_LANES; lane++) {
            const ptrdiff_t row = first + (first + lane < count ? lane : count - 1 - first);
            column[lane] = rows.data[row * rows.stride + i];
        }
        memcpy(&out[i], column, sizeof column);
    }
}

/* Evaluate blocks of states; inlined where `f` and `width` are constants. */
MECHC_INLINE void mechc_evaluate_blocks(mechc_vector_output *f, int width, ptrdiff_t count,
                                        mechc_rows t, mechc_rows y, mechc_rows p,
                                        const mechc_inputs *inputs, double *out)
{
    mechc_vector time[1], state[MECHC_NX], values[MECHC_AT_LEAST_ONE(MECHC_WIDEST)];
    mechc_vector_given given;
    if (count < 1) return;
    mechc_gather(t, 0, count, 1, time);
    for (int lane = 0; lane < MECHC_LANES; lane++)
        mechc_vector_give_inputs(&given, lane, inputs);
    mechc_gather(p, 0, count, MECHC_NP, given.p);
    mechc_vector_make_constants(&given);
    for (ptrdiff_t first = 0; first < count; first += MECHC_LANES) {
        const int whole = count - first >= MECHC_LANES;
        if (first > 0 && p.stride) {
            mechc_gather(p, first, count, MECHC_NP, given.p);
            mechc_vector_make_constants(&given);
        }
        if (first > 0 && t.stride) mechc_gather(t, first, count, 1, time);
        if (whole) mechc_gather_block(y.data + first * y.stride, y.stride, MECHC_NX, state);
        else mechc_gather(y, first, count, MECHC_NX, state);
        f(time[0], state, state + MECHC_NQ, &given, values);
        if (whole) {
            mechc_scatter_block(values, width, out + first * width);
        } else {
            double block[MECHC_LANES * MECHC_AT_LEAST_ONE(MECHC_WIDEST)];
            mechc_scatter_block(values, width, block);
            memcpy(out + first * width, block, (size_t)((count - first) * width) * sizeof(double));
        }
    }
}

MECHC_INLINE void mechc_vector_output_rates(mechc_vector t, const mechc_vector *q,
                                            const mechc_vector *u, const mechc_vector_given *given,
                                            mechc_vector *out)
{
    (void)u; /* follows q in the state */
    mechc_vector_rates(t, q, given, out);
}

/* Evaluate any output but the rates; compiled once for all of them. */
MECHC_ONCE void mechc_evaluate_by(mechc_vector_output *f, int width, ptrdiff_t count,
                                  mechc_rows t, mechc_rows y, mechc_rows p,
                                  const mechc_inputs *inputs, double *out)
{
    mechc_evaluate_blocks(f, width, count, t, y, p, inputs, out);
}

#define MECHC_EVALUATE(label, width, ...) \
    if (mechc_vector_output_##label == mechc_vector_output_rates) \
        mechc_evaluate_blocks(mechc_vector_output_rates, width, __VA_ARGS__); \
    else \
        mechc_evaluate_by(mechc_vector_output_##label, width, __VA_ARGS__)
#include "unit/outputs.h"
#undef MECHC_EVALUATE
