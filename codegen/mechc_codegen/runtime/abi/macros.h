/* Macros for how functions are compiled, and for names composed of other names. */
#pragma once

#ifdef MECHC_SMALL /* inline what the compiler chooses */
#define MECHC_INLINE static inline __attribute__((unused))
#else
#define MECHC_INLINE static inline __attribute__((always_inline, unused))
#endif
#define MECHC_STATIC static __attribute__((unused))
#define MECHC_ONCE static __attribute__((noinline, unused)) /* compiled once, called from many */
#define MECHC_RARE static __attribute__((cold, unused)) /* not in every step: compiled small */
#define MECHC_RARE_ONCE static __attribute__((cold, noinline, unused))
#ifdef __clang__ /* makes no copies for the constants of a call */
#define MECHC_SINGLE MECHC_ONCE
#else
#define MECHC_SINGLE MECHC_ONCE __attribute__((noclone))
#endif

#define MECHC_QUOTE_(x) #x
#define MECHC_QUOTE(x) MECHC_QUOTE_(x)
#define MECHC_JOIN_(a, b) a##b
#define MECHC_JOIN(a, b) MECHC_JOIN_(a, b)
#define MECHC_AT_LEAST_ONE(n) ((n) > 0 ? (n) : 1) /* no array in C is empty */
