/* The methods by their numbers: adding one is a number in abi/codes.h, its file, its traits, a line here.
 */
#pragma once

#include "abi/parts.h"
#include "methods/traits.h"
#include "run/method.h"
#if MECHC_HAS(EXPLICIT)
#include "methods/dormand_prince.h"
#elif MECHC_HAS(DRIVER)
static const mechc_method mechc_dopri5 = {MECHC_DOPRI5_TRAITS}, mechc_dop853 = {MECHC_DOP853_TRAITS};
#endif
#if MECHC_HAS(COLLOCATION)
#include "methods/gauss/gauss.h"
#elif MECHC_HAS(DRIVER)
static const mechc_method mechc_gauss8 = {MECHC_GAUSS8_TRAITS};
#endif
#if MECHC_HAS(SWEEPS)
#include "methods/gauss/lanes.h"
#elif MECHC_HAS(DRIVER)
static const mechc_method mechc_gauss8_lockstep = {MECHC_GAUSS8_LOCKSTEP_TRAITS};
#endif
#if MECHC_HAS(IMPLICIT)
#include "methods/radau.h"
#elif MECHC_HAS(DRIVER)
static const mechc_method mechc_radau5 = {MECHC_RADAU5_TRAITS};
#endif
#if MECHC_TAYLOR_SERIES && MECHC_HAS(SERIES)
#include "methods/taylor.h"
#elif MECHC_TAYLOR_SERIES && MECHC_HAS(DRIVER)
static const mechc_method mechc_taylor = {MECHC_TAYLOR_TRAITS};
#endif

/* Of methods without code in this part their traits, where the driver is in it. */
static const mechc_method *const mechc_methods[MECHC_METHODS] = {
#if MECHC_HAS(DRIVER) || MECHC_HAS(EXPLICIT)
    [MECHC_DOPRI5] = &mechc_dopri5,
    [MECHC_DOP853] = &mechc_dop853,
#endif
#if MECHC_HAS(DRIVER) || MECHC_HAS(IMPLICIT)
    [MECHC_RADAU5] = &mechc_radau5,
#endif
#if MECHC_HAS(DRIVER) || MECHC_HAS(COLLOCATION)
    [MECHC_GAUSS8] = &mechc_gauss8,
#endif
#if MECHC_HAS(DRIVER) || MECHC_HAS(SWEEPS)
    [MECHC_GAUSS8_LOCKSTEP] = &mechc_gauss8_lockstep,
#endif
#if MECHC_TAYLOR_SERIES && (MECHC_HAS(DRIVER) || MECHC_HAS(SERIES))
    [MECHC_TAYLOR] = &mechc_taylor,
#endif
};
