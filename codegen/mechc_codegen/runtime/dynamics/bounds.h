/* Bounds of what counts count: arrays are as large as the bounds, and loops and strides go by the counts.
 *
 * What lies beyond a count is never read.  In the unit of a scene bounds are its counts. */
#pragma once

#ifndef MECHC_NQ_MAX
#define MECHC_NQ_MAX MECHC_NQ
#endif
#ifndef MECHC_NU_MAX
#define MECHC_NU_MAX MECHC_NU
#endif
#ifndef MECHC_NH_MAX
#define MECHC_NH_MAX MECHC_NH
#endif
#ifndef MECHC_NC_MAX
#define MECHC_NC_MAX MECHC_NC
#endif
#ifndef MECHC_NP_MAX
#define MECHC_NP_MAX MECHC_NP
#endif
#ifndef MECHC_NK_MAX
#define MECHC_NK_MAX MECHC_NK
#endif
#ifndef MECHC_SAVED_MAX
#define MECHC_SAVED_MAX MECHC_SAVED
#endif
#ifndef MECHC_TURNS_MAX
#define MECHC_TURNS_MAX MECHC_TURNS
#endif
#ifndef MECHC_LINKS_MAX
#define MECHC_LINKS_MAX MECHC_LINKS
#endif
#ifndef MECHC_COLUMNS_MAX
#define MECHC_COLUMNS_MAX MECHC_COLUMNS
#endif
#ifndef MECHC_CARRIED_MAX
#define MECHC_CARRIED_MAX MECHC_CARRIED
#endif
#ifndef MECHC_FACTORS_MAX
#define MECHC_FACTORS_MAX MECHC_FACTORS
#endif
#ifndef MECHC_BLOCKS_KEPT_MAX
#define MECHC_BLOCKS_KEPT_MAX MECHC_BLOCKS_KEPT
#endif
#ifndef MECHC_OWN_MAX
#define MECHC_OWN_MAX MECHC_OWN
#endif
#ifndef MECHC_WIDEST_MAX
#define MECHC_WIDEST_MAX MECHC_WIDEST
#endif
#ifndef MECHC_SERIES_MAX
#define MECHC_SERIES_MAX MECHC_SERIES
#endif
#ifndef MECHC_SERIES_INTEGRATED_MAX
#define MECHC_SERIES_INTEGRATED_MAX MECHC_SERIES_INTEGRATED
#endif
#ifndef MECHC_SERIES_KEPT_MAX
#define MECHC_SERIES_KEPT_MAX MECHC_SERIES_KEPT
#endif
#ifndef MECHC_SERIES_ROOTS_MAX
#define MECHC_SERIES_ROOTS_MAX MECHC_SERIES_ROOTS
#endif
#ifndef MECHC_SERIES_SUMS_MAX
#define MECHC_SERIES_SUMS_MAX MECHC_SERIES_SUMS
#endif
