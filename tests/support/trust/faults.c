/* For LD_PRELOAD: the n-th call on files below a folder fails, or the process is killed there.
 * fault_arm() sets n; calls are counted in the process that is armed and in what it starts with
 * FAULT_NUMBER in the environment.  Memory: the n-th allocation that compiled scenes ask for. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { FILES = 1, MEMORY = 2, KILL = 4 };

static long number, counted;
static int what, fired;
static char watched[PATH_MAX], happened[32];

void fault_arm(long n, int kinds, const char *folder)
{
    snprintf(watched, sizeof watched, "%s", folder);
    counted = 0, fired = 0, happened[0] = 0;
    what = kinds;
    __atomic_store_n(&number, n, __ATOMIC_SEQ_CST);
}

long fault_disarm(void)
{
    __atomic_store_n(&number, 0, __ATOMIC_SEQ_CST);
    return fired;
}

const char *fault_kind(void) { return happened; }

__attribute__((constructor)) static void from_environment(void)
{
    const char *n = getenv("FAULT_NUMBER"), *folder = getenv("FAULT_FOLDER");
    if (n && folder) fault_arm(atol(n), FILES, folder);
}

/* That it happened, for whoever started this process: an empty file beside the folder. */
static void leave_word(void)
{
    char path[PATH_MAX + 8];
    snprintf(path, sizeof path, "%s.fired", watched);
    const long file = syscall(SYS_openat, AT_FDCWD, path, O_CREAT | O_WRONLY, 0600);
    if (file >= 0) syscall(SYS_close, file);
}

/* Whether this call is the one. */
static int fails(int kind, const char *name)
{
    const long n = __atomic_load_n(&number, __ATOMIC_SEQ_CST);
    if (!n || !(what & kind)) return 0;
    if (__atomic_add_fetch(&counted, 1, __ATOMIC_SEQ_CST) != n) return 0;
    fired = 1;
    leave_word();
    snprintf(happened, sizeof happened, "%s", name);
    if (what & KILL) kill(getpid(), SIGKILL);
    return 1;
}

static int below(const char *path)
{
    return number && path && !strncmp(path, watched, strlen(watched));
}

static int ours(int descriptor)
{
    char link[64], path[PATH_MAX];
    if (!number) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    const ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return below(path);
}

#define REAL(type, name, ...) \
    static type (*real)(__VA_ARGS__); \
    if (!real) real = (type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)
#define FAIL(condition, name, number_, result) \
    if ((condition) && fails(FILES, name)) { errno = number_; return result; }

#define OPEN(name) \
    int name(const char *path, int flags, ...) \
    { \
        va_list list; \
        va_start(list, flags); \
        const int mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(list, int) : 0; \
        va_end(list); \
        REAL(int, name, const char *, int, ...); \
        FAIL(below(path), "open", flags & O_CREAT ? ENOSPC : EIO, -1) \
        return real(path, flags, mode); \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name) \
    int name(int at, const char *path, int flags, ...) \
    { \
        va_list list; \
        va_start(list, flags); \
        const int mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(list, int) : 0; \
        va_end(list); \
        REAL(int, name, int, const char *, int, ...); \
        FAIL(below(path), "open", flags & O_CREAT ? ENOSPC : EIO, -1) \
        return real(at, path, flags, mode); \
    }
OPENAT(openat)
OPENAT(openat64)

ssize_t write(int to, const void *data, size_t size)
{
    REAL(ssize_t, write, int, const void *, size_t);
    if (ours(to) && fails(FILES, "write")) {
        const ssize_t some = real(to, data, size / 2); /* a disk that is full in the middle */
        (void)some;
        errno = ENOSPC;
        return -1;
    }
    return real(to, data, size);
}

ssize_t read(int from, void *data, size_t size)
{
    REAL(ssize_t, read, int, void *, size_t);
    FAIL(ours(from), "read", EIO, -1)
    return real(from, data, size);
}

#define PWRITE(name, offset) \
    ssize_t name(int to, const void *data, size_t size, offset at) \
    { \
        REAL(ssize_t, name, int, const void *, size_t, offset); \
        FAIL(ours(to), "write", ENOSPC, -1) \
        return real(to, data, size, at); \
    }
PWRITE(pwrite, off_t)
PWRITE(pwrite64, off64_t)

int fsync(int descriptor)
{
    REAL(int, fsync, int);
    FAIL(ours(descriptor), "fsync", EIO, -1)
    return real(descriptor);
}

int rename(const char *from, const char *to)
{
    REAL(int, rename, const char *, const char *);
    FAIL(below(to), "rename", ENOSPC, -1)
    return real(from, to);
}

int renameat(int at, const char *from, int where, const char *to)
{
    REAL(int, renameat, int, const char *, int, const char *);
    FAIL(below(to), "rename", ENOSPC, -1)
    return real(at, from, where, to);
}

int mkdir(const char *path, mode_t mode)
{
    REAL(int, mkdir, const char *, mode_t);
    FAIL(below(path), "mkdir", ENOSPC, -1)
    return real(path, mode);
}

int unlink(const char *path)
{
    REAL(int, unlink, const char *);
    FAIL(below(path), "unlink", EIO, -1)
    return real(path);
}

void *mmap(void *at, size_t size, int protection, int flags, int descriptor, off_t offset)
{
    REAL(void *, mmap, void *, size_t, int, int, int, off_t);
    FAIL(descriptor >= 0 && ours(descriptor), "mmap", ENOMEM, MAP_FAILED)
    return real(at, size, protection, flags, descriptor, offset);
}

/* Whether who asks for memory is a compiled scene or the native part of mechc. */
static int asked_by_us(void *caller)
{
    Dl_info from;
    if (!number || !(what & MEMORY) || !dladdr(caller, &from) || !from.dli_fname) return 0;
    return strstr(from.dli_fname, "scene") || strstr(from.dli_fname, "/mechc/native/");
}

extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);

void *malloc(size_t size)
{
    if (asked_by_us(__builtin_return_address(0)) && fails(MEMORY, "malloc")) return NULL;
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    if (asked_by_us(__builtin_return_address(0)) && fails(MEMORY, "calloc")) return NULL;
    return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
    if (asked_by_us(__builtin_return_address(0)) && fails(MEMORY, "realloc")) return NULL;
    return __libc_realloc(old, size);
}
