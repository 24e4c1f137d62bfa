/* Small dense linear algebra in the metric of the mass matrix; generic over `real`.
 *
 * With M = L D L^T, a row a of the constraint Jacobian becomes w = a L^-T, and two rows meet in
 * the inner product sum_k w_k v_k / D_k, which is a M^-1 b^T.  The rows are orthogonalised by
 * Gram-Schmidt with the largest remaining row first and every row swept twice (Giraud et al.
 * 2005: twice is enough); no normal equations are formed, so singular values are not squared.
 * A row that vanishes against the largest is redundant here and is left out.
 */

/* Squared ratio of pivots below which a row is rounding: (16 eps)^2. */
#define MECHC_REDUNDANT 1.3e-29

typedef struct {
    real lower[MECHC_NU * MECHC_NU]; /* strictly lower part of L, row by row */
    real inverse[MECHC_NU];          /* 1 / D */
#if MECHC_NC > 0
    real rows[MECHC_NC * MECHC_NU];  /* orthogonalised */
    real mix[MECHC_NC * MECHC_NC];   /* row i held mix[i][k] times row k, k < i */
    real norm[MECHC_NC];             /* squared */
    real inverse_norm[MECHC_NC];     /* 0 where redundant */
    rmask swapped[MECHC_NC * MECHC_NC];
#endif
} FN(factors);

/* M = L D L^T; returns the first speed whose pivot is not positive, or -1. */
MECHC_INLINE int FN(factor_mass)(const real *mass, FN(factors) *f)
{
    real scaled[MECHC_NU];
    int bad = -1;
    for (int j = 0; j < MECHC_NU; j++) {
        real pivot = mass[j * MECHC_NU + j];
        for (int k = 0; k < j; k++) {
            scaled[k] = f->lower[j * MECHC_NU + k];
            f->lower[j * MECHC_NU + k] *= f->inverse[k];
            pivot -= scaled[k] * f->lower[j * MECHC_NU + k];
        }
        if (bad < 0 && R_ANY(~R_MASK(pivot > 4e-16 * mass[j * MECHC_NU + j]))) bad = j;
        f->inverse[j] = 1.0 / pivot;
        for (int i = j + 1; i < MECHC_NU; i++) {
            real entry = mass[i * MECHC_NU + j];
            for (int k = 0; k < j; k++)
                entry -= f->lower[i * MECHC_NU + k] * f->lower[j * MECHC_NU + k];
            f->lower[i * MECHC_NU + j] = entry;
        }
    }
    return bad;
}

/* x <- L^-1 x */
MECHC_INLINE void FN(forward)(const FN(factors) *f, real *x)
{
    for (int i = 1; i < MECHC_NU; i++)
        for (int k = 0; k < i; k++) x[i] -= f->lower[i * MECHC_NU + k] * x[k];
}

/* x <- L^-T D^-1 x */
MECHC_INLINE void FN(backward)(const FN(factors) *f, real *x)
{
    for (int i = MECHC_NU - 1; i >= 0; i--) {
        x[i] *= f->inverse[i];
        for (int k = i + 1; k < MECHC_NU; k++) x[i] -= f->lower[k * MECHC_NU + i] * x[k];
    }
}

#if MECHC_NC > 0
MECHC_INLINE real FN(inner)(const FN(factors) *f, const real *a, const real *b)
{
    real sum = a[0] * b[0] * f->inverse[0];
    for (int k = 1; k < MECHC_NU; k++) sum += a[k] * b[k] * f->inverse[k];
    return sum;
}

MECHC_INLINE void FN(swap)(rmask mask, real *a, real *b)
{
    const real kept = *a;
    *a = R_SELECT(mask, *b, kept);
    *b = R_SELECT(mask, kept, *b);
}

