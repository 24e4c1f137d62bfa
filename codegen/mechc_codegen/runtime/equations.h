/* The scene's equations and what solves them, over `real`; without a guard, since it is included
 * once for each binding of it. */
#include "sine_cosine.h"
#include "read_inputs.h"
#include MECHC_PROGRAM
#include "tree.h"
#include "linear.h"
#include "loop_rows.h"
#include "least_multipliers.h"
#include "one_freedom.h"
#include "dynamics.h"
#include "loop_motion.h"
#include "stage.h"
#include "solved.h"
#include "jacobians.h"
