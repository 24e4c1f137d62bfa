/* In place of a scene's program: calls of the functions of the scene that the general unit is linked to. */
#include "simd/real.h"
#if R_EXTENDED ? !defined MECHC_SCENE_PROGRAM_EXTENDED \
    : R_VECTOR ? !defined MECHC_SCENE_PROGRAM_VECTOR : !defined MECHC_SCENE_PROGRAM_SCALAR
#if R_EXTENDED
#define MECHC_SCENE_PROGRAM_EXTENDED
#elif R_VECTOR
#define MECHC_SCENE_PROGRAM_VECTOR
#else
#define MECHC_SCENE_PROGRAM_SCALAR
#endif
#if !R_EXTENDED
#include "dynamics/given.h"
#include "dynamics/sizes.h"
#include "simd/lanes.h"
#include "simd/sine_cosine.h" /* for series */
#endif
#include "general/called.h"

#define MECHC_CALL_SCENE(result, name, parameters, arguments) \
    extern MECHC_OF_SCENE result FN(scene_##name) parameters; \
    MECHC_INLINE result FN(name) parameters { return FN(scene_##name) arguments; }

MECHC_GAPS(MECHC_CALL_SCENE)
#if MECHC_NH_MAX > 0
MECHC_GAPS_OF_LOOPS(MECHC_CALL_SCENE)
#endif
#if !R_EXTENDED
MECHC_ALL_SCENES(MECHC_CALL_SCENE)
MECHC_OF_STATES(MECHC_CALL_SCENE)
#if MECHC_BLOCKS_CODE
MECHC_BLOCKS_OF_ROWS(MECHC_CALL_SCENE)
#endif
#endif
#undef MECHC_CALL_SCENE
#endif
