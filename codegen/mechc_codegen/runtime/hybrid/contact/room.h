/* Memory for several arrays of numbers in one block. */
#pragma once

#include <stdlib.h>
#include "abi/macros.h"

typedef struct {
    double **at;
    size_t count;
} mechc_part_of_room;

/* Allocate one zeroed block for all parts; free() takes the first one.  0 without memory. */
MECHC_STATIC int mechc_make_room_for(const mechc_part_of_room *parts, size_t count)
{
    size_t all = 1;
    for (size_t i = 0; i < count; i++) all += parts[i].count;
    double *room = calloc(all, sizeof *room);
    *parts[0].at = room;
    for (size_t i = 0; room && i < count; i++) *parts[i].at = room, room += parts[i].count;
    return *parts[0].at != 0;
}

#define MECHC_ROOM_FOR(parts) mechc_make_room_for(parts, sizeof(parts) / sizeof *(parts))
