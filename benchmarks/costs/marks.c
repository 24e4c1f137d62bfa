/* Ends a section of counting under callgrind: what was counted since the last mark is written.
 *
 * Loaded before all other libraries, it is the clock too, which goes on by a nanosecond a call:
 * under valgrind work takes long, and how long differs from run to run.
 */
#include <time.h>
#include <valgrind/callgrind.h>

void mark(const char *section)
{
    CALLGRIND_DUMP_STATS_AT(section);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static long calls;
    (void)clock;
    now->tv_sec = 1000 + ++calls / 1000000000;
    now->tv_nsec = calls % 1000000000;
    return 0;
}
