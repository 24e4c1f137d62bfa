/* Sizes of whichever scene the general unit is linked to: counts by its table, bounds that fit most.
 *
 * Of what another kind of scene has there is nothing; MECHC_KIND_... of the including compilation tell:
 * ROWS and LOOPS whether there are constraint rows, and some on the configuration, ONE_FREEDOM whether
 * closed forms serve (loops/one_freedom.h), WALKED whether M and F follow from a tree's data (tree.h). */
#ifndef MECHC_SCENE_SIZES
#define MECHC_SCENE_SIZES
#define MECHC_GENERAL 1
#include "general/bounds.h"
#include "general/counts.h"

/* Of scenes that are walked, and of others. */
#define MECHC_NQ_MAX (MECHC_KIND_WALKED ? 128 : 16)
#define MECHC_SAVED_MAX (MECHC_KIND_WALKED ? 4096 : 256)
#define MECHC_TURNS_MAX (MECHC_KIND_WALKED ? 128 : 32)
#define MECHC_LINKS_MAX (MECHC_KIND_WALKED ? 128 : 0)
#define MECHC_COLUMNS_MAX (MECHC_KIND_WALKED ? 160 : 0)
#define MECHC_CARRIED_MAX (MECHC_KIND_WALKED ? 256 : 0)
#define MECHC_FACTORS_MAX (MECHC_KIND_WALKED ? 256 : 0)
#define MECHC_SWITCHES_MAX 16
#define MECHC_FEATURES_MAX 16
#define MECHC_KNOTTED_MAX 16
#define MECHC_FREE_MAX 16
#define MECHC_BLOCKS_KEPT_MAX 256
#if MECHC_KIND_ONE_FREEDOM
#define MECHC_NU_MAX 3
#define MECHC_NC_MAX 2
#else
#define MECHC_NU_MAX (MECHC_KIND_WALKED ? 128 : 16)
#if MECHC_KIND_ROWS
#define MECHC_NC_MAX (MECHC_KIND_WALKED ? 48 : 16)
#else
#define MECHC_NC_MAX 0
#endif
#endif
#define MECHC_NH_MAX (MECHC_KIND_LOOPS ? MECHC_NC_MAX : 0)

#define MECHC_TAPES_OF_SERIES (!MECHC_KIND_ROWS && !MECHC_KIND_WALKED) /* which scenes without constraints may have */
#define MECHC_SERIES_MAX 256
#define MECHC_SERIES_INTEGRATED_MAX 64
#define MECHC_SERIES_KEPT_MAX 256
#define MECHC_SERIES_SUMS_MAX 512
#define MECHC_SERIES_ROOTS_MAX 16

#define MECHC_NQ mechc_of_scene.nq
#define MECHC_NP mechc_of_scene.np
#define MECHC_NK mechc_of_scene.nk
#define MECHC_SAVED mechc_of_scene.saved
#define MECHC_TURNS mechc_of_scene.turns
#define MECHC_NI mechc_of_scene.ni
#define MECHC_STATES mechc_of_scene.states
#define MECHC_SWITCHES mechc_of_scene.switches
#define MECHC_FEATURES mechc_of_scene.features
#define MECHC_KNOTTED mechc_of_scene.knotted
#define MECHC_MULTIPLIERS mechc_of_scene.multipliers
#define MECHC_BLOCKS_KEPT mechc_of_scene.blocks_kept
#define MECHC_NU mechc_of_scene.nu
#define MECHC_NC (MECHC_KIND_ROWS ? mechc_of_scene.nc : 0)
#define MECHC_NH (MECHC_KIND_LOOPS ? mechc_of_scene.nh : 0)

#define MECHC_SLIDES /* tables of the scene */
#define MECHC_ANGLES
#define MECHC_IDENTITY_KINEMATICS mechc_of_scene.identity_kinematics
#define MECHC_KINEMATICS_CODE 1
#define MECHC_ONE_FREEDOM MECHC_KIND_ONE_FREEDOM
#define MECHC_ROW_BLOCKS mechc_of_scene.row_blocks
#define MECHC_BLOCKS_CODE (MECHC_KIND_ROWS && !MECHC_KIND_ONE_FREEDOM && !MECHC_KIND_WALKED)
#define MECHC_WALKED MECHC_KIND_WALKED
#define MECHC_LINKS mechc_of_scene.links
#define MECHC_PLANAR mechc_of_scene.planar
#define MECHC_COLUMNS mechc_of_scene.columns
#define MECHC_SPEEDS_SHARED mechc_of_scene.speeds_shared
#define MECHC_SPEEDS_SHARED_CODE MECHC_KIND_WALKED
#define MECHC_CARRIED mechc_of_scene.carried
#define MECHC_CARRIED_CODE (MECHC_KIND_WALKED && MECHC_KIND_ROWS)
#define MECHC_FACTORS mechc_of_scene.factors
#define MECHC_MOVING_CUTS mechc_of_scene.moving_cuts
#define MECHC_PAIRS mechc_of_scene.pairs
#define MECHC_PAIRS_MAX (MECHC_KIND_WALKED ? 96 : 0)
#define MECHC_MOMENTS mechc_of_scene.moments
#define MECHC_SEVERAL_LOOPS mechc_of_scene.several_loops
#define MECHC_MOVING_CUTS_CODE MECHC_CARRIED_CODE
#define mechc_parent mechc_of_scene.parent /* tables of the scene */
#define mechc_first_column mechc_of_scene.first_column
#define mechc_column_speed mechc_of_scene.column_speed
#define mechc_cut mechc_of_scene.cut
#define mechc_first_pair mechc_of_scene.first_pair
#define mechc_first_row mechc_of_scene.first_row
#define mechc_cut_place mechc_of_scene.cut_place
#define mechc_handed_to mechc_of_scene.handed_to
#define mechc_row_taken mechc_of_scene.row_taken
#define mechc_first_factor mechc_of_scene.first_factor
#define MECHC_LOCKSTEP mechc_of_scene.lockstep
#define MECHC_LOCKSTEP_CODE 1
#define MECHC_STATE_JACOBIAN 0 /* by tapes: see tape/unit.h */
#define MECHC_PARAMETER_JACOBIAN 0
#define MECHC_INPUT_JACOBIAN 0
#define MECHC_MASS_MATRIX 0
#define MECHC_VARIATIONAL 1 /* of scenes that vary */
#define MECHC_GRADIENT mechc_of_scene.gradient
#define MECHC_GAP_BY_PARAMETERS mechc_of_scene.gap_by_parameters
#define MECHC_GAP_BY_INPUTS mechc_of_scene.gap_by_inputs
#define MECHC_GAP_RATE_BY_PARAMETERS mechc_of_scene.gap_rate_by_parameters
#define MECHC_GAP_RATE_BY_INPUTS mechc_of_scene.gap_rate_by_inputs
#define MECHC_OWN mechc_of_scene.own
#define MECHC_OWN_MAX 512
#define MECHC_WIDEST 1
#define MECHC_OUTPUTS(X)
#define MECHC_SOLVED_OUTPUTS(X)
#endif
