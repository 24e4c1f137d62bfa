/* Runge-Kutta methods as data.
 *
 * Rate i is taken at t + nodes[i] h, y + h sum_j matrix[i][j] rate_j.  Rows past `stages` belong to
 * the dense output; row `stages` is the step's end.  The dense output (run/dense_output.h) has
 * r0 = y1 - y0, r1 = h f0 - r0, r2 = r0 - h f1 - r1 and then the rows h sum_j dense[i][j] rate_j,
 * unless the method has rows of its own.
 */
#pragma once

#include <math.h>
#include "abi/macros.h"

#define MECHC_MOST_RATES 16 /* of a step of any method */
#define MECHC_TAYLOR_MOST 26 /* order of a Taylor series, at the rounding of doubles */
#define MECHC_MOST_DENSE (MECHC_TAYLOR_SERIES || MECHC_GENERAL ? MECHC_TAYLOR_MOST : 9) /* rows of the dense output */

/* Shares of the tolerance that one step may use; the second where steps are many, since the order
 * is low. */
#define MECHC_SHARE 0.03
#define MECHC_SHARE_OF_MANY 0.01
/* Steps after which a share falls with their number.  Errors of one sign add up to a drift of the energy,
 * which shifts the phase by the square of the time; of shares that fall so the sum is a logarithm. */
#define MECHC_STEPS_OF_SHARE 1000

/* An error, over what is tolerated, that shortens the next step of a pair of high order. */
#define MECHC_ALIKE_SHORTENS 0.4

typedef struct {
    int stages, rates, dense_rows, order;
    const double *nodes, *matrix;       /* matrix: rows of MECHC_MOST_RATES */
    const double *error, *second_error; /* second_error may be NULL */
    const double *dense;                /* dense_rows - 3 rows of MECHC_MOST_RATES */
    double stability;                   /* |h lambda| that an explicit method bears; 0: implicit */
    double share;                       /* of the tolerance that one step may use */
    double fast; /* |h lambda| beyond what accuracy asks for, of the tolerance's root; 0: not known */
} mechc_tableau;
