/* Small dense linear algebra of the constraint rows and of the mass matrix; generic over `real`.
 *
 * The rows of the constraint Jacobian are orthogonalised in a diagonal metric, sum_k w_k a_k b_k
 * with w_k near 1 / M_kk, so that speeds of different units may be added and no factor of M is
 * needed to stay on the constraints.  Gram-Schmidt with the largest remaining row first; a row
 * that lost more than nine tenths of its length is made orthogonal again (Giraud et al. 2005: twice
 * is enough).  No normal equations are formed, so singular values are not squared.  Only as many
 * rows count as are independent at generic configurations: what remains of the others is closure
 * error, and they are omitted.  So is a row that is negligible against the largest.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_LINEAR_VECTOR : !defined MECHC_LINEAR_SCALAR
#if R_VECTOR
#define MECHC_LINEAR_VECTOR
#else
#define MECHC_LINEAR_SCALAR
#endif
#include "dynamics/sizes.h"
#include "dynamics/thresholds.h"
#include "simd/rough.h"

/* Squared loss of length at which a row is made orthogonal again. */
#define MECHC_LOSS 1e-2

typedef struct {
    real lower[MECHC_NU_MAX * MECHC_NU_MAX]; /* strictly lower part of L, row by row */
    real inverse[MECHC_NU_MAX];              /* 1 / D */
} FN(mass_factors);

/* M = L D L^T, n by n; returns the first row whose pivot is not positive, or -1. */
MECHC_INLINE int FN(factor_mass)(const real *mass, int n, FN(mass_factors) *f)
{
    real scaled[MECHC_NU_MAX];
    int bad = -1;
    for (int j = 0; j < n; j++) {
        real pivot = mass[j * n + j];
        for (int k = 0; k < j; k++) {
            scaled[k] = f->lower[j * n + k];
            f->lower[j * n + k] *= f->inverse[k];
            R_SUB(pivot, scaled[k], f->lower[j * n + k]);
        }
        if (bad < 0 && R_ANY(~R_MASK(pivot > MECHC_NO_PIVOT * mass[j * n + j]))) bad = j;
        f->inverse[j] = 1.0 / pivot;
        for (int i = j + 1; i < n; i++) {
            real entry = mass[i * n + j];
            for (int k = 0; k < j; k++)
                R_SUB(entry, f->lower[i * n + k], f->lower[j * n + k]);
            f->lower[i * n + j] = entry;
        }
    }
    return bad;
}

/* x <- L^-1 x */
MECHC_INLINE void FN(forward)(const FN(mass_factors) *f, int n, real *x)
{
    for (int i = 1; i < n; i++)
        for (int k = 0; k < i; k++) R_SUB(x[i], f->lower[i * n + k], x[k]);
}

/* x <- L^-T D^-1 x */
MECHC_INLINE void FN(backward)(const FN(mass_factors) *f, int n, real *x)
{
    for (int i = n - 1; i >= 0; i--) {
        x[i] *= f->inverse[i];
        for (int k = i + 1; k < n; k++) R_SUB(x[i], f->lower[k * n + i], x[k]);
    }
}

#if MECHC_NC_MAX > 0
/* Row i of those given became  scale[0] ... scale[i-1] row - sum_k mix[i][k] scale[k+1] ...
 * scale[i-1] rows[k]: scaling by near-one numbers instead of dividing by a norm keeps the
 * divisions out of the chain of dependent operations. */
typedef struct {
#if MECHC_WALKED
    FN(mass_factors) metric;
#endif
    real weight[MECHC_NU_MAX];
    real rows[MECHC_NC_MAX * MECHC_NU_MAX]; /* orthogonal */
    real mix[MECHC_NC_MAX * MECHC_NC_MAX];
    real scale[MECHC_NC_MAX];
    real norm[MECHC_NC_MAX];         /* squared */
    real inverse_norm[MECHC_NC_MAX]; /* 0 where redundant */
    rmask swapped[MECHC_NC_MAX * MECHC_NC_MAX];
    real rank; /* rows that count */
} FN(factors);

MECHC_INLINE real FN(dot)(const real *a, const real *b)
{
    real sum = a[0] * b[0];
    for (int k = 1; k < MECHC_NU; k++) R_ADD(sum, a[k], b[k]);
    return sum;
}

MECHC_INLINE real FN(larger)(real a, real b) { return R_SELECT(R_MASK(a > b), a, b); }

MECHC_INLINE real FN(inner)(const FN(factors) *f, const real *a, const real *b)
{
    real sum = a[0] * (b[0] * f->weight[0]);
    for (int k = 1; k < MECHC_NU; k++) R_ADD(sum, a[k], b[k] * f->weight[k]);
    return sum;
}

