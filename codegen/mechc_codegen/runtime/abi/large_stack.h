/* Work on a separate stack: work space of a scene is as large as its matrices, and threads may have
 * small stacks.  The caller can do other things meanwhile. */
#pragma once

#include <pthread.h>
#include <stddef.h>
#include <time.h>
#include "clock.h"
#include "codes.h"

#if defined __linux__ && !defined __USE_GNU
int pthread_getattr_np(pthread_t thread, pthread_attr_t *attributes);
#endif

typedef struct {
    void (*work)(void *);
    void *data;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t ended;
    int done;
} mechc_on_stack;

static inline void *mechc_run_on_stack(void *given)
{
    mechc_on_stack *job = (mechc_on_stack *)given;
    job->work(job->data);
    pthread_mutex_lock(&job->lock);
    job->done = 1;
    pthread_cond_signal(&job->ended);
    pthread_mutex_unlock(&job->lock);
    return 0;
}

/* The stack size for a scene of this width, in bytes; 0: the stack of the calling thread suffices. */
static inline size_t mechc_stack_of(int width)
{
    const size_t square = (size_t)width * (size_t)width * sizeof(double);
    return width < MECHC_WIDE ? 0 : ((size_t)16 << 20) + 80 * square;
}

/* The greatest stack use of an output of so many numbers, in bytes, of a scene with so many speeds and
 * constraint rows, whose widest output has `widest` numbers: its arrays in eight lanes, and those
 * in which it is solved; twice what was measured, or more (tests/trust/test_stacks.py). */
static inline size_t mechc_stack_of_output(int speeds, int rows, int widest, int width)
{
    const size_t square = (size_t)speeds * (size_t)speeds, matrices = rows ? 32 : 2;
    const size_t numbers = (size_t)widest + 4 * (size_t)width + matrices * square;
    return ((size_t)256 << 10) + 8 * sizeof(double) * numbers;
}

/* What the calling thread has left of its stack, in bytes; 0: not known. */
static inline size_t mechc_stack_left(void)
{
    static _Thread_local size_t lowest;
    const char here = 0;
#if defined __APPLE__
    const pthread_t self = pthread_self();
    if (!lowest) lowest = (size_t)pthread_get_stackaddr_np(self) - pthread_get_stacksize_np(self);
#elif defined __linux__
    pthread_attr_t attributes;
    if (!lowest && !pthread_getattr_np(pthread_self(), &attributes)) { /* reads a file: once */
        void *base;
        size_t size;
        if (!pthread_attr_getstack(&attributes, &base, &size)) lowest = (size_t)base;
        pthread_attr_destroy(&attributes);
    }
#endif
    return lowest && (size_t)&here > lowest ? (size_t)&here - lowest : 0;
}

static inline void mechc_forget_on_stack(mechc_on_stack *job)
{
    pthread_cond_destroy(&job->ended);
    pthread_mutex_destroy(&job->lock);
}

/* Begin work(data), with a stack of so many bytes, of which only what is touched takes memory; 0 if
 * there is none.  The job is ended, and until then stays where it is. */
static inline int mechc_begin_on_stack(mechc_on_stack *job, size_t bytes, void (*work)(void *),
                                       void *data)
{
    pthread_attr_t attributes;
    job->work = work, job->data = data, job->done = 0;
    if (pthread_attr_init(&attributes)) return 0;
    pthread_mutex_init(&job->lock, 0);
    pthread_cond_init(&job->ended, 0);
    const int made = !pthread_attr_setstacksize(&attributes, bytes)
                  && !pthread_create(&job->thread, &attributes, mechc_run_on_stack, job);
    pthread_attr_destroy(&attributes);
    if (!made) mechc_forget_on_stack(job);
    return made;
}

/* Wait for at most this many seconds, below one; returns 1 if the work is done. */
static inline int mechc_wait_on_stack(mechc_on_stack *job, double seconds)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += (long)(MECHC_NANOSECONDS * seconds);
    if (until.tv_nsec >= MECHC_NANOSECONDS) until.tv_sec++, until.tv_nsec -= MECHC_NANOSECONDS;
    pthread_mutex_lock(&job->lock);
    int late = 0;
    while (!job->done && !late) late = pthread_cond_timedwait(&job->ended, &job->lock, &until);
    const int done = job->done;
    pthread_mutex_unlock(&job->lock);
    return done;
}

static inline void mechc_end_on_stack(mechc_on_stack *job)
{
    pthread_join(job->thread, 0);
    mechc_forget_on_stack(job);
}

/* Do the work on a separate stack and wait for its end; 0 if there is no stack. */
static inline int mechc_with_stack(size_t bytes, void (*work)(void *), void *data)
{
    mechc_on_stack job;
    if (!bytes) work(data);
    else if (mechc_begin_on_stack(&job, bytes, work, data)) mechc_end_on_stack(&job);
    else return 0;
    return 1;
}
