/* Inputs that are given to a run: numbers, sampled signals, functions that someone calls back.
 *
 * A scene that has any finds them by one number more behind its parameters, so that nothing else
 * has to hand them on.  The number is 1 + address / 2^52, which no arithmetic mode takes for a
 * denormal: moved and copied like a parameter, never computed with.
 */
#ifndef MECHC_INPUTS_H
#define MECHC_INPUTS_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MECHC_ADDRESS_BITS 52

typedef struct mechc_inputs mechc_inputs;

struct mechc_inputs {
    /* Values first .. last - 1 at a time and, where needs_state, a state; q and u may be NULL
     * where nothing needs the state. */
    void (*evaluate)(const mechc_inputs *inputs, int first, int last, double t, const double *q,
                     const double *u, double *values);
    int needs_state;
};

static inline double mechc_inputs_passed(const mechc_inputs *inputs)
{
    const uint64_t bits = (uint64_t)(uintptr_t)inputs | UINT64_C(1023) << MECHC_ADDRESS_BITS;
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static inline const mechc_inputs *mechc_inputs_found(double number)
{
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return (const mechc_inputs *)(uintptr_t)(bits & ((UINT64_C(1) << MECHC_ADDRESS_BITS) - 1));
}

#endif