MECHC_INLINE void FN(swap)(rmask mask, real *a, real *b)
{
    const real kept = *a;
    *a = R_SELECT(mask, *b, kept);
    *b = R_SELECT(mask, kept, *b);
}

/* Move the largest remaining row to place i. */
MECHC_INLINE void FN(pivot)(FN(factors) *f, int i, int rows, real *start)
{
    for (int j = i + 1; j < rows; j++) {
        const rmask larger = R_MASK(f->norm[j] > f->norm[i]);
        f->swapped[i * MECHC_NC + j] = larger;
        FN(swap)(larger, &f->norm[i], &f->norm[j]);
        FN(swap)(larger, &start[i], &start[j]);
        for (int k = 0; k < MECHC_NU; k++)
            FN(swap)(larger, &f->rows[i * MECHC_NU + k], &f->rows[j * MECHC_NU + k]);
        for (int k = 0; k < i; k++)
            FN(swap)(larger, &f->mix[i * MECHC_NC + k], &f->mix[j * MECHC_NC + k]);
    }
}

/* Orthogonalise row i once more against the rows before it, of which rounding left a part. */
MECHC_INLINE void FN(sweep_again)(FN(factors) *f, int i, rmask lost)
{
    real *row = f->rows + i * MECHC_NU, follow = R(1.0);
    for (int k = i - 1; k >= 0; k--) {
        const real *before = f->rows + k * MECHC_NU;
        const real part =
            R_SELECT(lost, FN(inner)(f, row, before) * f->inverse_norm[k], R(0.0));
        for (int n = 0; n < MECHC_NU; n++) R_SUB(row[n], part, before[n]);
        f->mix[i * MECHC_NC + k] += part / R_SELECT(lost, follow, R(1.0)); /* 0 beyond rows of zeros */
        follow *= f->scale[k];
    }
    f->norm[i] = R_SELECT(lost, FN(inner)(f, row, row), f->norm[i]);
}

/* Orthogonalise row j against row i. */
MECHC_INLINE void FN(sweep)(FN(factors) *f, int i, int j, real inverse)
{
    const real *row = f->rows + i * MECHC_NU;
    real *other = f->rows + j * MECHC_NU;
    const real part = FN(inner)(f, row, other) * inverse;
    for (int k = 0; k < MECHC_NU; k++) other[k] = R_FMS(f->scale[i], other[k], part * row[k]);
    f->mix[j * MECHC_NC + i] = part;
    f->norm[j] = FN(inner)(f, other, other);
}

/* Orthogonalise the first `rows` of f->rows in the metric of f->weight; `rank` of them count. */
MECHC_INLINE void FN(orthogonalise)(FN(factors) *f, int rows, real rank)
{
    real start[MECHC_NC_MAX];
    f->rank = rank;
    for (int i = 0; i < rows; i++)
        start[i] = f->norm[i] = FN(inner)(f, f->rows + i * MECHC_NU, f->rows + i * MECHC_NU);
    for (int i = 0; i < rows; i++) {
        FN(pivot)(f, i, rows, start);
        const rmask lost = R_MASK(f->norm[i] < MECHC_LOSS * start[i]);
        if (i && __builtin_expect(R_ANY(lost), 0)) FN(sweep_again)(f, i, lost);
        const rmask kept = R_MASK(f->norm[i] > MECHC_REDUNDANT * f->norm[0])
                         & R_MASK(rank > (double)i);
        f->inverse_norm[i] = R_SELECT(kept, 1.0 / f->norm[i], R(0.0));
        /* a product of many numbers near 1 would leave the range */
        const real inverse = MECHC_NC > 8 ? f->inverse_norm[i] : FN(rough_inverse)(f->norm[i]);
        f->scale[i] = MECHC_NC > 8 ? R(1.0) : f->norm[i] * inverse;
        for (int j = i + 1; j < rows; j++) {
            FN(sweep)(f, i, j, inverse);
            start[j] *= f->scale[i] * f->scale[i];
        }
    }
}

/* Of the largest M_kk: in a metric where a speed has less, rows look dependent that are not. */
#define MECHC_LIGHT 1e-3

/* The mass M_kk that each speed moves, or a share of the largest: as a link's mass goes to zero, the rows'
 * lengths go to limits, as the motion does.  Lengths compare masses with moments of inertia. */
MECHC_INLINE void FN(moved_masses)(const real *mass, real length, real *moved)
{
    for (int k = 0; k < MECHC_NU; k++) moved[k] = mass[k * MECHC_NU + k];
#if MECHC_NH_MAX > 0 && !MECHC_WALKED
    real most = R(0.0);
    const real square = length * length;
    for (int k = 0; k < MECHC_NU; k++)
        most = FN(larger)(MECHC_SLIDES_AT(MECHC_NQ + k) ? moved[k] * square : moved[k], most);
    const real least = MECHC_LIGHT * most, sliding = least / square;
    for (int k = 0; k < MECHC_NU; k++) {
        const real light = MECHC_SLIDES_AT(MECHC_NQ + k) ? sliding : least;
        moved[k] = R_SELECT(R_MASK(moved[k] < light), light, moved[k]);
    }
#else
    (void)length;
#endif
}

