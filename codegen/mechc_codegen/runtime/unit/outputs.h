/* Every output of the scene as a function of many states, and the list of them.
 *
 * The including file has defined MECHC_EVALUATE(label, width, count, t, y, p, inputs, forces, out).
 */
#pragma once

#include "abi/model.h"
#include "dynamics/sizes.h"

#ifdef MECHC_EVALUATE
#define MECHC_DEFINE_OUTPUT(label, name, width)                                                  \
    static void mechc_evaluate_##label(ptrdiff_t count, mechc_rows t, mechc_rows y,              \
                                       mechc_rows p, const mechc_inputs *inputs,                 \
                                         mechc_rows forces, double *out)                          \
    {                                                                                            \
        MECHC_EVALUATE(label, width, count, t, y, p, inputs, forces, out);                       \
    }
MECHC_OUTPUTS(MECHC_DEFINE_OUTPUT)
MECHC_SOLVED_OUTPUTS(MECHC_DEFINE_OUTPUT)

#define MECHC_LIST_OUTPUT(label, name, width) {name, width, mechc_evaluate_##label},
static const mechc_output mechc_output_list[] = {
    MECHC_OUTPUTS(MECHC_LIST_OUTPUT) MECHC_SOLVED_OUTPUTS(MECHC_LIST_OUTPUT)};
#endif
