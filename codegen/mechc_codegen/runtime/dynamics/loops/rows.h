/* Trees whose loops close on the ground: the rows of J are eliminated link by link.
 *
 * Generic over `real`.
 * Gauss's principle is a least-squares problem along the tree: for an acceleration a of a link,
 * its descendants contribute a^T I a / 2 - a^T p, subject to the rows R a = r of the cuts beyond
 * it (Vereshchagin 1974; Featherstone 2008, chapter 8).  At a joint with axis S a speed is either
 * free, as in articulated bodies, or eliminates the row on which it acts most:
 *     x = (r - R a) / (R S),   and with U = I S, D = S^T U, b = R / (R S), v = b - U / D:
 *     I <- I - U U^T / D + D v v^T,    p <- p - U r / (R S) - b (S^T p - D r / (R S)).
 * Which speeds eliminate rows is known when the scene is compiled (elimination_order.py), which row
 * each eliminates when it runs.  The cost grows with the links, not with the length of the loops.
 *
 * (R S)^2 / D is how far a unit force along the row moves the link by this joint alone.  Its least
 * value over its greatest measures the conditioning; I grows by its inverse, so that below
 * MECHC_SAFE the rows are solved together, by the orthogonal factors of linear.h.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_LOOP_ROWS_VECTOR : !defined MECHC_LOOP_ROWS_SCALAR
#if R_VECTOR
#define MECHC_LOOP_ROWS_VECTOR
#else
#define MECHC_LOOP_ROWS_SCALAR
#endif
#include "dynamics/linear.h"
#include "dynamics/tree.h"

#if MECHC_CARRIED_CODE
/* Results of the elimination, column by column. */
typedef struct {
    real momentum[MECHC_NU_MAX * MECHC_DIM_MAX]; /* U of each column */
    real along[MECHC_NU_MAX], inverse[MECHC_NU_MAX]; /* D and 1 / D */
    real share[MECHC_NU_MAX * MECHC_DIM_MAX];    /* b of the columns that eliminate a row */
    real inverse_pivot[MECHC_NU_MAX];        /* 1 / (R S) of these */
    real factor[MECHC_AT_LEAST_ONE(MECHC_FACTORS_MAX)]; /* of that row in those after it */
    rmask swapped[MECHC_AT_LEAST_ONE(MECHC_FACTORS_MAX)];
    real conditioning; /* squared */
} FN(eliminated);

/* Each row, whose pair is one with the ground, as a wrench of unit force on the other link. */
MECHC_INLINE void FN(cut_wrenches)(const real *tree, real *rows)
{
    for (int i = 0; i < MECHC_NC; i++) {
        const int second = mechc_cut[2 * i] < 0;
        FN(cut_wrench)(tree, i, second, rows + mechc_cut_place[i] * MECHC_DIM);
    }
}

/* Put the row on which the axis acts most first and eliminate it from the others; its R S. */
MECHC_INLINE real FN(eliminate_row)(const real *axis, int column, int rows, real *row,
                                    FN(eliminated) *f)
{
    real pivot = FN(along_motion)(axis, row);
    real *factor = f->factor + mechc_first_factor[column];
    rmask *swapped = f->swapped + mechc_first_factor[column];
    for (int m = 1; m < rows; m++) {
        real other = FN(along_motion)(axis, row + m * MECHC_DIM);
        swapped[m - 1] = R_MASK(other * other > pivot * pivot);
        FN(swap)(swapped[m - 1], &pivot, &other);
        for (int i = 0; i < MECHC_DIM; i++)
            FN(swap)(swapped[m - 1], &row[i], &row[m * MECHC_DIM + i]);
        factor[m - 1] = other;
    }
    f->inverse_pivot[column] = 1.0 / pivot;
    for (int m = 1; m < rows; m++) {
        factor[m - 1] *= f->inverse_pivot[column];
        for (int i = 0; i < MECHC_DIM; i++) R_SUB(row[m * MECHC_DIM + i], factor[m - 1], row[i]);
    }
    return pivot;
}

/* I <- I + D v v^T */
MECHC_INLINE void FN(constrain_speed)(const real *row, int column, FN(eliminated) *f, real *inertia)
{
    const real *momentum = f->momentum + column * MECHC_DIM;
    real *share = f->share + column * MECHC_DIM, free_part[MECHC_DIM_MAX];
    for (int i = 0; i < MECHC_DIM; i++) {
        share[i] = row[i] * f->inverse_pivot[column];
        free_part[i] = share[i] - momentum[i] * f->inverse[column];
    }
    for (int i = 0; i < MECHC_DIM; i++)
        for (int j = 0; j < MECHC_DIM; j++)
            R_ADD(inertia[i * MECHC_DIM + j], f->along[column] * free_part[i], free_part[j]);
}

