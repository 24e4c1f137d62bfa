/* Taylor series of one scene for the general unit: by its recurrences, with counts and bounds of that unit.
 * The including file has set MECHC_LANES. */
#pragma once

#define MECHC_TAYLOR_SERIES 1
#define MECHC_UNIT series
#define MECHC_PART_NAME mechc_general_series
#define MECHC_PART_VISIBLE __attribute__((visibility("hidden")))
#include "abi/parts.h"
#undef MECHC_UNIT_PARTS
#define MECHC_UNIT_PARTS MECHC_PART_TAYLOR
#include "unit/unit.h"
