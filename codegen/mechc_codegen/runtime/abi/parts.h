/* The parts of a unit.  Each may be a shared object of its own, `mechc_part`, compiled when it is first
 * needed; compiled together they are the whole unit. */
#pragma once

/* The number of each part is a bit; X of each. */
#define MECHC_PART_TABLE(X) \
    X(DRIVER) X(COLLOCATION) X(EXPLICIT) X(IMPLICIT) X(TAYLOR) X(TAYLOR_LANES) X(SWEEPS) X(OUTPUTS) X(DERIVATIVES)
#define MECHC_PART_DRIVER 1      /* runs, but no method; projection, dense output */
#define MECHC_PART_COLLOCATION 2 /* gauss8 */
#define MECHC_PART_EXPLICIT 4    /* dopri5 and dop853, runs in lockstep */
#define MECHC_PART_IMPLICIT 8    /* radau5 */
#define MECHC_PART_OUTPUTS 16    /* outputs of many states in lanes, rates as C calls them */
#define MECHC_PART_DERIVATIVES 32 /* of runs */
#define MECHC_PART_TAYLOR 64 /* taylor, of a run by itself */
#define MECHC_PART_SWEEPS 128 /* gauss8_lockstep */
#define MECHC_PART_TAYLOR_LANES 256 /* taylor, of several runs too: in place of the part before */
#define MECHC_ALL_PARTS 511
#define MECHC_PARTS_OF_GENERAL 143 /* driver and methods but series, for all scenes of a kind */

#ifndef MECHC_UNIT_PARTS
#define MECHC_UNIT_PARTS MECHC_ALL_PARTS
#endif
#define MECHC_HAS(part) ((MECHC_UNIT_PARTS & MECHC_PART_##part) != 0)

/* The attribute of symbols that are found by name in a shared object. */
#ifdef _WIN32
#define MECHC_SHOWN __declspec(dllexport)
#else
#define MECHC_SHOWN __attribute__((visibility("default")))
#endif
