/* Eight doubles side by side: the scene's recurrences are spread into vectors from registers, which
 * a load right after eight stores would have to wait for. */
#pragma once

#include <string.h>
#include "simd/vector.h"

#define MECHC_SPREAD_WIDTH MECHC_AT_LEAST_ONE((MECHC_SERIES_SUMS + 7) / 8 * 8)
#define MECHC_SPREAD_WIDTH_MAX MECHC_AT_LEAST_ONE((MECHC_SERIES_SUMS_MAX + 7) / 8 * 8)

MECHC_INLINE void mechc_store_lanes(mechc_vector lanes, double *at)
{
    memcpy(at, &lanes, sizeof lanes);
}

#if MECHC_LANES == 8
#define MECHC_SPREAD(a, b, c, d, e, f, g, h, at) \
    mechc_store_lanes((mechc_vector){a, b, c, d, e, f, g, h}, at)
#elif MECHC_LANES == 4
#define MECHC_SPREAD(a, b, c, d, e, f, g, h, at) \
    (mechc_store_lanes((mechc_vector){a, b, c, d}, at), \
     mechc_store_lanes((mechc_vector){e, f, g, h}, (at) + 4))
#else
#define MECHC_SPREAD(a, b, c, d, e, f, g, h, at) \
    (mechc_store_lanes((mechc_vector){a, b}, at), \
     mechc_store_lanes((mechc_vector){c, d}, (at) + 2), \
     mechc_store_lanes((mechc_vector){e, f}, (at) + 4), \
     mechc_store_lanes((mechc_vector){g, h}, (at) + 6))
#endif
