/* The methods by their numbers: adding one is a row in abi/codes.h, its traits in traits.h, and its file,
 * which is included here. */
#pragma once

#include "abi/parts.h"
#include "methods/traits.h"
#include "run/method.h"
#if MECHC_HAS(EXPLICIT)
#include "methods/dormand_prince.h"
#else
static const mechc_method mechc_dopri5 = {MECHC_DOPRI5_TRAITS}, mechc_dop853 = {MECHC_DOP853_TRAITS};
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
#if MECHC_TAYLOR_SERIES && MECHC_HAS(SERIES)
#include "methods/taylor.h"
#else
static const mechc_method mechc_taylor = {MECHC_TAYLOR_TRAITS};
#endif

/* The table entry of a method: traits alone if its code is not in this part but the driver is. */
#define MECHC_METHOD_HERE(name, NUMBER, number, PART, degree)                                     \
    [number] = (MECHC_HAS(DRIVER) || MECHC_HAS(PART))                                             \
                   && (number != MECHC_TAYLOR || MECHC_TAYLOR_SERIES) ? &mechc_##name : 0,
static const mechc_method *const mechc_methods[MECHC_METHODS] = {
    MECHC_METHOD_TABLE(MECHC_METHOD_HERE)
};
