/* Sizes of the unit, which the generated file sets; without it none of the lists has an entry. */
#pragma once

#include "dynamics/sizes.h"

#ifndef MECHC_FMU_INPUTS
#define MECHC_FMU_INPUTS 0 /* inputs that an importer gives */
#endif
#ifndef MECHC_FMU_OUTPUTS
#define MECHC_FMU_OUTPUTS(X) /* X(label, width) of each, MECHC_OWN values in all */
#endif
