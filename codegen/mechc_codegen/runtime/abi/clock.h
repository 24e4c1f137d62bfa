/* Seconds since a fixed time, which no setting of the clock moves. */
#pragma once

#include <time.h>

static inline double mechc_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
