/* Memory for vectors, at multiples of 64 bytes. */
#pragma once

#include <stdlib.h>
#include "simd/lanes.h"
#ifdef _WIN32 /* its C library has no aligned_alloc, and other names */
#include <malloc.h>
#endif

/* Allocate without initialisation; NULL without memory. */
MECHC_STATIC void *mechc_new_aligned(size_t bytes)
{
    const size_t whole = (bytes + 63) / 64 * 64;
#ifdef _WIN32
    return _aligned_malloc(whole, 64);
#else
    return aligned_alloc(64, whole);
#endif
}

MECHC_STATIC void mechc_free_aligned(void *memory)
{
#ifdef _WIN32
    _aligned_free(memory);
#else
    free(memory);
#endif
}
