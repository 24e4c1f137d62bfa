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

#ifndef MECHC_GIVE_FUNCTION /* as the scene has it */
#define MECHC_GIVE_FUNCTION(result, name, parameters, arguments) \
    extern MECHC_OF_SCENE result FN(scene_##name) parameters; \
    result FN(scene_##name) parameters { return FN(name) arguments; }
#endif

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
/* In place of one that the scene does not have, and that is not called: what it is for counts none. */
MECHC_ONCE void FN(nothing)(real t, ...) { (void)t; }
#ifndef MECHC_LACK_FUNCTION
#define MECHC_LACK_FUNCTION(result, name, parameters, arguments) \
    extern MECHC_OF_SCENE result FN(scene_##name) parameters; \
    result FN(scene_##name) parameters { FN(nothing) arguments; }
#endif
MECHC_SWITCHED(MECHC_LACK_FUNCTION)
#endif
#endif
