/* Sizes of a scene's variational equations. */
#pragma once

#include "dynamics/sizes.h"

/* A scene defines as 1 where it has them: MECHC_VARIATIONAL, sensitivities were asked for; MECHC_GRADIENT,
 * the derivative of the constraints by q is none of J's rows; MECHC_GAP_BY_PARAMETERS, _BY_INPUTS and
 * MECHC_GAP_RATE_BY_PARAMETERS, _BY_INPUTS, derivatives of the constraints and of their rates. */

#define MECHC_NB (MECHC_NP + MECHC_NI)       /* parameters, then values of inputs */
#define MECHC_SLOPES (MECHC_NX + MECHC_NB)   /* columns: by the state, then by these */

#define MECHC_NB_MAX (MECHC_NP_MAX + MECHC_NI_MAX)
#define MECHC_SLOPES_MAX (MECHC_NX_MAX + MECHC_NB_MAX)
