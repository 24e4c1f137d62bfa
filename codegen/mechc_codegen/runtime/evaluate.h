/* Outputs of many states, MECHC_LANES at a time; a last block that is not full repeats its last
 * state, so that a result never depends on how many states were asked for. */

#include "transpose.h"

typedef void mechc_lane_output(mechc_lane t, const mechc_lane *q, const mechc_lane *u,
                               const mechc_lane *p, const mechc_lane *k, mechc_lane *out);

MECHC_ONCE void mechc_gather(mechc_rows rows, ptrdiff_t first, ptrdiff_t count, int width,
                               mechc_lane *out)
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

/* Inlined into one function an output, so that `f` and `width` are constants there. */
MECHC_INLINE void mechc_evaluate_blocks(mechc_lane_output *f, int width, ptrdiff_t count,
                                        mechc_rows t, mechc_rows y, mechc_rows p, double *out)
{
    mechc_lane time[1], state[MECHC_NX], parameters[MECHC_AT_LEAST_ONE(MECHC_PASSED)];
    mechc_lane k[MECHC_CONSTANTS], values[MECHC_AT_LEAST_ONE(MECHC_WIDEST)];
    if (count < 1) return;
    mechc_gather(t, 0, count, 1, time);
    mechc_gather(p, 0, count, MECHC_PASSED, parameters);
    mechc_lanes_constants(parameters, k);
    for (ptrdiff_t first = 0; first < count; first += MECHC_LANES) {
        const int whole = count - first >= MECHC_LANES;
        if (first > 0 && p.stride) {
            mechc_gather(p, first, count, MECHC_PASSED, parameters);
            mechc_lanes_constants(parameters, k);
        }
        if (first > 0 && t.stride) mechc_gather(t, first, count, 1, time);
        if (whole) mechc_gather_block(y.data + first * y.stride, y.stride, MECHC_NX, state);
        else mechc_gather(y, first, count, MECHC_NX, state);
        f(time[0], state, state + MECHC_NQ, parameters, k, values);
        if (whole) {
            mechc_scatter_block(values, width, out + first * width);
        } else {
            double block[MECHC_LANES * MECHC_AT_LEAST_ONE(MECHC_WIDEST)];
            mechc_scatter_block(values, width, block);
            memcpy(out + first * width, block, (size_t)((count - first) * width) * sizeof(double));
        }
    }
}

MECHC_INLINE void mechc_lanes_output_rates(mechc_lane t, const mechc_lane *q, const mechc_lane *u,
                                           const mechc_lane *p, const mechc_lane *k,
                                           mechc_lane *out)
{
    (void)u; /* follows q in the state */
    mechc_lanes_rates(t, q, p, k, out);
}

#define MECHC_EVALUATE(label, width, ...) \
    mechc_evaluate_blocks(mechc_lanes_output_##label, width, __VA_ARGS__)
#include "outputs.h"
