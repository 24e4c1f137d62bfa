/* Ends a section of counting under callgrind: what was counted since the last mark is written. */
#include <valgrind/callgrind.h>

void mark(const char *section)
{
    CALLGRIND_DUMP_STATS_AT(section);
}
