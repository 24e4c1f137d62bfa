/* Work on a stack of its own: work space of a scene is as large as its matrices, and threads may
 * have small stacks. */
#pragma once

#include <pthread.h>
#include <stddef.h>

#define MECHC_WIDE 90 /* components of a state up to which work space is below half a megabyte */

typedef struct {
    void (*work)(void *);
    void *data;
} mechc_on_stack;

static void *mechc_run_on_stack(void *given)
{
    const mechc_on_stack *job = (const mechc_on_stack *)given;
    job->work(job->data);
    return 0;
}

/* Bytes of stack that a scene of this width is given; 0: those of the calling thread will do. */
static inline size_t mechc_stack_of(int width)
{
    const size_t square = (size_t)width * (size_t)width * sizeof(double);
    return width < MECHC_WIDE ? 0 : ((size_t)16 << 20) + 80 * square;
}

/* work(data), with a stack of so many bytes, of which only what is touched takes memory; 0 if there
 * is none. */
static inline int mechc_with_stack(size_t bytes, void (*work)(void *), void *data)
{
    mechc_on_stack job = {work, data};
    pthread_attr_t attributes;
    pthread_t thread;
    int made;
    if (!bytes) {
        work(data);
        return 1;
    }
    if (pthread_attr_init(&attributes)) return 0;
    made = !pthread_attr_setstacksize(&attributes, bytes)
        && !pthread_create(&thread, &attributes, mechc_run_on_stack, &job);
    pthread_attr_destroy(&attributes);
    return made && !pthread_join(thread, 0);
}
