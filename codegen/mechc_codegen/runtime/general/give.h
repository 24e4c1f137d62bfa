/* The functions of a scene for the general unit, over `real`: see of_scene.h. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_GIVE_VECTOR : !defined MECHC_GIVE_SCALAR
#if R_VECTOR
#define MECHC_GIVE_VECTOR
#else
#define MECHC_GIVE_SCALAR
#endif
#include "general/called.h"
#include "scene_program.h"

MECHC_GAPS(MECHC_GIVE_FUNCTION)
MECHC_ALL_SCENES(MECHC_GIVE_FUNCTION)
#if MECHC_KIND_LOOPS
MECHC_GAPS_OF_LOOPS(MECHC_GIVE_FUNCTION)
#endif
#if !MECHC_IDENTITY_KINEMATICS
MECHC_KINEMATICS(MECHC_GIVE_FUNCTION)
#endif
#if MECHC_KIND_BLOCKS
MECHC_BLOCKS_OF_ROWS(MECHC_GIVE_FUNCTION)
#endif
#if MECHC_SWITCHES
MECHC_SWITCHED(MECHC_GIVE_FUNCTION)
#else
MECHC_ONCE void FN(nothing)(real t, ...) { (void)t; }
MECHC_SWITCHED(MECHC_LACK_FUNCTION)
#endif
#endif
