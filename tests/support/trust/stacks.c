/* How much of its stack work takes: threads of 16 MiB and more, as mechc makes them, are given stacks
 * whose touched pages are counted when they end.  Below LD_PRELOAD, or called by its functions. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#define COUNTED ((size_t)16 << 20)

typedef int creating(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);

typedef struct {
    void *(*start)(void *);
    void *arg;
    char *base;
    size_t size;
} counted;

static size_t most_taken, given_then;

size_t stack_taken(void) { return most_taken; }

size_t stack_given(void) { return given_then; }

void stack_forget(void) { most_taken = 0; }

static void *count(void *given)
{
    const counted job = *(counted *)given;
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), pages = job.size / page;
    unsigned char *touched = malloc(pages);
    void *found = job.start(job.arg);
    size_t first = 0;
    if (mincore(job.base, job.size, touched)) abort();
    while (first < pages && !(touched[first] & 1)) first++;
    if (job.size - first * page > most_taken) {
        most_taken = job.size - first * page;
        given_then = job.size;
    }
    free(touched);
    free(given);
    if (job.size > ((size_t)1 << 18)) /* what lies far below this frame is needed no more */
        madvise(job.base, job.size - ((size_t)1 << 18), MADV_DONTNEED);
    return found;
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *),
                   void *arg)
{
    creating *create = (creating *)dlsym(RTLD_NEXT, "pthread_create");
    size_t size = 0;
    pthread_attr_t own;
    if (attributes) pthread_attr_getstacksize(attributes, &size);
    if (size < COUNTED) return create(thread, attributes, start, arg);
    const int kind = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
    counted *job = malloc(sizeof *job);
    char *base = mmap(0, size, PROT_READ | PROT_WRITE, kind, -1, 0); /* never given back */
    if (!job || base == MAP_FAILED || madvise(base, size, MADV_NOHUGEPAGE)) abort();
    *job = (counted){start, arg, base, size};
    pthread_attr_init(&own);
    if (pthread_attr_setstack(&own, base, size)) abort();
    const int failed = create(thread, &own, count, job);
    pthread_attr_destroy(&own);
    return failed;
}

typedef struct {
    void (*f)(double, double *, double *, void *);
    double *y, *out;
    void *data;
} calling;

static void *call(void *given)
{
    const calling *job = given;
    job->f(0.0, job->y, job->out, job->data);
    return 0;
}

/* f in a thread of its own; stack_taken() then tells what it took. */
int stack_of_call(void (*f)(double, double *, double *, void *), double *y, double *out, void *data)
{
    calling job = {f, y, out, data};
    pthread_t thread;
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, (size_t)256 << 20);
    const int failed = pthread_create(&thread, &attributes, call, &job);
    pthread_attr_destroy(&attributes);
    return failed || pthread_join(thread, 0);
}
