/* Runs a tape; generic over `real`.  Each operation is the one that the scene's C has in its place, so the
 * values have the same bits. */
#include <math.h>
#include "simd/real.h"
#if R_EXTENDED ? !defined MECHC_TAPE_RUN_EXTENDED \
    : R_VECTOR ? !defined MECHC_TAPE_RUN_VECTOR : !defined MECHC_TAPE_RUN_SCALAR
#if R_EXTENDED
#define MECHC_TAPE_RUN_EXTENDED
#elif R_VECTOR
#define MECHC_TAPE_RUN_VECTOR
#else
#define MECHC_TAPE_RUN_SCALAR
#endif
#if !R_EXTENDED
#include "dynamics/given.h"
#include "dynamics/sizes.h"
#include "simd/lanes.h"
#include "simd/sine_cosine.h"
#endif
#include "tape/tape.h"

MECHC_ONCE real FN(tape_call)(int function, real x)
{
    switch (function) {
#define MECHC_TAPE_CASE(name) \
    case MECHC_TAPE_CALL_##name: return R_CALL(name, x);
        MECHC_TAPE_CALLS(MECHC_TAPE_CASE)
#undef MECHC_TAPE_CASE
    }
    return x;
}

MECHC_ONCE real FN(tape_call_of_two)(int function, real x, real y)
{
    return function == MECHC_TAPE_CALL_pow ? R_CALL2(pow, x, y) : R_CALL2(atan2, x, y);
}

/* arrays: those of the function, in the order of its list; scalars: t, or those of a series. */
MECHC_ONCE real FN(run_tape)(int number, real *const *arrays, const real *scalars, const FN(given) *given,
                             real *turns, int near)
{
    const mechc_tape *tape = mechc_of_tapes.tapes + number;
    const mechc_operation *o = mechc_of_tapes.operations + tape->first, *const end = o + tape->count;
    real r[MECHC_AT_LEAST_ONE(tape->registers)], inputs[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    (void)turns, (void)near, (void)given;
    for (; o < end; o++) {
        switch (o->operation) {
        case MECHC_TAPE_NUMBER: r[o->to] = R(mechc_of_tapes.numbers[o->a]); break;
        case MECHC_TAPE_SCALAR: r[o->to] = scalars[o->a]; break;
        case MECHC_TAPE_LOAD: r[o->to] = o->a == MECHC_TAPE_INPUTS ? inputs[o->b] : arrays[o->a][o->b]; break;
        case MECHC_TAPE_STORE: arrays[o->a][o->b] = r[o->c]; break;
        case MECHC_TAPE_CLEAR:
            for (int i = 0; i < o->b; i++) arrays[o->a][i] = R(0.0);
            break;
        case MECHC_TAPE_INPUTS_READ:
            FN(read_inputs)(scalars[0], arrays[0], o->c ? arrays[1] : 0, given, o->a, o->b, inputs);
            break;
        case MECHC_TAPE_SINE_COSINE: FN(sincos)(r[o->a], &r[o->to], &r[o->b]); break;
#if !R_EXTENDED
        case MECHC_TAPE_TURN:
            FN(turn)(r[o->a], turns ? turns + 3 * o->c : 0, near, &r[o->to], &r[o->b]);
            break;
#endif
        case MECHC_TAPE_ADD: r[o->to] = r[o->a] + r[o->b]; break;
        case MECHC_TAPE_SUBTRACT: r[o->to] = r[o->a] - r[o->b]; break;
        case MECHC_TAPE_MULTIPLY: r[o->to] = r[o->a] * r[o->b]; break;
        case MECHC_TAPE_DIVIDE: r[o->to] = r[o->a] / r[o->b]; break;
        case MECHC_TAPE_NEGATE: r[o->to] = -r[o->a]; break;
        case MECHC_TAPE_FMA: r[o->to] = R_FMA(r[o->a], r[o->b], r[o->c]); break;
        case MECHC_TAPE_FNMA: r[o->to] = R_FNMA(r[o->a], r[o->b], r[o->c]); break;
        case MECHC_TAPE_FMS: r[o->to] = R_FMS(r[o->a], r[o->b], r[o->c]); break;
        case MECHC_TAPE_FNMS: r[o->to] = R_FNMS(r[o->a], r[o->b], r[o->c]); break;
        case MECHC_TAPE_SQRT: r[o->to] = R_SQRT(r[o->a]); break;
        case MECHC_TAPE_CALL: r[o->to] = FN(tape_call)(o->b, r[o->a]); break;
        case MECHC_TAPE_CALL2: r[o->to] = FN(tape_call_of_two)(o->c, r[o->a], r[o->b]); break;
#if R_EXTENDED /* masks in the gaps of loops choose alone */
#define MECHC_TAPE_MASK(condition) R((condition) ? 1.0 : 0.0)
#define MECHC_TAPE_HOLDS(x) ((x) != 0.0L)
#else
#define MECHC_TAPE_MASK(condition) R_FROM_BITS(R_MASK(condition))
#define MECHC_TAPE_HOLDS(x) R_BITS(x)
        case MECHC_TAPE_AND: r[o->to] = R_FROM_BITS(R_BITS(r[o->a]) & R_BITS(r[o->b])); break;
        case MECHC_TAPE_NOT: r[o->to] = R_FROM_BITS(~R_BITS(r[o->a])); break;
#endif
        case MECHC_TAPE_LESS: r[o->to] = MECHC_TAPE_MASK(r[o->a] < r[o->b]); break;
        case MECHC_TAPE_LESS_EQUAL: r[o->to] = MECHC_TAPE_MASK(r[o->a] <= r[o->b]); break;
        case MECHC_TAPE_EQUAL: r[o->to] = MECHC_TAPE_MASK(r[o->a] == r[o->b]); break;
        case MECHC_TAPE_NOT_EQUAL: r[o->to] = MECHC_TAPE_MASK(r[o->a] != r[o->b]); break;
        case MECHC_TAPE_SELECT: r[o->to] = R_SELECT(MECHC_TAPE_HOLDS(r[o->a]), r[o->b], r[o->c]); break;
#undef MECHC_TAPE_MASK
#undef MECHC_TAPE_HOLDS
        case MECHC_TAPE_RETURN: return r[o->a];
        }
    }
    return R(0.0);
}
#endif
