/* In place of a scene's series: its linear parts by tapes, its sums by the places of their factors.
 *
 * The including file has set MECHC_SERIES_FEW and MECHC_SERIES_MOMENTA. */
#ifndef MECHC_SCENE_SERIES
#define MECHC_SCENE_SERIES
#include "series/spread.h"
#include "tape/series.h"

#define MECHC_SERIES mechc_series_of_scene.row
#define MECHC_SERIES_SUMS mechc_series_of_scene.sums
#define MECHC_SERIES_KEPT mechc_series_of_scene.kept
#define MECHC_SERIES_INTEGRATED mechc_series_of_scene.integrated
#define MECHC_SERIES_HIDES mechc_series_of_scene.hides
#define MECHC_SERIES_ROOTS mechc_series_of_scene.root_count
#define mechc_root_places mechc_series_of_scene.roots

#if MECHC_SERIES_FEW
/* Sums over lower orders without the first two and the last two, for an order and the next one. */
MECHC_STATIC void mechc_scalar_series_cores(int order, const double *rows, double *cores, double *next)
{
    const double *last = rows + (order - 2) * MECHC_SERIES;
    for (int n = 0; n < MECHC_SERIES_SUMS; n++) {
        const int a = mechc_series_of_scene.left[n], b = mechc_series_of_scene.right[n];
        double own = 0.0, other = 0.0, right = last[b];
        for (int j = 3; j < order - 2; j++) {
            const double left = rows[j * MECHC_SERIES + a];
            other = mechc_scalar_fused(left, right, other);
            right = rows[(order - j) * MECHC_SERIES + b];
            own = mechc_scalar_fused(left, right, own);
        }
        cores[n] = own;
        next[n] = mechc_scalar_fused(last[a], right, other);
    }
}
#else
/* What each sum multiplies, side by side, up to a multiple of eight. */
MECHC_STATIC void mechc_scalar_series_spread(const double *row, double *left, double *right)
{
    const int count = MECHC_SERIES_SUMS;
    for (int n = 0; n < (count + 7) / 8 * 8; n++) {
        const int own = n < count ? n : count - 1;
        left[n] = row[mechc_series_of_scene.left[own]];
        right[n] = row[mechc_series_of_scene.right[own]];
    }
}
#endif

/* Products of two rows added to the sums. */
MECHC_STATIC void mechc_scalar_series_ends(const double *middle, const double *early, const double *first,
                                           const double *last, double *sums)
{
    for (int n = 0; n < MECHC_SERIES_SUMS; n++) {
        const int a = mechc_series_of_scene.left[n], b = mechc_series_of_scene.right[n];
        const double outer = mechc_scalar_fused(early[a], last[b], middle[n]);
        sums[n] = mechc_scalar_fused(last[a], first[b], outer);
    }
}
#endif
