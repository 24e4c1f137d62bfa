/* A run saved between two steps, with the dense output of the last one, and brought back to the last
 * bit.
 *
 * A copy holds the addresses of tables and of inputs: it is for runs of the same scene and inputs.
 */
#pragma once

#include <string.h>
#include "run/method.h"
#include "run/trajectory.h"

/* The size of a trajectory's end: both states of its last step, and the rows between them. */
MECHC_STATIC size_t mechc_end_size(const mechc_trajectory *trajectory)
{
    return (size_t)(2 + trajectory->width * (2 + trajectory->dense_rows)) * sizeof(double);
}

MECHC_STATIC void mechc_save_end(const mechc_trajectory *trajectory, double *to)
{
    const ptrdiff_t last = trajectory->count - 1, width = trajectory->width;
    const ptrdiff_t first = last > 0 ? last - 1 : last, block = width * trajectory->dense_rows;
    to[0] = trajectory->t[first];
    to[1] = trajectory->t[last];
    memcpy(to + 2, trajectory->y + first * width, (size_t)width * sizeof *to);
    memcpy(to + 2 + width, trajectory->y + last * width, (size_t)width * sizeof *to);
    if (last > 0 && block)
        memcpy(to + 2 + 2 * width, trajectory->dense + first * block, (size_t)block * sizeof *to);
}

/* Restore the end as the whole trajectory; 0 without memory. */
MECHC_STATIC int mechc_restore_end(mechc_trajectory *trajectory, const double *from)
{
    const ptrdiff_t width = trajectory->width, block = width * trajectory->dense_rows;
    trajectory->count = trajectory->crossing_count = 0;
    for (int i = from[0] == from[1]; i < 2; i++)
        if (!mechc_append(trajectory, from[i], from + 2 + i * width)) return 0;
    if (block) memcpy(trajectory->dense, from + 2 + 2 * width, (size_t)block * sizeof *from);
    return 1;
}

MECHC_RARE size_t mechc_saved_size(const mechc_run *head)
{
    const mechc_integration *run = (const mechc_integration *)head;
    size_t size = mechc_end_size(&head->trajectory) + sizeof *run;
    for (int i = 0; i < MECHC_METHODS; i++)
        if (run->work[i]) size += run->methods[i]->work_size;
    return size;
}

/* Save the run into mechc_saved_size(run) bytes, at a multiple of 8. */
MECHC_RARE void mechc_save(const mechc_run *head, void *saved)
{
    const mechc_integration *run = (const mechc_integration *)head;
    char *to = saved;
    memcpy(to, run, sizeof *run);
    to += sizeof *run;
    mechc_save_end(&head->trajectory, (double *)to);
    to += mechc_end_size(&head->trajectory);
    for (int i = 0; i < MECHC_METHODS; i++) {
        if (!run->work[i]) continue;
        memcpy(to, run->work[i], run->methods[i]->work_size);
        to += run->methods[i]->work_size;
    }
}

/* Restore the run; its trajectory then consists of the step that ended there. */
MECHC_RARE void mechc_restore(mechc_run *head, const void *saved)
{
    mechc_integration *run = (mechc_integration *)head;
    const char *from = saved;
    const mechc_trajectory trajectory = head->trajectory;
    const int *stop = run->given.stop; /* of this run, not of the one saved */
    void *work[MECHC_METHODS];
    memcpy(work, run->work, sizeof work);
    memcpy(run, from, sizeof *run);
    run->given.stop = stop;
    from += sizeof *run;
    head->trajectory = trajectory;
    int made = mechc_restore_end(&head->trajectory, (const double *)from);
    from += mechc_end_size(&trajectory);
    for (int i = 0; i < MECHC_METHODS; i++) {
        const size_t size = run->work[i] ? run->methods[i]->work_size : 0;
        if (!size) mechc_free_aligned(work[i]);
        run->work[i] = !size ? 0 : work[i] ? work[i] : mechc_new_work(run->methods[i]);
        if (size && run->work[i]) memcpy(run->work[i], from, size);
        made &= !size || run->work[i];
        from += size;
    }
    if (!made) head->status = MECHC_NO_MEMORY;
}
