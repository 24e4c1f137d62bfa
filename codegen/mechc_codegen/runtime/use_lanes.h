/* Binds the names that generic code uses to a short vector of doubles. */
#include "unuse.h"
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
#define R_SQRT(x) mechc_sqrt(x)
#define R_CALL(f, x) mechc_call(f, x)
#define R_CALL2(f, x, y) mechc_call2(f, x, y)
#define R_GREATEST(x) mechc_greatest(x)
#define R_LEAST(x) (-mechc_greatest(-(x)))

#ifndef MECHC_LANE_FUNCTIONS
#define MECHC_LANE_FUNCTIONS
MECHC_INLINE int mechc_any(mechc_lane_mask mask)
{
    int64_t any = 0;
    for (int k = 0; k < MECHC_LANES; k++) any |= mask[k];
    return any != 0;
}

MECHC_INLINE mechc_lane mechc_sqrt(mechc_lane x)
{
    double lanes[MECHC_LANES]; /* a loop over an array becomes one vector instruction */
    memcpy(lanes, &x, sizeof lanes);
    for (int k = 0; k < MECHC_LANES; k++) lanes[k] = __builtin_sqrt(lanes[k]);
    memcpy(&x, lanes, sizeof lanes);
    return x;
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

/* NaN in any lane gives NaN. */
MECHC_INLINE double mechc_greatest(mechc_lane x)
{
    double greatest = x[0];
    for (int k = 1; k < MECHC_LANES; k++)
        greatest = x[k] > greatest || x[k] != x[k] ? x[k] : greatest;
    return greatest;
}
#endif