/* Bring the largest remaining row to place i. */
MECHC_INLINE void FN(pivot)(FN(factors) *f, int i, int rows)
{
    for (int j = i + 1; j < rows; j++) {
        const rmask larger = R_MASK(f->norm[j] > f->norm[i]);
        f->swapped[i * MECHC_NC + j] = larger;
        FN(swap)(larger, &f->norm[i], &f->norm[j]);
        for (int k = 0; k < MECHC_NU; k++)
            FN(swap)(larger, &f->rows[i * MECHC_NU + k], &f->rows[j * MECHC_NU + k]);
        for (int k = 0; k < i; k++)
            FN(swap)(larger, &f->mix[i * MECHC_NC + k], &f->mix[j * MECHC_NC + k]);
    }
}

/* Orthogonalise the first `rows` rows of the Jacobian; the mass matrix is factored already. */
MECHC_INLINE void FN(factor_rows)(const real *jacobian, int rows, FN(factors) *f)
{
    for (int i = 0; i < rows * MECHC_NU; i++) f->rows[i] = jacobian[i];
    for (int i = 0; i < rows; i++) {
        FN(forward)(f, f->rows + i * MECHC_NU);
        f->norm[i] = FN(inner)(f, f->rows + i * MECHC_NU, f->rows + i * MECHC_NU);
    }
    for (int i = 0; i < rows; i++) {
        FN(pivot)(f, i, rows);
        real *first = f->rows + i * MECHC_NU;
        const rmask kept = R_MASK(f->norm[i] > MECHC_REDUNDANT * f->norm[0]);
        f->inverse_norm[i] = R_SELECT(kept, 1.0 / f->norm[i], R(0.0));
        for (int j = i + 1; j < rows; j++) {
            real *other = f->rows + j * MECHC_NU;
            real held = R(0.0);
            for (int sweep = 0; sweep < 2; sweep++) {
                const real part = FN(inner)(f, other, first) * f->inverse_norm[i];
                for (int k = 0; k < MECHC_NU; k++) other[k] -= part * first[k];
                held += part;
            }
            f->mix[j * MECHC_NC + i] = held;
            f->norm[j] = FN(inner)(f, other, other);
        }
    }
}

/* Move g (in the metric of L) the least so that its rows take the values given.
 * step[i], when asked for, is what was added of orthogonal row i. */
MECHC_INLINE void FN(constrain)(const FN(factors) *f, int rows, const real *values, real *g,
                                real *step)
{
    real wanted[MECHC_NC];
    for (int i = 0; i < rows; i++) wanted[i] = values[i];
    for (int i = 0; i < rows; i++) {
        for (int j = i + 1; j < rows; j++)
            FN(swap)(f->swapped[i * MECHC_NC + j], &wanted[i], &wanted[j]);
        for (int k = 0; k < i; k++) wanted[i] -= f->mix[i * MECHC_NC + k] * wanted[k];
    }
    for (int i = 0; i < rows; i++) {
        const real *row = f->rows + i * MECHC_NU;
        const real part = (wanted[i] - FN(inner)(f, row, g)) * f->inverse_norm[i];
        for (int k = 0; k < MECHC_NU; k++) g[k] += part * row[k];
        if (step) step[i] = part;
    }
}

/* Multipliers of the rows as given, from the steps along the orthogonal rows. */
MECHC_INLINE void FN(multipliers)(const FN(factors) *f, const real *step, real *lambda)
{
    for (int i = MECHC_NC - 1; i >= 0; i--) {
        lambda[i] = R_SELECT(R_MASK(f->inverse_norm[i] > 0.0), -step[i], R(0.0));
        for (int j = i + 1; j < MECHC_NC; j++) lambda[i] -= f->mix[j * MECHC_NC + i] * lambda[j];
    }
    for (int i = MECHC_NC - 1; i >= 0; i--)
        for (int j = MECHC_NC - 1; j > i; j--)
            FN(swap)(f->swapped[i * MECHC_NC + j], &lambda[i], &lambda[j]);
}

/* Ratio of the smallest pivot to the largest: 0 where the rows are dependent. */
MECHC_INLINE real FN(least_singular)(const FN(factors) *f)
{
    return R_SQRT(f->norm[MECHC_NC - 1] / f->norm[0]);
}
#endif
