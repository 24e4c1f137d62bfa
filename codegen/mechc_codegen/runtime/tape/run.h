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
#include "simd/lanes.h"
#include "simd/sine_cosine.h"
#endif
#include "simd/lookup.h"
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

MECHC_ONCE real FN(tape_lookup)(const mechc_tape_code *code, int number, real x, real y)
{
    const mechc_tape_table *table = code->tables + number;
    mechc_table of = {table->axis_count, table->degree, .coefficients = code->of_tables + table->coefficients};
    for (int i = 0; i < table->axis_count; i++) {
        const double *starts = code->of_tables + table->starts[i];
        of.axes[i] = (mechc_table_axis){starts, table->pieces[i], starts[table->pieces[i]]};
    }
#if R_VECTOR
    double of_x[RLANES], of_y[RLANES];
    memcpy(of_x, &x, sizeof x);
    memcpy(of_y, &y, sizeof y);
    for (int lane = 0; lane < RLANES; lane++)
        of_x[lane] = mechc_lookup(&of, table->order[0], table->order[1], of_x[lane], of_y[lane]);
    memcpy(&x, of_x, sizeof x);
    return x;
#else
    return mechc_lookup(&of, table->order[0], table->order[1], (double)x, (double)y);
#endif
}

/* arrays: those of the function, in the order of its list; scalars: t, or those of a series; given: a scene's,
 * of which inputs are read, or NULL.  Each operation goes to the next one by itself, which processors foretell
 * better than one switch for all; loads, constants and stores come in runs. */
MECHC_ONCE real FN(run_tape)(const mechc_tape_code *code, int number, real *const *arrays, const real *scalars,
                             const void *given, real *turns, int near)
{
#define MECHC_TAPE_LABEL(name) &&of_##name,
    static const void *const labels[] = {MECHC_TAPE_OPERATIONS(MECHC_TAPE_LABEL)};
#undef MECHC_TAPE_LABEL
    const mechc_tape *tape = code->tapes + number;
    const mechc_operation *o = code->operations + tape->first;
    const double *numbers = code->numbers;
    real r[tape->registers + 1];
#if MECHC_GENERAL /* a scene, which may have inputs */
    real inputs[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
#endif
    (void)turns, (void)near, (void)given;
#define MECHC_TAPE_NEXT goto *labels[(++o)->operation]
#define MECHC_TAPE_DO(name, value) \
    of_##name: r[o->to] = value; \
    MECHC_TAPE_NEXT
#define MECHC_TAPE_DO_ALL(name, action)                          \
    of_##name: do { action; } while ((++o)->operation == MECHC_TAPE_##name); \
    goto *labels[o->operation]
    goto *labels[o->operation];
    MECHC_TAPE_DO_ALL(NUMBER, r[o->to] = R(numbers[o->a]));
    MECHC_TAPE_DO_ALL(LOAD, r[o->to] = arrays[o->a][o->b]);
    MECHC_TAPE_DO_ALL(STORE, arrays[o->a][o->b] = r[o->c]);
    MECHC_TAPE_DO(SCALAR, scalars[o->a]);
#if MECHC_GENERAL
    MECHC_TAPE_DO(INPUT, inputs[o->a]);
#else
of_INPUT:
    MECHC_TAPE_NEXT;
#endif
of_CLEAR:
    for (int i = 0; i < o->b; i++) arrays[o->a][i] = R(0.0);
    MECHC_TAPE_NEXT;
of_INPUTS_READ:
#if MECHC_GENERAL && MECHC_NI_MAX > 0
    FN(read_inputs)(scalars[0], arrays[0], o->c ? arrays[1] : 0, given, o->a, o->b, inputs);
#endif
    MECHC_TAPE_NEXT;
of_SINE_COSINE:
    FN(sincos)(r[o->a], &r[o->to], &r[o->b]);
    MECHC_TAPE_NEXT;
of_TURN:
#if !R_EXTENDED
    FN(turn)(r[o->a], turns ? turns + 3 * o->c : 0, near, &r[o->to], &r[o->b]);
#endif
    MECHC_TAPE_NEXT;
    MECHC_TAPE_DO(ADD, r[o->a] + r[o->b]);
    MECHC_TAPE_DO(SUBTRACT, r[o->a] - r[o->b]);
    MECHC_TAPE_DO(MULTIPLY, r[o->a] * r[o->b]);
    MECHC_TAPE_DO(DIVIDE, r[o->a] / r[o->b]);
    MECHC_TAPE_DO(NEGATE, -r[o->a]);
    MECHC_TAPE_DO(FMA, R_FMA(r[o->a], r[o->b], r[o->c]));
    MECHC_TAPE_DO(FNMA, R_FNMA(r[o->a], r[o->b], r[o->c]));
    MECHC_TAPE_DO(FMS, R_FMS(r[o->a], r[o->b], r[o->c]));
    MECHC_TAPE_DO(FNMS, R_FNMS(r[o->a], r[o->b], r[o->c]));
    MECHC_TAPE_DO(SQRT, R_SQRT(r[o->a]));
    MECHC_TAPE_DO(CALL, FN(tape_call)(o->b, r[o->a]));
    MECHC_TAPE_DO(CALL2, FN(tape_call_of_two)(o->c, r[o->a], r[o->b]));
    MECHC_TAPE_DO(LOOKUP, FN(tape_lookup)(code, o->c, r[o->a], r[o->b]));
#if R_EXTENDED /* masks in the gaps of loops choose alone */
#define MECHC_TAPE_MASK(condition) R((condition) ? 1.0 : 0.0)
#define MECHC_TAPE_HOLDS(x) ((x) != 0.0L)
    MECHC_TAPE_DO(AND, r[o->a] * r[o->b]);
    MECHC_TAPE_DO(NOT, 1.0L - r[o->a]);
#else
#define MECHC_TAPE_MASK(condition) R_FROM_BITS(R_MASK(condition))
#define MECHC_TAPE_HOLDS(x) R_BITS(x)
    MECHC_TAPE_DO(AND, R_FROM_BITS(R_BITS(r[o->a]) & R_BITS(r[o->b])));
    MECHC_TAPE_DO(NOT, R_FROM_BITS(~R_BITS(r[o->a])));
#endif
    MECHC_TAPE_DO(LESS, MECHC_TAPE_MASK(r[o->a] < r[o->b]));
    MECHC_TAPE_DO(LESS_EQUAL, MECHC_TAPE_MASK(r[o->a] <= r[o->b]));
    MECHC_TAPE_DO(EQUAL, MECHC_TAPE_MASK(r[o->a] == r[o->b]));
    MECHC_TAPE_DO(NOT_EQUAL, MECHC_TAPE_MASK(r[o->a] != r[o->b]));
    MECHC_TAPE_DO(SELECT, R_SELECT(MECHC_TAPE_HOLDS(r[o->a]), r[o->b], r[o->c]));
of_RETURN:
    return r[o->a];
of_END:
    return R(0.0);
#undef MECHC_TAPE_MASK
#undef MECHC_TAPE_HOLDS
#undef MECHC_TAPE_DO_ALL
#undef MECHC_TAPE_DO
#undef MECHC_TAPE_NEXT
}
#endif