/* About the inverses of these, within an eighth. */
MECHC_INLINE void FN(speed_weights)(const real *mass, real length, real *weight)
{
    FN(moved_masses)(mass, length, weight);
    for (int k = 0; k < MECHC_NU; k++) weight[k] = FN(rough_inverse)(weight[k]);
}

/* Factor the mass matrix, and the rows in the metric of it, as L^-1 J^T with D^-1 for weights. */
MECHC_INLINE void FN(factor_in_mass_metric)(const real *jacobian, const real *mass, int rows, real rank,
                                            FN(mass_factors) *metric, FN(factors) *f)
{
    FN(factor_mass)(mass, MECHC_NU, metric);
    for (int i = 0; i < MECHC_NU; i++) f->weight[i] = metric->inverse[i];
    for (int i = 0; i < rows * MECHC_NU; i++) f->rows[i] = jacobian[i];
    for (int i = 0; i < rows; i++) FN(forward)(metric, MECHC_NU, f->rows + i * MECHC_NU);
    FN(orthogonalise)(f, rows, rank);
}

#if MECHC_WALKED
/* Factor the rows of a tree in the metric of the mass matrix itself: along a chain its diagonal says
 * little about how the speeds act together. */
MECHC_ONCE void FN(factor_rows)(const real *jacobian, const real *mass, real length, int rows, real rank,
                                FN(factors) *f)
{
    (void)length;
    FN(factor_in_mass_metric)(jacobian, mass, rows, rank, &f->metric, f);
}

/* Transform from that metric to speeds. */
MECHC_INLINE void FN(to_speeds)(const FN(factors) *f, real *x)
{
    FN(backward)(&f->metric, MECHC_NU, x);
}
#else
/* Factor the first `rows` rows of the Jacobian in the metric of the mass matrix's diagonal. */
MECHC_INLINE void FN(factor_rows)(const real *jacobian, const real *mass, real length, int rows,
                                  real rank, FN(factors) *f)
{
    FN(speed_weights)(mass, length, f->weight);
    for (int i = 0; i < rows * MECHC_NU; i++) f->rows[i] = jacobian[i];
    FN(orthogonalise)(f, rows, rank);
}

/* Transform from that metric to speeds. */
MECHC_INLINE void FN(to_speeds)(const FN(factors) *f, real *x)
{
    for (int k = 0; k < MECHC_NU; k++) x[k] *= f->weight[k];
}
#endif

/* Transform values of the given rows to those of the orthogonal rows. */
MECHC_INLINE void FN(values_of_rows)(const FN(factors) *f, int rows, const real *values,
                                     real *wanted)
{
    for (int i = 0; i < rows; i++) wanted[i] = values[i];
    for (int i = 0; i < rows; i++) {
        for (int j = i + 1; j < rows; j++)
            FN(swap)(f->swapped[i * MECHC_NC + j], &wanted[i], &wanted[j]);
        for (int k = 0; k < i; k++)
            wanted[i] = R_FMS(f->scale[k], wanted[i], f->mix[i * MECHC_NC + k] * wanted[k]);
    }
}

/* The least x, in the metric of the weights, on which the rows take the values given. */
MECHC_INLINE void FN(least_change)(const FN(factors) *f, int rows, const real *values, real *x)
{
    real wanted[MECHC_NC_MAX];
    FN(values_of_rows)(f, rows, values, wanted);
    for (int k = 0; k < MECHC_NU; k++) x[k] = R(0.0);
    for (int i = 0; i < rows; i++) {
        const real part = wanted[i] * f->inverse_norm[i];
        for (int k = 0; k < MECHC_NU; k++) R_ADD(x[k], part, f->rows[i * MECHC_NU + k]);
    }
    FN(to_speeds)(f, x);
}

/* The multipliers of the given rows, from the multiples of the orthogonal rows. */
MECHC_INLINE void FN(multipliers)(const FN(factors) *f, const real *multiples, real *lambda)
{
    for (int i = 0; i < MECHC_NC; i++)
        lambda[i] = R_SELECT(R_MASK(f->inverse_norm[i] > 0.0), multiples[i], R(0.0));
    for (int i = MECHC_NC - 1; i >= 0; i--)
        for (int k = i - 1; k >= 0; k--) {
            R_SUB(lambda[k], f->mix[i * MECHC_NC + k], lambda[i]);
            lambda[i] *= f->scale[k];
        }
    for (int i = MECHC_NC - 1; i >= 0; i--)
        for (int j = MECHC_NC - 1; j > i; j--)
            FN(swap)(f->swapped[i * MECHC_NC + j], &lambda[i], &lambda[j]);
}

