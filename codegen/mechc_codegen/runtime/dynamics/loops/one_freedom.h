/* Mechanisms with one degree of freedom and up to three speeds, in closed form.
 *
 * Generic over `real`.
 * The rows of J leave one direction n, in three dimensions their cross product.  With m = M n the
 * only x on which the rows take the values v and for which m . x = w is
 *     x = (C(v, m) + w n) / (m . n),   C(v, m) = (v_0 J_1 - v_1 J_0) x m  in three dimensions.
 * Accelerations have w = n . F; the least change in the metric of the mass matrix has w = 0.  There
 * is one division and no choice of rows or of speeds to go wrong; n is rounded like J itself, by
 * eps over the conditioning, and the error that this makes is a reaction, M^-1 J^T, not motion.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_ONE_FREEDOM_VECTOR : !defined MECHC_ONE_FREEDOM_SCALAR
#if R_VECTOR
#define MECHC_ONE_FREEDOM_VECTOR
#else
#define MECHC_ONE_FREEDOM_SCALAR
#endif
#include "dynamics/linear.h"

#ifndef MECHC_ONE_FREEDOM
#define MECHC_ONE_FREEDOM \
    (!MECHC_WALKED && MECHC_NC > 0 && MECHC_NU == MECHC_NC + 1 && MECHC_NU <= 3)
#endif

#if MECHC_ONE_FREEDOM
typedef struct {
    real jacobian[MECHC_NC_MAX * MECHC_NU_MAX];
    real direction[MECHC_NU_MAX], momentum[MECHC_NU_MAX];
    real inverse;   /* 1 / (m . n) */
    real longest;   /* squared length of the longest row, speeds weighted by the mass each moves */
    real rank;      /* rows that count */
    real length;    /* see ordinary_rows.h */
    rmask redundant;
} FN(freedom);

MECHC_INLINE void FN(cross)(const real *a, const real *b, real *out)
{
    out[0] = R_FMS(a[1], b[2], a[2] * b[1]);
    out[1] = R_FMS(a[2], b[0], a[0] * b[2]);
    out[2] = R_FMS(a[0], b[1], a[1] * b[0]);
}

/* Product of the weights of all speeds but k. */
MECHC_INLINE real FN(other_weights)(const real *weight, int k)
{
    real product = R(1.0);
    for (int i = 0; i < MECHC_NU; i++)
        if (i != k) product *= weight[i];
    return product;
}

/* Squared length of the longest row, and whether the rows are dependent. */
MECHC_INLINE void FN(weigh_rows)(const real *mass, real length, real size, double least,
                                 FN(freedom) *f)
{
    real weight[MECHC_NU_MAX];
    FN(speed_weights)(mass, length, weight);
    for (int row = 0; row < MECHC_NC; row++) {
        const real *entry = f->jacobian + row * MECHC_NU;
        real square = entry[0] * entry[0] * weight[0];
        for (int k = 1; k < MECHC_NU; k++) R_ADD(square, entry[k] * entry[k], weight[k]);
        f->longest = row ? R_SELECT(R_MASK(square > f->longest), square, f->longest) : square;
    }
    real most = f->longest;
    for (int row = 1; row < MECHC_NC; row++) most *= f->longest;
    f->redundant =
        ~(R_MASK(size * weight[0] * FN(other_weights)(weight, 0) > least * most)
          & R_MASK(f->rank >= (double)MECHC_NC));
}

/* Factor the rows, which are dependent below the squared share `least` of the longest; 0: none are. */
MECHC_INLINE void FN(find_freedom)(const real *jacobian, const real *mass, real length, real rank,
                                   double least, FN(freedom) *f)
{
    f->rank = rank;
    f->length = length;
    for (int i = 0; i < MECHC_NC * MECHC_NU; i++) f->jacobian[i] = jacobian[i];
    if (MECHC_NU == 3) {
        FN(cross)(jacobian, jacobian + MECHC_NU, f->direction);
    } else {
        f->direction[0] = -jacobian[1];
        f->direction[1] = jacobian[0];
    }
    for (int i = 0; i < MECHC_NU; i++) f->momentum[i] = FN(dot)(mass + i * MECHC_NU, f->direction);
    const real size = FN(dot)(f->momentum, f->direction);
    if (least == 0.0) f->redundant = R_MASK(R(0.0) > R(0.0));
    else FN(weigh_rows)(mass, length, size, least, f);
    f->inverse = 1.0 / size;
}

/* The x on which rows take the values given and momentum . x = along. */
MECHC_INLINE void FN(along_freedom)(const FN(freedom) *f, const real *values, real along, real *x)
{
    if (MECHC_NU == 3) {
        real mixed[MECHC_NU_MAX];
        for (int k = 0; k < MECHC_NU; k++)
            mixed[k] = R_FMS(values[0], f->jacobian[MECHC_NU + k], values[1] * f->jacobian[k]);
        FN(cross)(mixed, f->momentum, x);
    } else {
        x[0] = values[0] * f->momentum[1];
        x[1] = -values[0] * f->momentum[0];
    }
    for (int k = 0; k < MECHC_NU; k++) x[k] = R_FMA(along, f->direction[k], x[k]) * f->inverse;
}

/* Length of the shortest of the rows made orthogonal over that of the longest, or over what the
 * longest has at ordinary configurations. */
MECHC_INLINE real FN(freedom_conditioning_squared)(const FN(freedom) *f, const real *mass,
                                                   real length, real ordinary)
{
    real weight[MECHC_NU_MAX], square = R(0.0), most = R(1.0);
    FN(speed_weights)(mass, length, weight);
    for (int k = 0; k < MECHC_NU; k++)
        R_ADD(square, f->direction[k] * f->direction[k], FN(other_weights)(weight, k));
    for (int row = 0; row < MECHC_NC; row++) most *= FN(larger)(f->longest, ordinary);
    return square / most;
}
#endif
#endif
