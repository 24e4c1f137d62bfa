/* The methods by their numbers: adding one is a row in abi/codes.h, its traits in traits.h, and its file,
 * which is included here; an explicit pair is a tableau in place of a file. */
#pragma once

#include "methods/traits.h"
#if MECHC_HAS(EXPLICIT)
#include "methods/dormand_prince.h"
#define mechc_none_together 0
#define MECHC_DEFINE_PAIR(name, NUMBER, lockstep) \
    static const mechc_method mechc_##name = { \
        MECHC_##NUMBER##_TRAITS, MECHC_PAIR_CODE, .together = mechc_##lockstep##_together};
#else
#define MECHC_DEFINE_PAIR(name, NUMBER, lockstep) \
    static const mechc_method mechc_##name = {MECHC_##NUMBER##_TRAITS};
#endif
#if MECHC_HAS(COLLOCATION)
#include "methods/gauss/gauss.h"
#else
static const mechc_method mechc_gauss8 = {MECHC_GAUSS8_TRAITS};
#endif
#if MECHC_HAS(SWEEPS)
#include "methods/gauss/lanes.h"
#else
static const mechc_method mechc_gauss8_lockstep = {MECHC_GAUSS8_LOCKSTEP_TRAITS};
#endif
#if MECHC_HAS(IMPLICIT)
#include "methods/radau.h"
#else
static const mechc_method mechc_radau5 = {MECHC_RADAU5_TRAITS};
#endif
#if MECHC_TAYLOR_SERIES && (MECHC_HAS(TAYLOR) || MECHC_HAS(TAYLOR_LANES))
#include "methods/taylor.h"
#else
static const mechc_method mechc_taylor = {MECHC_TAYLOR_TRAITS};
#endif

#define MECHC_DEFINE_GAUSS(...) /* in its file */
#define MECHC_DEFINE_RADAU(...)
#define MECHC_DEFINE_METHOD(name, NUMBER, number, PART, degree, RULE, kept, lockstep) \
    MECHC_DEFINE_##RULE(name, NUMBER, lockstep)
MECHC_METHOD_TABLE(MECHC_DEFINE_METHOD)

/* The table entry of a method: traits alone if its code is not in this part but the driver is. */
#define MECHC_METHOD_HERE(name, NUMBER, number, PART, ...)                                        \
    [number] = (MECHC_HAS(DRIVER) || MECHC_HAS(PART)                                              \
                || (number == MECHC_TAYLOR && MECHC_HAS(TAYLOR_LANES)))                           \
                   && (number != MECHC_TAYLOR || MECHC_TAYLOR_SERIES) ? &mechc_##name : 0,
static const mechc_method *const mechc_methods[MECHC_METHODS] = {
    MECHC_METHOD_TABLE(MECHC_METHOD_HERE)
};