/* The lanes in which some row is redundant. */
MECHC_INLINE rmask FN(redundant)(const FN(factors) *f)
{
    rmask redundant = R_MASK(f->inverse_norm[0] == 0.0);
    for (int i = 1; i < MECHC_NC; i++) redundant |= R_MASK(f->inverse_norm[i] == 0.0);
    return redundant;
}

/* The multipliers of least norm where rows are redundant.
 *
 * Redundant rows leave the multipliers open along the null space of J^T.  Of all that give the same
 * reactions the least ones lie in the column space of J: the multipliers found are projected onto
 * an orthonormal basis of it (columns made orthogonal twice, the largest remaining one first). */

/* Move the largest remaining column to place i; returns its squared length. */
MECHC_INLINE real FN(pivot_column)(real *columns, int i)
{
    real most = R(0.0);
    for (int j = i; j < MECHC_NU; j++) {
        real square = R(0.0);
        for (int r = 0; r < MECHC_NC; r++)
            R_ADD(square, columns[j * MECHC_NC + r], columns[j * MECHC_NC + r]);
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
    for (int r = 0; r < MECHC_NC; r++) R_ADD(part, column[r], other[r]);
    for (int r = 0; r < MECHC_NC; r++) R_SUB(other[r], part * inverse, column[r]);
}

/* Project the multipliers in the lanes where rows of the factors are redundant; weights scale the columns. */
MECHC_ONCE __attribute__((cold)) void FN(least_multipliers)(const real *jacobian,
                                                            const FN(factors) *f, real *lambda)
{
    real columns[MECHC_NU_MAX * MECHC_NC_MAX], inverse[MECHC_NC_MAX], left[MECHC_NC_MAX], rank = R(0.0);
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
        for (int r = 0; r < MECHC_NC; r++) R_ADD(square, column[r], column[r]);
        inverse[i] = R_SELECT(R_MASK(rank > (double)i) & R_MASK(most > 0.0), 1.0 / square, R(0.0));
        for (int j = i + 1; j < MECHC_NU; j++)
            FN(take_column)(column, inverse[i], columns + j * MECHC_NC);
        FN(take_column)(column, inverse[i], left);
    }
    for (int i = 0; i < MECHC_NC; i++)
        lambda[i] = R_SELECT(redundant, lambda[i] - left[i], lambda[i]);
}

/* The x nearest to M^-1 forcing, in the metric of M, on which the rows take the values given; the
 * multipliers where lambda is not NULL. */
MECHC_INLINE void FN(solve_in_metric)(const FN(factors) *f, const FN(mass_factors) *metric,
                                      const real *jacobian, const real *forcing, const real *values,
                                      real *x, real *lambda)
{
    real wanted[MECHC_NC_MAX], multiples[MECHC_NC_MAX];
    for (int k = 0; k < MECHC_NU; k++) x[k] = forcing[k];
    FN(forward)(metric, MECHC_NU, x);
    FN(values_of_rows)(f, MECHC_NC, values, wanted);
    for (int i = 0; i < MECHC_NC; i++) {
        const real *row = f->rows + i * MECHC_NU;
        const real part = (wanted[i] - FN(inner)(f, row, x)) * f->inverse_norm[i];
        for (int k = 0; k < MECHC_NU; k++) R_ADD(x[k], part, row[k]);
        multiples[i] = -part;
    }
    FN(backward)(metric, MECHC_NU, x);
    if (!lambda) return;
    FN(multipliers)(f, multiples, lambda);
    if (R_ANY(FN(redundant)(f))) FN(least_multipliers)(jacobian, f, lambda);
}

/* The lanes in which a row that counts is redundant. */
MECHC_INLINE rmask FN(lost_rank)(const FN(factors) *f)
{
    rmask lost = R_MASK(f->inverse_norm[0] == 0.0);
    for (int i = 1; i < MECHC_NC; i++)
        lost |= R_MASK(f->inverse_norm[i] == 0.0) & R_MASK(f->rank > (double)i);
    return lost;
}

/* Squared length of the shortest orthogonal row that counts over that of the longest, or over what
 * the longest has at ordinary configurations. */
MECHC_INLINE real FN(least_singular_squared)(const FN(factors) *f, real ordinary)
{
    real scale = R(1.0), least = f->norm[0];
    for (int i = 0; i < MECHC_NC - 1; i++) {
        const rmask counts = R_MASK(f->rank > (double)(i + 1));
        scale = R_SELECT(counts, scale * f->scale[i], scale);
        least = R_SELECT(counts, f->norm[i + 1], least);
    }
    return least / (FN(larger)(f->norm[0], ordinary) * (scale * scale));
}
#endif
#endif
