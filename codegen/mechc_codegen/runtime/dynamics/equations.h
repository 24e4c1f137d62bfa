/* The scene's equations and what solves them, over `real`; without a guard, since it is included
 * once for each binding of it. */
#include "simd/sine_cosine.h"
#include "dynamics/read_inputs.h"
#include MECHC_PROGRAM
#include "dynamics/tree.h"
#include "dynamics/linear.h"
#include "dynamics/loop_rows.h"
#include "dynamics/least_multipliers.h"
#include "dynamics/one_freedom.h"
#include "dynamics/motion.h"
#include "dynamics/loop_motion.h"
#include "dynamics/stage.h"
#include "unit/solved.h"
#include "unit/jacobians.h"
