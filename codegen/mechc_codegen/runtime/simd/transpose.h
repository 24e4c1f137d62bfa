/* A full block of rows of numbers in memory to lanes, a row a lane, and back. */
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include "simd/lanes.h"

#if (MECHC_LANES == 8 && defined __AVX512F__) || (MECHC_LANES == 4 && defined __AVX__)
/* Lanes of a, then of b, by number. */
#ifdef __clang__
#define MECHC_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define MECHC_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, (mechc_mask){__VA_ARGS__})
#endif

#if MECHC_LANES == 8
/* The numbers of 8 rows, an exchange within pairs, then between quarters, then between halves. */
MECHC_INLINE void mechc_transpose(const mechc_vector *rows, mechc_vector *out)
{
    mechc_vector pairs[8], halves[8];
    for (int i = 0; i < 8; i += 2) {
        pairs[i] = MECHC_SHUFFLE(rows[i], rows[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        pairs[i + 1] = MECHC_SHUFFLE(rows[i], rows[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i++) {
        const int first = i / 4 * 4 + i % 2;
        halves[i] = i % 4 < 2
                        ? MECHC_SHUFFLE(pairs[first], pairs[first + 2], 0, 1, 4, 5, 8, 9, 12, 13)
                        : MECHC_SHUFFLE(pairs[first], pairs[first + 2], 2, 3, 6, 7, 10, 11, 14, 15);
    }
    for (int i = 0; i < 4; i++) {
        out[i] = MECHC_SHUFFLE(halves[i], halves[i + 4], 0, 1, 4, 5, 8, 9, 12, 13);
        out[i + 4] = MECHC_SHUFFLE(halves[i], halves[i + 4], 2, 3, 6, 7, 10, 11, 14, 15);
    }
}

/* Load the first `count` numbers, then zeros; numbers beyond them are not read. */
MECHC_INLINE mechc_vector mechc_load_some(const double *from, int count)
{
    const unsigned char some = (unsigned char)(0xff >> (8 - count));
    return __builtin_ia32_loadupd512_mask(from, (mechc_vector){0}, some);
}
#else
MECHC_INLINE void mechc_transpose(const mechc_vector *rows, mechc_vector *out)
{
    mechc_vector pairs[4];
    for (int i = 0; i < 4; i += 2) {
        pairs[i] = MECHC_SHUFFLE(rows[i], rows[i + 1], 0, 4, 2, 6);
        pairs[i + 1] = MECHC_SHUFFLE(rows[i], rows[i + 1], 1, 5, 3, 7);
    }
    for (int i = 0; i < 2; i++) {
        out[i] = MECHC_SHUFFLE(pairs[i], pairs[i + 2], 0, 1, 4, 5);
        out[i + 2] = MECHC_SHUFFLE(pairs[i], pairs[i + 2], 2, 3, 6, 7);
    }
}

MECHC_INLINE mechc_vector mechc_load_some(const double *from, int count)
{
    const int64_t some[7] = {-1, -1, -1, -1, 0, 0, 0};
    mechc_quads mask;
    memcpy(&mask, some + 4 - count, sizeof mask);
    return __builtin_ia32_maskloadpd256((const mechc_vector *)from, mask);
}
#endif

MECHC_INLINE int mechc_fewer(int a, int b) { return a < b ? a : b; }

/* out[i][lane] = from[lane * stride + i], i < width */
MECHC_INLINE void mechc_gather_block(const double *from, ptrdiff_t stride, int width,
                                     mechc_vector *out)
{
    for (int first = 0; first < width; first += MECHC_LANES) {
        const int some = mechc_fewer(MECHC_LANES, width - first);
        mechc_vector rows[MECHC_LANES], columns[MECHC_LANES];
        for (int lane = 0; lane < MECHC_LANES; lane++)
            rows[lane] = mechc_load_some(from + lane * stride + first, some);
        mechc_transpose(rows, columns);
        for (int i = 0; i < some; i++) out[first + i] = columns[i];
    }
}

/* Store a block row by row. */
MECHC_INLINE void mechc_scatter_block(const mechc_vector *values, int width, double *to)
{
    for (int first = 0; first < width; first += MECHC_LANES) {
        const int some = mechc_fewer(MECHC_LANES, width - first);
        mechc_vector rows[MECHC_LANES], columns[MECHC_LANES];
        for (int i = 0; i < MECHC_LANES; i++)
            columns[i] = i < some ? values[first + i] : (mechc_vector){0};
        mechc_transpose(columns, rows);
        for (int lane = 0; lane < MECHC_LANES; lane++)
            memcpy(to + lane * width + first, &rows[lane], (size_t)some * sizeof(double));
    }
}
#else
MECHC_INLINE void mechc_gather_block(const double *from, ptrdiff_t stride, int width,
                                     mechc_vector *out)
{
    for (int i = 0; i < width; i++) {
        double column[MECHC_LANES];
        for (int lane = 0; lane < MECHC_LANES; lane++) column[lane] = from[lane * stride + i];
        memcpy(&out[i], column, sizeof column);
    }
}

MECHC_INLINE void mechc_scatter_block(const mechc_vector *values, int width, double *to)
{
    for (int i = 0; i < width; i++) {
        double column[MECHC_LANES];
        memcpy(column, &values[i], sizeof column);
        for (int lane = 0; lane < MECHC_LANES; lane++) to[lane * width + i] = column[lane];
    }
}
#endif

/* Copy `count` <= MECHC_LANES rows into the lanes; the last one is repeated. */
MECHC_INLINE void mechc_fill_from(const double *rows, ptrdiff_t stride, int count, int width,
                                  mechc_vector *out)
{
    for (int i = 0; i < width; i++) {
        const double *row = rows;
        double column[MECHC_LANES];
        for (int lane = 0; lane < MECHC_LANES; lane++) {
            column[lane] = row[i];
            if (lane + 1 < count) row += stride;
        }
        memcpy(&out[i], column, sizeof column);
    }
}

MECHC_INLINE void mechc_fill_lanes(const double *rows, int count, int width, mechc_vector *out)
{
    mechc_fill_from(rows, width, count, width, out);
}

MECHC_INLINE void mechc_empty_lanes(const mechc_vector *values, int count, int width, double *out)
{
    for (int i = 0; i < width && count < MECHC_LANES; i++) {
        double column[MECHC_LANES];
        memcpy(column, &values[i], sizeof column);
        for (int lane = 0; lane < count; lane++) out[lane * width + i] = column[lane];
    }
    if (count == MECHC_LANES) mechc_scatter_block(values, width, out);
}
