/* Sizes of the scene, and what follows from them. */
#pragma once

#include "scene_sizes.h"

#ifndef MECHC_NI
#define MECHC_NI 0 /* values of inputs that a run is given */
#endif

#ifndef MECHC_STATES
#define MECHC_STATES 0 /* of the coordinates: those, the last, that no displacement moves */
#endif

#define MECHC_NX (MECHC_NQ + MECHC_NU)
/* Constants made of parameters, and last the number of rows that count: see generic_rank.h. */
#define MECHC_CONSTANTS (MECHC_NK + 1)
