/* The multipliers of least norm where rows are redundant; generic over `real`.
 *
 * Redundant rows leave the multipliers open along the null space of J^T.  Of all that give the same
 * reactions the least ones lie in the column space of J: the multipliers found are projected onto
 * an orthonormal basis of it (columns made orthogonal twice, the largest remaining one first).
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_LEAST_MULTIPLIERS_VECTOR : !defined MECHC_LEAST_MULTIPLIERS_SCALAR
#if R_VECTOR
#define MECHC_LEAST_MULTIPLIERS_VECTOR
#else
#define MECHC_LEAST_MULTIPLIERS_SCALAR
#endif
#include "dynamics/linear.h"

#if MECHC_NC > 0

/* Move the largest remaining column to place i; returns its squared length. */
MECHC_INLINE real FN(pivot_column)(real *columns, int i)
{
    real most = R(0.0);
    for (int j = i; j < MECHC_NU; j++) {
        real square = R(0.0);
        for (int r = 0; r < MECHC_NC; r++)
            square += columns[j * MECHC_NC + r] * columns[j * MECHC_NC + r];
        const rmask larger = R_MASK(square > most);
        most = R_SELECT(larger, square, most);
        for (int r = 0; j > i && r < MECHC_NC; r++)
            FN(swap)(larger, &columns[i * MECHC_NC + r], &columns[j * MECHC_NC + r]);
    }
    return most;
}

/* other <- other - (column . other / square) column */
MECHC_INLINE void FN(take_column)(const real *column, real inverse, real *other)
{
    real part = R(0.0);
    for (int r = 0; r < MECHC_NC; r++) part += column[r] * other[r];
    for (int r = 0; r < MECHC_NC; r++) other[r] -= part * inverse * column[r];
}

/* Project the multipliers in the lanes where rows of the factors are redundant; weights scale the columns. */
MECHC_ONCE __attribute__((cold)) void FN(least_multipliers)(const real *jacobian,
                                                            const FN(factors) *f, real *lambda)
{
    real columns[MECHC_NU * MECHC_NC], inverse[MECHC_NC], left[MECHC_NC], rank = R(0.0);
    const rmask redundant = FN(redundant)(f);
    for (int i = 0; i < MECHC_NC; i++) {
        left[i] = lambda[i];
        rank += R_SELECT(R_MASK(f->inverse_norm[i] > 0.0), R(1.0), R(0.0));
        for (int k = 0; k < MECHC_NU; k++)
            columns[k * MECHC_NC + i] = jacobian[i * MECHC_NU + k] * R_SQRT(f->weight[k]);
    }
    for (int i = 0; i < MECHC_NC && i < MECHC_NU; i++) {
        real *column = columns + i * MECHC_NC, square = R(0.0);
        const real most = FN(pivot_column)(columns, i);
        for (int j = 0; j < i; j++) FN(take_column)(columns + j * MECHC_NC, inverse[j], column);
        for (int r = 0; r < MECHC_NC; r++) square += column[r] * column[r];
        inverse[i] = R_SELECT(R_MASK(rank > (double)i) & R_MASK(most > 0.0), 1.0 / square, R(0.0));
        for (int j = i + 1; j < MECHC_NU; j++)
            FN(take_column)(column, inverse[i], columns + j * MECHC_NC);
        FN(take_column)(column, inverse[i], left);
    }
    for (int i = 0; i < MECHC_NC; i++)
        lambda[i] = R_SELECT(redundant, lambda[i] - left[i], lambda[i]);
}
#endif
#endif
