/* Vector operations besides the operators: selection, roots, conversion between lanes and numbers. */
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>
#include "simd/lanes.h"

/* Operands of instructions of AVX-512. */
enum { MECHC_ALL_LANES = 0xff, MECHC_NOT_BELOW_NOR_ALIKE = 0x16, MECHC_ROUNDING_AS_SET = 4 };

MECHC_INLINE mechc_vector mechc_spread(double x) { return x - (mechc_vector){0}; }

/* One instruction where there is one: gcc moves the lanes one by one otherwise. */
MECHC_INLINE int mechc_any(mechc_mask mask)
{
#if MECHC_LANES == 8 && defined __AVX512DQ__
    return __builtin_ia32_cvtq2mask512((mechc_quads)mask) != 0;
#elif MECHC_LANES == 4 && defined __AVX__
    return __builtin_ia32_movmskpd256((mechc_vector)mask) != 0;
#elif MECHC_LANES == 2 && defined __SSE2__
    return __builtin_ia32_movmskpd((mechc_vector)mask) != 0;
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
    return __builtin_ia32_cmppd512_mask(size, mechc_spread(limit), MECHC_NOT_BELOW_NOR_ALIKE,
                                        MECHC_ALL_LANES, MECHC_ROUNDING_AS_SET) != 0;
#else
    return mechc_any(~(size <= limit));
#endif
}

/* Roots and fused products have other names in each compiler; older ones of clang have none. */
#if !defined __clang__
#define MECHC_HAS_OF_ALL 0
#elif __has_builtin(__builtin_elementwise_sqrt) && __has_builtin(__builtin_elementwise_fma)
#define MECHC_HAS_OF_ALL 1
#else
#define MECHC_HAS_OF_ALL 0
#endif

MECHC_INLINE mechc_vector mechc_sqrt(mechc_vector x)
{
#if MECHC_HAS_OF_ALL
    return __builtin_elementwise_sqrt(x);
#elif MECHC_LANES == 8 && defined __AVX512F__ && !defined __clang__
    return __builtin_ia32_sqrtpd512_mask(x, x, MECHC_ALL_LANES, MECHC_ROUNDING_AS_SET);
#elif MECHC_LANES == 4 && defined __AVX__ && !defined __clang__
    return __builtin_ia32_sqrtpd256(x);
#elif MECHC_LANES == 2 && defined __SSE2__ && !defined __clang__
    return __builtin_ia32_sqrtpd(x);
#else
    for (int k = 0; k < MECHC_LANES; k++) x[k] = __builtin_sqrt(x[k]);
    return x;
#endif
}

/* Products and their additions in each lane, rounded once where the processor can.  Compilers fuse nothing by
 * themselves: what they chose would differ from one to the next, and in lanes from one double. */
#if MECHC_HAS_OF_ALL && MECHC_HAS_FUSED
#define MECHC_FUSE(a, b, c, sign, product, instruction) \
    return __builtin_elementwise_fma(product(a), b, sign(c));
#elif MECHC_LANES == 8 && defined __AVX512F__ && !defined __clang__
#define MECHC_FUSE(a, b, c, sign, product, instruction) \
    return __builtin_ia32_v##instruction##pd512_mask(a, b, c, MECHC_ALL_LANES, MECHC_ROUNDING_AS_SET);
#elif MECHC_LANES == 4 && defined __FMA__ && !defined __clang__
#define MECHC_FUSE(a, b, c, sign, product, instruction) return __builtin_ia32_v##instruction##pd256(a, b, c);
#elif MECHC_LANES == 2 && defined __FMA__ && !defined __clang__
#define MECHC_FUSE(a, b, c, sign, product, instruction) return __builtin_ia32_v##instruction##pd(a, b, c);
#elif MECHC_HAS_FUSED
#define MECHC_FUSE(a, b, c, sign, product, instruction) \
    for (int k = 0; k < MECHC_LANES; k++) c[k] = __builtin_fma(product(a[k]), b[k], sign(c[k])); \
    return c;
#else
#define MECHC_FUSE(a, b, c, sign, product, instruction) return product(a * b) + sign(c);
#endif
/* a b + c */
MECHC_INLINE mechc_vector mechc_fused(mechc_vector a, mechc_vector b, mechc_vector c)
{
    MECHC_FUSE(a, b, c, +, +, fmadd)
}
/* c - a b */
MECHC_INLINE mechc_vector mechc_fused_off(mechc_vector a, mechc_vector b, mechc_vector c)
{
    MECHC_FUSE(a, b, c, +, -, fnmadd)
}
/* a b - c */
MECHC_INLINE mechc_vector mechc_fused_less(mechc_vector a, mechc_vector b, mechc_vector c)
{
    MECHC_FUSE(a, b, c, -, +, fmsub)
}

/* -a b - c */
MECHC_INLINE mechc_vector mechc_fused_neither(mechc_vector a, mechc_vector b, mechc_vector c)
{
    MECHC_FUSE(a, b, c, -, -, fnmsub)
}

/* x <- x + a b and x <- x - a b of lanes, as R_ADD and R_SUB of generic code. */
#define MECHC_ADD(x, a, b) ((x) = mechc_fused(a, b, x))
#define MECHC_SUB(x, a, b) ((x) = mechc_fused_off(a, b, x))

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
