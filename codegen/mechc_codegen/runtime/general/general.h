/* The unit that is compiled once for all scenes of a kind: the driver and the methods of single runs.  The
 * including file has set MECHC_LANES.
 *
 * It is linked to a scene's counts and functions (of_scene.h), and serves until the scene's own unit is
 * compiled: each gives the same bits. */
#pragma once

#define MECHC_UNIT general
#define MECHC_PART_NAME mechc_general_part
#define MECHC_PART_VISIBLE __attribute__((visibility("hidden")))
#include "abi/parts.h"
#undef MECHC_UNIT_PARTS
#define MECHC_UNIT_PARTS \
    (MECHC_PART_DRIVER | MECHC_PART_COLLOCATION | MECHC_PART_EXPLICIT | MECHC_PART_IMPLICIT)
#include "unit/unit.h"
