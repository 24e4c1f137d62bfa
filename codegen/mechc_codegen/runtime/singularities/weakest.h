/* The weakest of the configuration rows: the smallest singular value of their Jacobian, with its
 * two vectors, and whether that direction changed its sign between two configurations.
 */
#pragma once

#include "dynamics/scalar_stage.h"
#include "simd/scalar.h"
#include "simd/vector.h"

#if MECHC_NH_MAX > 0
/* Below this share of the largest singular value at generic configurations a row is redundant. */
#define MECHC_GENERIC 1e-7

/* Squared cosine between rows that rounding leaves, and before a sweep that is the last. */
#define MECHC_ORTHOGONAL 1e-32
#define MECHC_ALL_ORTHOGONAL 1e-28

/* The least share of the later singular value that u . J v must have to count, and the least cosine
 * between vectors before and after that are still the same. */
#define MECHC_SURE 0.3
#define MECHC_SAME_VECTOR 0.6

typedef struct {
    int rank, found; /* found: without those below MECHC_GENERIC */
    double ratio;    /* of the rank-th singular value to the largest */
    double largest;  /* here, or at ordinary configurations */
    double left[MECHC_NH_MAX], right[MECHC_NU_MAX];
    double basis[MECHC_NH_MAX * MECHC_NH_MAX]; /* left vectors, by falling singular value */
    double values[MECHC_NH_MAX];
#if MECHC_NH_MAX > 2
    double rows[MECHC_NH_MAX * MECHC_NU_MAX]; /* the rows in that basis: values times right vectors */
#endif
} mechc_weakest;

MECHC_STATIC double mechc_dot(const double *a, const double *b, int count)
{
    int i = 0;
    mechc_vector parts[MECHC_EIGHT] = {{0}};
    for (; i + 8 <= count; i += 8)
        for (int k = 0; k < MECHC_EIGHT; k++)
            MECHC_ADD(parts[k], mechc_take(a + i, k), mechc_take(b + i, k));
    double sum = i ? mechc_sum_of_parts(parts) : 0.0;
    for (; i < count; i++) sum = mechc_scalar_fused(a[i], b[i], sum);
    return sum;
}

/* Rows and the rotations that they took, filled up to whole vectors: short rows would be tails. */
#define MECHC_VECTORS(n) (((n) + MECHC_LANES - 1) / MECHC_LANES)

typedef struct {
    mechc_vector rows[MECHC_NH_MAX][MECHC_VECTORS(MECHC_NU_MAX)];
    mechc_vector basis[MECHC_NH_MAX][MECHC_VECTORS(MECHC_NH_MAX)];
} mechc_rotated;

/* (x, y) <- (c x - s y, s x + c y) */
MECHC_INLINE void mechc_rotate(mechc_vector *x, mechc_vector *y, int count, double c, double s)
{
    for (int i = 0; i < count; i++) {
        const mechc_vector turned = mechc_fused_less(mechc_spread(c), x[i], s * y[i]);
        y[i] = mechc_fused(mechc_spread(s), x[i], c * y[i]);
        x[i] = turned;
    }
}

/* Rotate two rows, and the basis, until orthogonal; their squared cosine before.  Where this is below
 * rounding they are left. */
MECHC_INLINE double mechc_rotate_rows(mechc_rotated *a, int i, int j)
{
    mechc_vector *x = a->rows[i], *y = a->rows[j];
    mechc_vector xx[MECHC_EIGHT] = {{0}}, yy[MECHC_EIGHT] = {{0}}, xy[MECHC_EIGHT] = {{0}};
    for (int k = 0; k < MECHC_VECTORS(MECHC_NU); k++) {
        MECHC_ADD(xx[k % MECHC_EIGHT], x[k], x[k]);
        MECHC_ADD(yy[k % MECHC_EIGHT], y[k], y[k]);
        MECHC_ADD(xy[k % MECHC_EIGHT], x[k], y[k]);
    }
    const double ii = mechc_sum_of_parts(xx), jj = mechc_sum_of_parts(yy);
    const double ij = mechc_sum_of_parts(xy);
    if (!(ij * ij > MECHC_ORTHOGONAL * ii * jj)) return 0.0;
    const double zeta = (jj - ii) / (2.0 * ij);
    const double tangent = copysign(1.0, zeta) / (fabs(zeta) + sqrt(1.0 + zeta * zeta));
    const double c = 1.0 / sqrt(1.0 + tangent * tangent), s = c * tangent;
    mechc_rotate(x, y, MECHC_VECTORS(MECHC_NU), c, s);
    mechc_rotate(a->basis[i], a->basis[j], MECHC_VECTORS(MECHC_NH), c, s);
    return ij * ij / (ii * jj);
}

