/* What the including compilation does not say of the kind of its scenes: see emit/units/general.py. */
#pragma once

#ifndef MECHC_KIND_ROWS
#define MECHC_KIND_ROWS 0
#endif
#ifndef MECHC_KIND_LOOPS
#define MECHC_KIND_LOOPS 0
#endif
#ifndef MECHC_KIND_ONE_FREEDOM
#define MECHC_KIND_ONE_FREEDOM 0
#endif
/* Scenes without constraints may have series. */
#define MECHC_TAPES_OF_SERIES (!MECHC_KIND_ROWS)
