/* Saved states of a unit.
 *
 * In the instance that saved it a run continues to the last bit.  As bytes a state is a moment
 * alone: a run begins anew there. */
#pragma once

#include "fmu/advance.h"

typedef struct {
    mechc_moment moment;
    int moved, driven;
    const mechc_fmu *of; /* whose run it is; NULL: bytes */
    size_t size;         /* of the run; 0: none */
    double run[];
} mechc_fmu_saved;

MECHC_STATIC mechc_fmu_saved *mechc_fmu_new_saved(size_t size)
{
    return calloc(1, sizeof(mechc_fmu_saved) + size);
}

/* Save the state, replacing `state`, which may be NULL. */
MECHC_STATIC mechc_fmu_status mechc_fmu_save(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    const size_t size = mechc_reach_saved_size(&fmu->reacher);
    mechc_fmu_saved *saved = mechc_fmu_new_saved(size);
    if (!saved) return mechc_fmu_fails(fmu, "no memory");
    mechc_fmu_current(fmu);
    saved->moment = fmu->now;
    saved->moved = fmu->moved;
    saved->driven = fmu->driven;
    saved->of = fmu;
    saved->size = size;
    if (size) mechc_reach_save(&fmu->reacher, saved->run);
    free(*state);
    *state = saved;
    return MECHC_FMU_OK;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_forget_state(mechc_fmu_saved **state)
{
    if (state) {
        free(*state);
        *state = 0;
    }
    return MECHC_FMU_OK;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_restore(mechc_fmu *fmu, const mechc_fmu_saved *saved)
{
    const int goes_on = saved->of == fmu && saved->size > 0;
    fmu->now = saved->moment;
    fmu->given_parameters = 1;
    fmu->moved = saved->moved;
    fmu->driven = saved->driven;
    fmu->evaluated = 0;
    mechc_fmu_set_options(fmu);
    return mechc_reach_restore(&fmu->reacher, fmu->now.t, fmu->now.y, goes_on ? saved->run : 0)
        ? MECHC_FMU_OK : mechc_fmu_fails(fmu, "no memory");
}

#define MECHC_FMU_BYTES sizeof(mechc_moment)

MECHC_STATIC mechc_fmu_status mechc_fmu_to_bytes(const mechc_fmu *fmu, const mechc_fmu_saved *saved,
                                                 void *bytes, size_t size)
{
    if (size < MECHC_FMU_BYTES) return mechc_fmu_fails(fmu, "a state needs more bytes");
    memcpy(bytes, &saved->moment, MECHC_FMU_BYTES);
    return MECHC_FMU_OK;
}

/* Restore a state from bytes, replacing `state`, which may be NULL. */
MECHC_STATIC mechc_fmu_status mechc_fmu_from_bytes(const mechc_fmu *fmu, const void *bytes,
                                                   size_t size, mechc_fmu_saved **state)
{
    if (size < MECHC_FMU_BYTES) return mechc_fmu_fails(fmu, "a state needs more bytes");
    mechc_fmu_saved *saved = mechc_fmu_new_saved(0);
    if (!saved) return mechc_fmu_fails(fmu, "no memory");
    memcpy(&saved->moment, bytes, MECHC_FMU_BYTES);
    free(*state);
    *state = saved;
    return MECHC_FMU_OK;
}
