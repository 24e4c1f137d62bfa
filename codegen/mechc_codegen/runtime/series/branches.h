/* The limit that branches of roots put on a step; generic over `real`.
 *
 * A square root and a power are positive.  What they are taken of may touch zero, as that of
 * sqrt(x^2 + x^4): there the equations have a corner, but the series of the root goes on smoothly,
 * with the other sign.  So a step ends just past the first zero of such a series, and the next one
 * begins on the other branch, as a step ends at a corner of Abs.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_BRANCHES_VECTOR : !defined MECHC_BRANCHES_SCALAR
#if R_VECTOR
#define MECHC_BRANCHES_VECTOR
#else
#define MECHC_BRANCHES_SCALAR
#endif
#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES
#include "series/coefficients.h"
#if MECHC_SERIES_ROOTS

/* The least share of its first value that a root surely keeps up to the part s of the scale: no term
 * is larger than it is at the end. */
MECHC_INLINE real FN(branches_kept)(real (*rows)[MECHC_SERIES], int order, real s)
{
    static const int places[] = {MECHC_SERIES_ROOT_PLACES};
    real least = R(1.0);
    for (int n = 0; n < MECHC_SERIES_ROOTS; n++) {
        const int place = places[n];
        const real value = rows[0][place], inverse = 1.0 / value;
        real change = R(0.0);
        for (int k = order - 1; k > 0; k--) {
            const real term = rows[k][place] * inverse;
            change = (change + R_SELECT(R_MASK(term < 0.0), -term, term)) * s;
        }
        const real kept = 1.0 - change;
        least = R_SELECT(R_MASK(kept > least), least, kept);
    }
    return least;
}
#endif
#endif
#endif
