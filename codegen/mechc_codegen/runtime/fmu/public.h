/* What the functions of both versions of FMI share. */
#pragma once

#include "fmu/advance.h"
#include "fmu/exchange.h"
#include "fmu/saved_state.h"

/* No header declares the functions of FMI: importers find them by name. */
#if defined _WIN32
#define MECHC_FMI __declspec(dllexport)
#else
#define MECHC_FMI __attribute__((visibility("default")))
#endif

/* A unit has real variables alone. */
MECHC_STATIC mechc_fmu_status mechc_fmu_has_none(const mechc_fmu *fmu, size_t count)
{
    return count == 0 ? MECHC_FMU_OK : mechc_fmu_fails(fmu, "there is no variable of this type");
}

MECHC_STATIC void mechc_fmu_initialise(mechc_fmu *fmu, double t0, double tolerance)
{
    fmu->now.t = t0;
    if (tolerance > 0.0) fmu->now.rtol = tolerance;
    fmu->moved = fmu->given_parameters = 1;
    fmu->evaluated = 0;
}
