/* A state by itself, of which no run says how many rows count; generic over `real`.
 *
 * Rows that depend on each other all along a sheet of configurations are short by rounding there, and
 * beside a change point by the distance from it.  Doubles tell a row that is surely rounding; of others
 * that are short the state is asked what a run would be that starts there (singularities/generic_rank.h).
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_ALONE_VECTOR : !defined MECHC_ALONE_SCALAR
#if R_VECTOR
#define MECHC_ALONE_VECTOR
#else
#define MECHC_ALONE_SCALAR
#endif
#include "dynamics/stage.h"

#if MECHC_NC_MAX > 0
/* The lanes in which the shortest row is below MECHC_NO_ROW and may be rounding. */
MECHC_INLINE rmask FN(short_rows)(const FN(place) *place)
{
#if MECHC_ONE_FREEDOM
    return place->rows.redundant;
#elif MECHC_WALKED || MECHC_BLOCKS_CODE
    const FN(factors) *f = &place->rows.factors;
    if (!__builtin_expect(place->rows.together, 0)) return R_MASK(R(0.0) > R(0.0));
    return ~place->rows.apart & R_MASK(f->norm[MECHC_NC - 1] <= MECHC_NO_ROW * f->norm[0]);
#else
    const FN(factors) *f = &place->rows;
    return R_MASK(f->norm[MECHC_NC - 1] <= MECHC_NO_ROW * f->norm[0]);
#endif
}

/* The rows that count in the lanes asked for, at most `rank`; a lane that repeats the one before it has
 * its count. */
MECHC_INLINE real FN(rows_of_states)(real t, const real *q, const FN(given) *given, rmask asked,
                                     real rank)
{
    double times[RLANES], most[RLANES], state[2][MECHC_NQ_MAX], p[2][MECHC_AT_LEAST_ONE(MECHC_NP_MAX)];
    int64_t asks[RLANES];
    int last = -1, found = MECHC_NC;
    memcpy(times, &t, sizeof times);
    memcpy(most, &rank, sizeof most);
    memcpy(asks, &asked, sizeof asks);
    for (int lane = 0; lane < RLANES; lane++) {
        double *own = state[lane & 1], *values = p[lane & 1];
        if (!asks[lane]) continue;
        FN(take_lane)(q, MECHC_NQ, lane, own);
        FN(take_lane)(given->p, MECHC_NP, lane, values);
        const int repeated = last == lane - 1 && lane && times[lane] == times[last]
                          && given->inputs[lane] == given->inputs[last]
                          && memcmp(state[0], state[1], MECHC_NQ * sizeof(double)) == 0
                          && memcmp(p[0], p[1], MECHC_NP * sizeof(double)) == 0;
        if (!repeated) found = given->count(times[lane], own, values, given->inputs[lane]);
        last = lane;
        most[lane] = mechc_min(most[lane], found);
    }
    memcpy(&rank, most, sizeof rank);
    return rank;
}

/* Count the rows where some are short, and solve with so many. */
MECHC_RARE_ONCE void FN(count_rows)(real t, const real *q, const FN(given) *given, rmask few,
                                    FN(place) *place)
{
    FN(factors) rows;
    real rank = R(1.0), scale = R(1.0), shortest = R(1.0);
    FN(factor_rows)(place->jacobian, place->mass, place->length, MECHC_NC, place->rank, &rows);
    for (int i = 1; i < MECHC_NC; i++) {
        scale *= rows.scale[i - 1] * rows.scale[i - 1];
        const real share = rows.norm[i] / (rows.norm[0] * scale);
        const rmask counts = R_MASK(share > MECHC_SURELY) & R_MASK(place->rank > (double)i)
                           & R_MASK(rank == (double)i);
        rank = R_SELECT(counts, R((double)(i + 1)), rank);
        shortest = R_SELECT(counts, share, shortest);
    }
    const rmask unclear = few & R_MASK(shortest <= MECHC_NO_ROW);
    if (given->count && R_ANY(unclear)) rank = FN(rows_of_states)(t, q, given, unclear, rank);
    place->rank = R_SELECT(few, rank, place->rank);
    FN(prepare)(place, MECHC_REDUNDANT);
}
#endif

MECHC_INLINE void FN(locate_alone)(real t, const real *q, const FN(given) *given, FN(place) *place)
{
    FN(locate_near)(t, q, given, place, 0, 0, MECHC_NO_ROW);
#if MECHC_NC_MAX > 0
    const rmask few = FN(short_rows)(place);
    if (__builtin_expect(R_ANY(few), 0)) FN(count_rows)(t, q, given, few, place);
#endif
}

#if MECHC_NC_MAX > 0
MECHC_RARE_ONCE void FN(counted_rates)(real t, const real *y, const FN(given) *given, real *out)
{
    FN(place) place;
    FN(locate_alone)(t, y, given, &place);
    FN(coordinate_rates_of)(t, y, y + MECHC_NQ, given, out);
    FN(accelerate)(t, y, y + MECHC_NQ, given, &place, out + MECHC_NQ, 0);
}
#endif

/* State rates at a state by itself, without projection.  Rows are counted on a place of its own: one
 * whose address is passed on would be kept in memory on the usual path too. */
MECHC_INLINE void FN(rates)(real t, const real *y, const FN(given) *given, real *out)
{
    FN(place) place;
    FN(locate_near)(t, y, given, &place, 0, 0, MECHC_NO_ROW);
#if MECHC_NC_MAX > 0
    if (__builtin_expect(R_ANY(FN(short_rows)(&place)), 0)) {
        FN(counted_rates)(t, y, given, out);
        return;
    }
#endif
    FN(coordinate_rates_of)(t, y, y + MECHC_NQ, given, out);
    FN(accelerate)(t, y, y + MECHC_NQ, given, &place, out + MECHC_NQ, 0);
}
#endif