/* Sweeps of rotations until all rows are orthogonal; rows by the basis given are overwritten. */
MECHC_STATIC void mechc_orthogonalise_rows(double *a, double *basis)
{
    mechc_rotated work;
    memset(&work, 0, sizeof work);
    for (int i = 0; i < MECHC_NH; i++) {
        memcpy(work.rows[i], a + i * MECHC_NU, MECHC_NU * sizeof *a);
        memcpy(work.basis[i], basis + i * MECHC_NH, MECHC_NH * sizeof *basis);
    }
    for (int sweep = 0; sweep < 30; sweep++) {
        double worst = 0.0;
        for (int i = 0; i < MECHC_NH; i++)
            for (int j = i + 1; j < MECHC_NH; j++)
                worst = mechc_max(worst, mechc_rotate_rows(&work, i, j));
        if (worst < MECHC_ALL_ORTHOGONAL) break;
    }
    for (int i = 0; i < MECHC_NH; i++) {
        memcpy(a + i * MECHC_NU, work.rows[i], MECHC_NU * sizeof *a);
        memcpy(basis + i * MECHC_NH, work.basis[i], MECHC_NH * sizeof *basis);
    }
}

MECHC_STATIC void mechc_exchange(double *a, double *b)
{
    const double kept = *a;
    *a = *b;
    *b = kept;
}

MECHC_STATIC void mechc_sort_rows(double *a, mechc_weakest *out)
{
    for (int i = 0; i < MECHC_NH; i++) {
        int largest = i;
        for (int j = i + 1; j < MECHC_NH; j++)
            if (out->values[j] > out->values[largest]) largest = j;
        if (largest == i) continue;
        mechc_exchange(&out->values[i], &out->values[largest]);
        for (int k = 0; k < MECHC_NU; k++)
            mechc_exchange(&a[i * MECHC_NU + k], &a[largest * MECHC_NU + k]);
        for (int k = 0; k < MECHC_NH; k++)
            mechc_exchange(&out->basis[i * MECHC_NH + k], &out->basis[largest * MECHC_NH + k]);
    }
}

/* Rows by speeds that are weighted by the mass each moves; in trees, by the mass matrix. */
MECHC_STATIC void mechc_weigh_rows(const double *jacobian, const double *mass, double length, double *a)
{
#if MECHC_WALKED
    (void)length;
    mechc_scalar_mass_factors metric;
    mechc_scalar_factor_mass(mass, MECHC_NU, &metric);
    memcpy(a, jacobian, MECHC_NH * MECHC_NU * sizeof *a);
    for (int i = 0; i < MECHC_NH; i++) {
        mechc_scalar_forward(&metric, MECHC_NU, a + i * MECHC_NU);
        for (int j = 0; j < MECHC_NU; j++) a[i * MECHC_NU + j] *= sqrt(metric.inverse[j]);
    }
#else
    double moved[MECHC_NU_MAX];
    mechc_scalar_moved_masses(mass, length, moved);
    for (int i = 0; i < MECHC_NH; i++)
        for (int j = 0; j < MECHC_NU; j++)
            a[i * MECHC_NU + j] = jacobian[i * MECHC_NU + j] / sqrt(moved[j]);
#endif
}

/* Singular values of weighted rows, which are overwritten, by one-sided Jacobi rotations.  The
 * smallest is counted up to the rank given, or up to the rank found where that is 0.  `ordinary`:
 * squared length of the longest row, see ordinary_rows.h. */
MECHC_ONCE void mechc_decompose(double *a, double ordinary, int rank, mechc_weakest *out)
{
    memset(out, 0, sizeof *out);
    for (int i = 0; i < MECHC_NH; i++) out->basis[i * MECHC_NH + i] = 1.0;
    mechc_orthogonalise_rows(a, out->basis);
    for (int i = 0; i < MECHC_NH; i++) {
        double square = 0.0;
        for (int j = 0; j < MECHC_NU; j++) square += a[i * MECHC_NU + j] * a[i * MECHC_NU + j];
        out->values[i] = sqrt(square);
    }
    mechc_sort_rows(a, out);
    out->largest = mechc_max(out->values[0], sqrt(ordinary));
    const double radian = mechc_max(out->values[0], sqrt(ordinary) / MECHC_OF_A_RADIAN);
    out->found = 0;
    while (out->found < MECHC_NH && out->values[out->found] > MECHC_GENERIC * radian)
        out->found++;
    out->rank = rank > 0 ? rank : out->found > 0 ? out->found : 1;
    const int last = out->rank - 1;
    out->ratio = out->largest > 0.0 ? out->values[last] / out->largest : 0.0;
    memcpy(out->left, out->basis + last * MECHC_NH, MECHC_NH * sizeof *out->left);
    for (int j = 0; j < MECHC_NU; j++)
        out->right[j] = a[last * MECHC_NU + j] / mechc_max(out->values[last], DBL_MIN);
#if MECHC_NH_MAX > 2
    memcpy(out->rows, a, MECHC_NH * MECHC_NU * sizeof *a);
#endif
}

