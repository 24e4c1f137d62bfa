/* Sizes of the unit, which the generated file sets; otherwise none of the lists has an entry. */
#pragma once

#include "dynamics/sizes.h"

#ifndef MECHC_FMU_INPUTS
#define MECHC_FMU_INPUTS 0 /* inputs that an importer gives */
#endif
#ifndef MECHC_FMU_OUTPUTS
#define MECHC_FMU_OUTPUTS(X) /* X(label, width) of each, MECHC_FMU_VALUES in all */
#define MECHC_FMU_VALUES 0
#endif
#ifndef MECHC_FMU_EVENTS
#define MECHC_FMU_EVENTS 0 /* events of mechc_fmu_scene.events */
#endif
#ifndef MECHC_FMU_CONTACTS
#define MECHC_FMU_CONTACTS 0 /* of them: stops, and places of dry friction */
#endif
/* Switches with which a unit includes only what its motions may need. */
#define MECHC_WITH_EVENTS (MECHC_FMU_EVENTS > 0)
#define MECHC_WITH_CONTACTS (MECHC_FMU_CONTACTS > 0)
