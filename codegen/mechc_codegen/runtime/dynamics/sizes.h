/* Sizes of the scene, and constants derived from them. */
#pragma once

#include "scene_sizes.h"
#include "dynamics/bounds.h"

#ifndef MECHC_GENERAL
#define MECHC_GENERAL 0 /* the unit that serves all scenes? */
#endif

#ifndef MECHC_LOCKSTEP_CODE
#define MECHC_LOCKSTEP_CODE MECHC_LOCKSTEP
#endif

#ifndef MECHC_NI
#define MECHC_NI 0 /* values of inputs that a run is given */
#endif

#ifndef MECHC_ROW_BLOCKS
#define MECHC_ROW_BLOCKS 0 /* of constraint rows */
#define MECHC_BLOCKS_KEPT 0
#endif

/* Whether there is code for rows in blocks, and for q' that is not u; a scene tells the general unit whether
 * it has them. */
#ifndef MECHC_BLOCKS_CODE
#define MECHC_BLOCKS_CODE (MECHC_ROW_BLOCKS > 0)
#endif
#ifndef MECHC_KINEMATICS_CODE
#define MECHC_KINEMATICS_CODE (!MECHC_IDENTITY_KINEMATICS)
#endif

/* Whether M and F follow from a tree's data at run time, by the tables of its links, and whether there is code
 * for rows that are eliminated at the links, or that meet from several. */
#ifndef MECHC_WALKED
#define MECHC_WALKED (MECHC_LINKS > 0)
#endif
#ifndef MECHC_CARRIED_CODE
#define MECHC_CARRIED_CODE (MECHC_CARRIED > 0)
#define MECHC_MOVING_CUTS_CODE MECHC_MOVING_CUTS
#endif
#ifndef MECHC_SPEEDS_SHARED_CODE
#define MECHC_SPEEDS_SHARED_CODE MECHC_SPEEDS_SHARED
#endif
#define MECHC_FREE_TREE (MECHC_WALKED && MECHC_NC_MAX == 0)
#define MECHC_ARTICULATED (MECHC_FREE_TREE && (MECHC_GENERAL || !MECHC_SPEEDS_SHARED_CODE))

#ifndef MECHC_STATES
#define MECHC_STATES 0 /* the number of coordinates, the last ones, that no displacement moves */
#endif

#ifndef MECHC_SWITCHES
#define MECHC_SWITCHES 0 /* functions at whose zeros the equations change their form */
#endif

#ifndef MECHC_FEATURES
#define MECHC_FEATURES 0 /* the number of switching functions, the last ones, that are edges of narrow features */
#endif

#ifndef MECHC_KNOTTED
#define MECHC_KNOTTED 0 /* the number before them that are arguments of tables, with knots instead of zeros */
#endif

/* Squared sine or share, and squared length over that of the longest row, below which rows are not
 * eliminated block by block: see loops/blocks.h. */
#define MECHC_SAFE_SINE 0.1
#define MECHC_SAFE_LENGTH 1e-3
/* Above these squares no critical configuration is near: 0.2 squared, as MECHC_LOCKSTEP_LOW. */
#define MECHC_CLEAR_SINE 0.04

/* The parts of a stage are in line.  Of a scene with long equations they are compiled once: a call
 * costs little beside them, and each copy as long to compile as all the rest.  So are those of the first
 * unit, which is there the sooner. */
#if defined MECHC_LONG || defined MECHC_FIRST_UNIT
#define MECHC_OF_STAGE MECHC_SINGLE
#else
#define MECHC_OF_STAGE MECHC_INLINE
#endif

#ifndef MECHC_TAYLOR_SERIES
#define MECHC_TAYLOR_SERIES 0 /* are there recurrences of the motion's Taylor coefficients? */
#endif

#ifndef MECHC_NI_MAX
#define MECHC_NI_MAX MECHC_NI
#endif
#ifndef MECHC_SWITCHES_MAX
#define MECHC_SWITCHES_MAX MECHC_SWITCHES
#endif
#ifndef MECHC_FEATURES_MAX
#define MECHC_FEATURES_MAX MECHC_FEATURES
#endif
#ifndef MECHC_KNOTTED_MAX
#define MECHC_KNOTTED_MAX MECHC_KNOTTED
#endif
#define MECHC_NX (MECHC_NQ + MECHC_NU)
#define MECHC_NX_MAX (MECHC_NQ_MAX + MECHC_NU_MAX)
#define MECHC_FREE (MECHC_NU - MECHC_NC) /* directions, where no row is redundant */
#ifndef MECHC_FREE_MAX
#define MECHC_FREE_MAX MECHC_FREE
#endif
/* Constants made of parameters, and then of the rows: how many count (generic_rank.h), and what they
 * are like at ordinary configurations (ordinary_rows.h). */
#define MECHC_ROWS_THAT_COUNT MECHC_NK
#define MECHC_ORDINARY_LENGTH (MECHC_NK + 1)
#define MECHC_ORDINARY_SUM (MECHC_NK + 2)
#define MECHC_OF_A_RADIAN 0.1
#define MECHC_LENGTH (MECHC_NK + 3) /* of the mechanism: see ordinary_rows.h */
#define MECHC_CONSTANTS (MECHC_NK + 4)
#define MECHC_CONSTANTS_MAX (MECHC_NK_MAX + 4)

#if MECHC_GENERAL
#define mechc_slides mechc_of_scene.slides
#define MECHC_HAS_SLIDES (mechc_slides != 0)
#define MECHC_SLIDES_AT(i) (MECHC_HAS_SLIDES && mechc_slides[i])
#elif defined MECHC_SLIDES /* of the state: the components that are no angles and no numbers */
static const unsigned char mechc_slides[MECHC_NX] __attribute__((unused)) = {MECHC_SLIDES};
#define MECHC_HAS_SLIDES 1
#define MECHC_SLIDES_AT(i) (mechc_slides[i] != 0)
#else
#define MECHC_SLIDES_AT(i) 0
#endif