/* The weakest direction of rows by speeds. */
MECHC_STATIC void mechc_find_weakest(const double *jacobian, const double *mass, double length,
                                     double ordinary, int rank, mechc_weakest *out)
{
    double a[MECHC_NH_MAX * MECHC_NU_MAX];
    mechc_weigh_rows(jacobian, mass, length, a);
    mechc_decompose(a, ordinary, rank, out);
}

MECHC_STATIC void mechc_weakest_at(double t, const double *q, const mechc_scalar_given *given,
                                   int rank, mechc_weakest *out)
{
    mechc_scalar_place place;
    mechc_scalar_locate_all(t, q, given, &place);
    mechc_find_weakest(place.jacobian, place.mass, place.length, place.ordinary_length, rank, out);
}

/* The weakest direction at a configuration whose rows may not have been computed explicitly. */
MECHC_ONCE void mechc_weakest_of(const mechc_scalar_place *place, int rank, mechc_weakest *out)
{
#if MECHC_WALKED
    double jacobian[MECHC_NC_MAX * MECHC_NU_MAX], mass[MECHC_NU_MAX * MECHC_NU_MAX];
    mechc_scalar_cut_rows(place->saved, jacobian);
    mechc_scalar_composite_mass(place->saved, mass);
    mechc_find_weakest(jacobian, mass, place->length, place->ordinary_length, rank, out);
#else
    mechc_find_weakest(place->jacobian, place->mass, place->length, place->ordinary_length, rank, out);
#endif
}

#if MECHC_NH_MAX > 2
/* Rows of several loops may change their signs together, and their vectors then mix.  So each weak
 * direction of the first configuration is followed by the rows of the second, u . J v; where some
 * signs changed and others did not, the loops have taken different branches. */
#define MECHC_ALIKE 1.6 /* times the smallest singular value */

/* u . J v of the rows after for the k-th vectors before */
MECHC_STATIC double mechc_followed(const mechc_weakest *before, const mechc_weakest *after, int k)
{
    const double *left = before->basis + k * MECHC_NH, *right = before->rows + k * MECHC_NU;
    double sum = 0.0;
    for (int i = 0; i < MECHC_NH; i++)
        sum += mechc_dot(left, after->basis + i * MECHC_NH, MECHC_NH)
             * mechc_dot(right, after->rows + i * MECHC_NU, MECHC_NU);
    return sum / mechc_max(before->values[k], DBL_MIN);
}

MECHC_STATIC int mechc_one_turned_over(const mechc_weakest *before, const mechc_weakest *after)
{
    int turned = 0, kept = 0;
    const int last = before->rank - 1;
    for (int k = last; k >= 0 && before->values[k] <= MECHC_ALIKE * before->values[last]; k--) {
        const double value = mechc_followed(before, after, k);
        if (fabs(value) < MECHC_SURE * after->values[k]) return -1;
        if (value < 0.0) turned++;
        else kept++;
    }
    return turned && kept ? -1 : turned > 0;
}
#endif

/* 1 where the signed smallest singular value, followed with its vectors, changed its sign between
 * two configurations; 0 where it did not; -1 where the vectors rotated too far to decide. */
MECHC_STATIC int mechc_turned_over(const mechc_weakest *before, const mechc_weakest *after)
{
#if MECHC_NH_MAX > 2
    if (MECHC_NH > 2) return mechc_one_turned_over(before, after);
#endif
    const double left = mechc_dot(before->left, after->left, MECHC_NH);
    const double right = mechc_dot(before->right, after->right, MECHC_NU);
    if (fabs(left) < MECHC_SAME_VECTOR || fabs(right) < MECHC_SAME_VECTOR) return -1;
    return left * right < 0.0;
}
#endif
