/* Seconds since a fixed time, which no setting of the clock moves. */
#pragma once

#include <time.h>

#define MECHC_NANOSECONDS 1000000000 /* of a second */

static inline double mechc_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / MECHC_NANOSECONDS;
}
