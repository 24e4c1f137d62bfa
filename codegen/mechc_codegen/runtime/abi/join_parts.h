/* A unit of which parts are loaded one after the other. */
#pragma once

#include "model.h"
#include "parts.h"

typedef struct {
    mechc_unit unit;
    const mechc_method *methods[MECHC_METHODS];
    int parts;
} mechc_joined;

/* Add the functions of a part to the unit.  Other threads may call functions of the unit meanwhile. */
static inline void mechc_join(mechc_joined *joined, const mechc_unit *part, int parts)
{
    mechc_unit *unit = &joined->unit;
    const int traits_only = !(parts & ~MECHC_PART_DRIVER); /* of the methods */
    for (int i = 0; part->methods && i < MECHC_METHODS; i++)
        if (part->methods[i] && !(traits_only && joined->methods[i]))
            joined->methods[i] = part->methods[i];
#define MECHC_TAKE(function) if (part->function) unit->function = part->function
    MECHC_TAKE(advance);
    MECHC_TAKE(advance_lockstep);
    MECHC_TAKE(outputs);
    MECHC_TAKE(give);
    MECHC_TAKE(rates);
    MECHC_TAKE(mass);
    MECHC_TAKE(project);
    MECHC_TAKE(run_size);
    MECHC_TAKE(start);
    MECHC_TAKE(release);
    MECHC_TAKE(interpolate);
    MECHC_TAKE(extend);
    MECHC_TAKE(saved_size);
    MECHC_TAKE(save);
    MECHC_TAKE(restore);
    MECHC_TAKE(vary);
    MECHC_TAKE(covary);
    MECHC_TAKE(project_columns);
#undef MECHC_TAKE
    joined->parts |= parts & MECHC_PART_TAYLOR_LANES ? parts | MECHC_PART_TAYLOR : parts;
}

/* The part that contains the code of a method. */
static inline int mechc_part_of_method(int method)
{
#define MECHC_METHOD_PART(name, NUMBER, number, PART, ...) MECHC_PART_##PART,
    static const int parts[] = {MECHC_METHOD_TABLE(MECHC_METHOD_PART)};
    return parts[method];
}

/* The part that contains the code for several runs of a method in the lanes. */
static inline int mechc_part_of_members(int method)
{
    return method == MECHC_TAYLOR ? MECHC_PART_TAYLOR_LANES : mechc_part_of_method(method);
}
