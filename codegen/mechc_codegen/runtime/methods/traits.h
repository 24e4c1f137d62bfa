/* The properties of a method that the driver knows, whether or not its code is loaded. */
#pragma once

#include <math.h>
#include "abi/codes.h"
#include "methods/dormand_prince_tableaus.h"
#include "methods/gauss/tableau.h"
#include "methods/radau_tableau.h"
#include "series/order.h"
#include "stepping/control.h"

#define MECHC_GAUSS_HORIZON 1.3 /* steps ahead that crossings are looked for: no longer ones follow */
#define MECHC_GAUSS_GROWTH 2.0 /* the polynomial cannot be extrapolated farther */

#define MECHC_DOPRI5_TRAITS \
    .number = MECHC_DOPRI5, \
    .order = 5, \
    .last_rate = 6, \
    .dense_rows = 4, \
    .nodes = {6, mechc_dopri5_nodes}, \
    .tableau = &mechc_dopri5_tableau, \
    .share = MECHC_SHARE_OF_MANY, \
    .growth = 10.0, \
    .horizon = 8.0, \
    .farthest = HUGE_VAL, \
    .ignored = 1.0, \
    .after_failure = 0.3

/* Its steps are the longest of an explicit method and keep the farthest from a crossing. */
#define MECHC_DOP853_TRAITS \
    .number = MECHC_DOP853, \
    .order = 8, \
    .last_rate = 12, \
    .dense_rows = 7, \
    .nodes = {12, mechc_dop853_nodes}, \
    .tableau = &mechc_dop853_tableau, \
    .share = MECHC_SHARE, \
    .growth = 6.0, \
    .holds_crossing = 1, \
    .horizon = 2.0, \
    .in_lockstep = MECHC_WITHOUT_FEATURES, \
    .farthest = HUGE_VAL, \
    .ignored = 1.0, \
    .after_failure = 0.3

#define MECHC_RADAU5_TRAITS \
    .number = MECHC_RADAU5, \
    .order = 4, \
    .last_rate = MECHC_RADAU_STAGES, \
    .dense_rows = 3, \
    .nodes = {MECHC_RADAU_STAGES, mechc_radau5_nodes}, \
    .tableau = &mechc_radau5_tableau, \
    .share = MECHC_SHARE, \
    .growth = 10.0, \
    .farthest = HUGE_VAL, \
    .ignored = 1.2, /* the factors of the iteration's matrix are kept */ \
    .after_failure = 0.3, \
    .horizon = 8.0

#define MECHC_GAUSS8_TRAITS .number = MECHC_GAUSS8, MECHC_COLLOCATION_TRAITS
/* Steps that are to end at corners of a law are taken alone. */
#define MECHC_GAUSS8_LOCKSTEP_TRAITS \
    .number = MECHC_GAUSS8_LOCKSTEP, \
    .in_lockstep = MECHC_WITHOUT_SWITCHES, \
    .alone = MECHC_GAUSS8, \
    MECHC_COLLOCATION_TRAITS

#define MECHC_COLLOCATION_TRAITS /* however its equations are solved */ \
    .order = 8, \
    .last_rate = MECHC_STAGES + 1, \
    .dense_rows = MECHC_GAUSS_DENSE, \
    .nodes = {MECHC_STAGES + 1, mechc_gauss8_nodes}, \
    .share = MECHC_SHARE, \
    .growth = MECHC_GAUSS_GROWTH, \
    .farthest = MECHC_GAUSS_GROWTH, \
    .ignored = 1.0, \
    .after_failure = 0.7, \
    .root_error = 1, \
    .holds_crossing = 1, \
    .horizon = MECHC_GAUSS_HORIZON

#define MECHC_TAYLOR_GROWTH 8.0 /* where the last terms vanish */
#define MECHC_TAYLOR_OVERFLOWS 1e-3 /* of a step whose terms overflow, the next one */
#define MECHC_TAYLOR_LONG 256 /* steps: over more of them the phase drifts by more than is tolerated */
#define MECHC_TAYLOR_LOOK 4 /* a look at stability costs up to a third of a step: one of so many, until it limits one */

MECHC_STATIC int mechc_taylor_rows(const mechc_integration *run)
{
    return mechc_taylor_order(MECHC_SHARE * run->rtol);
}

#define MECHC_TAYLOR_TRAITS \
    .number = MECHC_TAYLOR, \
    .order = 16, /* about: of the first step */ \
    .last_rate = 1, \
    .dense_rows = MECHC_TAYLOR_MOST, \
    .rows_of = mechc_taylor_rows, \
    .nodes = {6, mechc_dopri5_nodes}, \
    .share = MECHC_SHARE, \
    .growth = MECHC_TAYLOR_GROWTH, \
    .in_lockstep = MECHC_WITHOUT_SWITCHES, \
    .by_itself = 1, \
    .farthest = HUGE_VAL, \
    .ignored = 1.0, \
    .after_failure = 0.1, \
    .horizon = 2.0
