/* What the including compilation does not say of the kind of its scenes: see emit/units/general.py. */
#pragma once

#ifndef MECHC_KIND_ROWS
#define MECHC_KIND_ROWS 0
#endif
#ifndef MECHC_KIND_LOOPS
#define MECHC_KIND_LOOPS 0
#endif
#ifndef MECHC_KIND_IDENTITY
#define MECHC_KIND_IDENTITY 0
#endif
#ifndef MECHC_KIND_ONE_FREEDOM
#define MECHC_KIND_ONE_FREEDOM 0
#endif
#ifndef MECHC_KIND_REDUCED
#define MECHC_KIND_REDUCED 0
#endif
#ifndef MECHC_KIND_BLOCKS
#define MECHC_KIND_BLOCKS 0
#endif
#ifndef MECHC_KIND_SERIES
#define MECHC_KIND_SERIES 0
#endif
#ifndef MECHC_KIND_FEW
#define MECHC_KIND_FEW 0
#endif
#ifndef MECHC_KIND_MOMENTA
#define MECHC_KIND_MOMENTA 0
#endif
