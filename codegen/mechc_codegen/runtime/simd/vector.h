/* Vector operations besides the operators: selection, roots, conversion between lanes and numbers. */
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>
#include "simd/lanes.h"

/* One instruction where there is one: gcc moves the lanes one by one otherwise. */
MECHC_INLINE int mechc_any(mechc_mask mask)
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
MECHC_INLINE int mechc_any_beyond(mechc_vector x, double limit)
{
    const mechc_vector size = (mechc_vector)((mechc_mask)x & INT64_MAX);
#if MECHC_LANES == 8 && defined __AVX512DQ__
    return _mm512_cmp_pd_mask((__m512d)size, _mm512_set1_pd(limit), _CMP_NLE_UQ) != 0;
#else
    return mechc_any(~(size <= limit));
#endif
}

MECHC_INLINE mechc_vector mechc_sqrt(mechc_vector x)
{
#if MECHC_LANES == 8 && defined __AVX512F__
    return (mechc_vector)_mm512_sqrt_pd((__m512d)x);
#elif MECHC_LANES == 4 && defined __AVX__
    return (mechc_vector)_mm256_sqrt_pd((__m256d)x);
#elif MECHC_LANES == 2 && defined __SSE2__
    return (mechc_vector)_mm_sqrt_pd((__m128d)x);
#else
    for (int k = 0; k < MECHC_LANES; k++) x[k] = __builtin_sqrt(x[k]);
    return x;
#endif
}

/* a b + c in each lane.  Of a b + c d a compiler may fuse either product, and not the same in lanes as
 * in one double; where both must have the same bits it is said which. */
MECHC_INLINE mechc_vector mechc_fused(mechc_vector a, mechc_vector b, mechc_vector c)
{
#if MECHC_LANES == 8 && defined __AVX512F__
    return (mechc_vector)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
#elif MECHC_LANES == 4 && defined __FMA__
    return (mechc_vector)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
#elif MECHC_LANES == 2 && defined __FMA__
    return (mechc_vector)_mm_fmadd_pd((__m128d)a, (__m128d)b, (__m128d)c);
#else
    return a * b + c;
#endif
}

/* Keeps a number in its register, where there are 32: gcc would load it again for each of its uses. */
#if defined __AVX512F__ && defined __GNUC__
#define MECHC_HOLD(x) __asm__("" : "+v"(x))
#else
#define MECHC_HOLD(x) ((void)0)
#endif

MECHC_INLINE mechc_vector mechc_each(double (*f)(double), mechc_vector x)
{
    mechc_vector y = x;
    for (int k = 0; k < MECHC_LANES; k++) y[k] = f(x[k]);
    return y;
}

MECHC_INLINE mechc_vector mechc_each2(double (*f)(double, double), mechc_vector x, mechc_vector e)
{
    mechc_vector y = x;
    for (int k = 0; k < MECHC_LANES; k++) y[k] = f(x[k], e[k]);
    return y;
}

/* The greater in each lane; NaN where either is. */
MECHC_INLINE mechc_vector mechc_greater(mechc_vector a, mechc_vector b)
{
    const mechc_mask first = (a > b) | (a != a);
    return (mechc_vector)((first & (mechc_mask)a) | (~first & (mechc_mask)b));
}

/* NaN in any lane gives NaN. */
MECHC_INLINE double mechc_greatest(mechc_vector x)
{
    double lanes[MECHC_LANES];
    if (__builtin_expect(mechc_any(x != x), 0)) return NAN;
    memcpy(lanes, &x, sizeof lanes);
    for (int apart = MECHC_LANES / 2; apart > 0; apart /= 2)
        for (int k = 0; k < apart; k++) lanes[k] = mechc_max(lanes[k], lanes[k + apart]);
    return lanes[0];
}

MECHC_INLINE mechc_vector mechc_choose(mechc_mask mask, mechc_vector a, mechc_vector b)
{
    return (mechc_vector)((mask & (mechc_mask)a) | (~mask & (mechc_mask)b));
}

MECHC_INLINE mechc_vector mechc_lesser(mechc_vector a, mechc_vector b)
{
    return mechc_choose(a < b, a, b);
}

MECHC_INLINE mechc_vector mechc_size_of(mechc_vector x)
{
    return (mechc_vector)((mechc_mask)x & INT64_MAX);
}

/* The greater of a and |b|. */
MECHC_INLINE mechc_vector mechc_larger(mechc_vector a, mechc_vector b)
{
    return mechc_greater(a, (mechc_vector)((mechc_mask)b & INT64_MAX));
}

MECHC_INLINE mechc_vector mechc_spread(double x) { return (mechc_vector){0} + x; }

MECHC_INLINE mechc_vector mechc_take(const double *eight, int block)
{
    mechc_vector lanes;
    memcpy(&lanes, eight + block * MECHC_LANES, sizeof lanes);
    return lanes;
}

MECHC_INLINE void mechc_put(mechc_vector lanes, double *eight, int block)
{
    memcpy(eight + block * MECHC_LANES, &lanes, sizeof lanes);
}