MECHC_ONCE void FN(eliminate)(const real *tree, FN(eliminated) *f)
{
    real inertias[MECHC_LINKS_MAX * MECHC_SQUARE_MAX], rows[MECHC_CARRIED_MAX * MECHC_DIM_MAX];
    real least = R(HUGE_VAL), most = R(0.0);
    FN(rigid_inertias)(tree, inertias);
    FN(cut_wrenches)(tree, rows);
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        real *inertia = inertias + link * MECHC_SQUARE;
        const int end = mechc_first_row[link + 1], parent = mechc_parent[link];
        int place = mechc_first_row[link];
        for (int c = mechc_first_column[link + 1] - 1; c >= mechc_first_column[link]; c--) {
            const real *axis = tree + MECHC_AT_SUBSPACE + c * MECHC_DIM;
            FN(times_inertia)(inertia, axis, f->momentum + c * MECHC_DIM);
            f->along[c] = FN(along_motion)(axis, f->momentum + c * MECHC_DIM);
            f->inverse[c] = 1.0 / f->along[c];
            FN(free_speed)(f->momentum + c * MECHC_DIM, f->inverse[c], inertia);
            if (place == end) continue;
            real *row = rows + place * MECHC_DIM;
            const real pivot = FN(eliminate_row)(axis, c, end - place, row, f);
            const real mobility = pivot * pivot * f->inverse[c];
            least = R_SELECT(R_MASK(mobility < least), mobility, least);
            least = R_SELECT(R_MASK(mobility > 0.0), least, R(0.0)); /* it, or what follows it, has no pivot */
            most = R_SELECT(R_MASK(mobility > most), mobility, most);
            FN(constrain_speed)(row, c, f, inertia);
            place++;
        }
        if (parent < 0) continue;
        const real *arm = tree + link * MECHC_ARM;
        FN(add_inertia)(arm, inertia, inertias + parent * MECHC_SQUARE);
        for (real *to = rows + mechc_handed_to[link] * MECHC_DIM; place < end;
             place++, to += MECHC_DIM) {
            for (int i = 0; i < MECHC_DIM; i++) to[i] = R(0.0);
            FN(add_wrench)(arm, rows + place * MECHC_DIM, to);
        }
    }
    f->conditioning = least / most;
}

/* Eliminate the rows' values in the same way, from the cuts towards the ground; *taken: r / (R S). */
MECHC_INLINE void FN(eliminate_value)(const FN(eliminated) *f, int column, int rows, real *value,
                                      real *taken)
{
    const real *factor = f->factor + mechc_first_factor[column];
    const rmask *swapped = f->swapped + mechc_first_factor[column];
    for (int m = 1; m < rows; m++) FN(swap)(swapped[m - 1], &value[0], &value[m]);
    for (int m = 1; m < rows; m++) R_SUB(value[m], factor[m - 1], value[0]);
    *taken = value[0] * f->inverse_pivot[column];
}

/* The x nearest to M^-1 S^T wrench, in the metric of M, on which the rows take the values given;
 * wrench, which is overwritten, holds one on each link. */
MECHC_ONCE void FN(follow_rows)(const real *tree, const FN(eliminated) *f, real *wrench,
                                const real *values, real *x)
{
    real left[MECHC_NU_MAX], value[MECHC_CARRIED_MAX], motion[MECHC_LINKS_MAX * MECHC_DIM_MAX];
    for (int i = 0; i < MECHC_NC; i++) value[mechc_cut_place[i]] = values[i];
    for (int link = MECHC_LINKS - 1; link >= 0; link--) {
        real *own = wrench + link * MECHC_DIM;
        const int end = mechc_first_row[link + 1], parent = mechc_parent[link];
        int place = mechc_first_row[link];
        for (int c = mechc_first_column[link + 1] - 1; c >= mechc_first_column[link]; c--) {
            const real *momentum = f->momentum + c * MECHC_DIM, *share = f->share + c * MECHC_DIM;
            left[c] = FN(along_motion)(tree + MECHC_AT_SUBSPACE + c * MECHC_DIM, own);
            if (place == end) {
                left[c] *= f->inverse[c];
                for (int i = 0; i < MECHC_DIM; i++) R_SUB(own[i], left[c], momentum[i]);
                continue;
            }
            real taken;
            FN(eliminate_value)(f, c, end - place, value + place, &taken);
            const real rest = R_FNMA(f->along[c], taken, left[c]);
            for (int i = 0; i < MECHC_DIM; i++) own[i] -= R_FMA(taken, momentum[i], rest * share[i]);
            left[c] = taken;
            place++;
        }
        if (parent < 0) continue;
        FN(add_wrench)(tree + link * MECHC_ARM, own, wrench + parent * MECHC_DIM);
        for (int to = mechc_handed_to[link]; place < end; place++, to++) value[to] = value[place];
    }
    for (int link = 0; link < MECHC_LINKS; link++) {
        real *own = FN(motion_of_parent)(tree, link, motion);
        for (int c = mechc_first_column[link]; c < mechc_first_column[link + 1]; c++) {
            const real *axis = tree + MECHC_AT_SUBSPACE + c * MECHC_DIM;
            const real part =
                mechc_row_taken[c] < 0
                    ? left[c] - FN(along_motion)(f->momentum + c * MECHC_DIM, own) * f->inverse[c]
                    : left[c] - FN(along_motion)(f->share + c * MECHC_DIM, own);
            for (int i = 0; i < MECHC_DIM; i++) R_ADD(own[i], part, axis[i]);
            x[mechc_column_speed[c]] = part;
        }
    }
}
#endif
#endif
