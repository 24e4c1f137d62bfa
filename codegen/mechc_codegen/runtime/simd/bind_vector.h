/* Binds the names that generic code uses to a short vector of doubles. */
#include "simd/unbind.h"
#define real mechc_lane
#define rmask mechc_lane_mask
#define RLANES MECHC_LANES
#define FN(name) mechc_lanes_##name
#define R(number) ((mechc_lane){0} + (double)(number))
#define R_BITS(x) ((mechc_lane_mask)(x))
#define R_FROM_BITS(b) ((mechc_lane)(b))
#define R_MASK(condition) (condition)
#define R_SELECT(mask, a, b) \
    R_FROM_BITS(((mask) & R_BITS(a)) | (~(mask) & R_BITS(b)))
#define R_ANY(mask) mechc_any(mask)
#define R_ANY_BEYOND(x, limit) mechc_any_beyond(x, limit)
#define R_SQRT(x) mechc_sqrt(x)
#define R_CALL(f, x) mechc_call(f, x)
#define R_CALL2(f, x, y) mechc_call2(f, x, y)
#define R_GREATEST(x) mechc_greatest(x)
#define R_LEAST(x) (-mechc_greatest(-(x)))

#ifndef MECHC_LANE_FUNCTIONS
#define MECHC_LANE_FUNCTIONS
/* One instruction where there is one: gcc moves the lanes one by one otherwise. */
MECHC_INLINE int mechc_any(mechc_lane_mask mask)
{
#if MECHC_LANES == 8 && defined __AVX512DQ__
    return _mm512_movepi64_mask((__m512i)mask) != 0;
#elif MECHC_LANES == 4 && defined __AVX__
    return _mm256_movemask_pd((__m256d)mask) != 0;
#elif MECHC_LANES == 2 && defined __SSE2__
    return _mm_movemask_pd((__m128d)mask) != 0;
#else
    int64_t any = 0;
    for (int k = 0; k < MECHC_LANES; k++) any |= mask[k];
    return any != 0;
#endif
}

/* |x| > limit, or x not a number, in some lane */
MECHC_INLINE int mechc_any_beyond(mechc_lane x, double limit)
{
    const mechc_lane size = (mechc_lane)((mechc_lane_mask)x & INT64_MAX);
#if MECHC_LANES == 8 && defined __AVX512DQ__
    return _mm512_cmp_pd_mask((__m512d)size, _mm512_set1_pd(limit), _CMP_NLE_UQ) != 0;
#else
    return mechc_any(~(size <= limit));
#endif
}

MECHC_INLINE mechc_lane mechc_sqrt(mechc_lane x)
{
#if MECHC_LANES == 8 && defined __AVX512F__
    return (mechc_lane)_mm512_sqrt_pd((__m512d)x);
#elif MECHC_LANES == 4 && defined __AVX__
    return (mechc_lane)_mm256_sqrt_pd((__m256d)x);
#elif MECHC_LANES == 2 && defined __SSE2__
    return (mechc_lane)_mm_sqrt_pd((__m128d)x);
#else
    for (int k = 0; k < MECHC_LANES; k++) x[k] = __builtin_sqrt(x[k]);
    return x;
#endif
}

MECHC_INLINE mechc_lane mechc_call(double (*f)(double), mechc_lane x)
{
    mechc_lane y = x;
    for (int k = 0; k < MECHC_LANES; k++) y[k] = f(x[k]);
    return y;
}

MECHC_INLINE mechc_lane mechc_call2(double (*f)(double, double), mechc_lane x, mechc_lane e)
{
    mechc_lane y = x;
    for (int k = 0; k < MECHC_LANES; k++) y[k] = f(x[k], e[k]);
    return y;
}

/* The greater in each lane; NaN where either is. */
MECHC_INLINE mechc_lane mechc_greater(mechc_lane a, mechc_lane b)
{
    const mechc_lane_mask first = (a > b) | (a != a);
    return (mechc_lane)((first & (mechc_lane_mask)a) | (~first & (mechc_lane_mask)b));
}

/* NaN in any lane gives NaN. */
MECHC_INLINE double mechc_greatest(mechc_lane x)
{
    double lanes[MECHC_LANES];
    if (__builtin_expect(mechc_any(x != x), 0)) return NAN;
    memcpy(lanes, &x, sizeof lanes);
    for (int apart = MECHC_LANES / 2; apart > 0; apart /= 2)
        for (int k = 0; k < apart; k++) lanes[k] = mechc_max(lanes[k], lanes[k + apart]);
    return lanes[0];
}
#endif
