/* Code over `real`: compiled once where it is a double and once where it is a vector of them.
 *
 * A generic header includes this one and defines functions FN(name).  A header that needs one binds
 * the names first (bind_scalar.h or bind_vector.h), includes it, and unbinds them (unbind.h); by
 * itself it is compiled for one double.  Its guard has two names, one for each binding:
 *
 *     #include "simd/real.h"
 *     #if R_VECTOR ? !defined MECHC_THIS_VECTOR : !defined MECHC_THIS_SCALAR
 *     #if R_VECTOR
 *     #define MECHC_THIS_VECTOR
 *     #else
 *     #define MECHC_THIS_SCALAR
 *     #endif
 *
 * A header that binds is included outside of any binding.
 *
 * The scene's program has a third binding, to one long double (bind_extended.h), of which the gaps
 * of the loops alone are taken.
 */
#ifndef real
#include "simd/bind_scalar.h"
#endif

/* x <- x + a b and x <- x - a b, in one rounding where the processor can: no compiler chooses. */
#ifndef R_ADD
#define R_ADD(x, a, b) ((x) = R_FMA(a, b, x))
#define R_SUB(x, a, b) ((x) = R_FNMA(a, b, x))
#endif
