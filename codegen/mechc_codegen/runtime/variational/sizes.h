/* Sizes of a scene's variational equations. */
#pragma once

#include "dynamics/sizes.h"

#ifndef MECHC_VARIATIONAL
#define MECHC_VARIATIONAL 0 /* sensitivities were asked for */
#endif
#ifndef MECHC_GRADIENT
#define MECHC_GRADIENT 0 /* the derivative of the constraints by q is none of J's rows */
#endif
#ifndef MECHC_GAP_BY_PARAMETERS
#define MECHC_GAP_BY_PARAMETERS 0
#endif
#ifndef MECHC_GAP_BY_INPUTS
#define MECHC_GAP_BY_INPUTS 0
#endif
#ifndef MECHC_GAP_RATE_BY_PARAMETERS
#define MECHC_GAP_RATE_BY_PARAMETERS 0
#endif
#ifndef MECHC_GAP_RATE_BY_INPUTS
#define MECHC_GAP_RATE_BY_INPUTS 0
#endif

#define MECHC_NB (MECHC_NP + MECHC_NI)       /* parameters, then values of inputs */
#define MECHC_SLOPES (MECHC_NX + MECHC_NB)   /* columns: by the state, then by these */
