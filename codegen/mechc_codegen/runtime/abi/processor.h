/* The instruction sets that this processor has and whose registers the system saves.
 *
 * __builtin_cpu_supports asks a table of the compiler's own library, which zig's leaves empty.
 * Leaves and bits of CPUID, and of the register XCR0: Intel 64 and IA-32 Architectures Software
 * Developer's Manual, volume 1, chapters 13 to 15, and volume 2, CPUID.
 */
#pragma once

#include <string.h>

#ifdef __x86_64__
#include <cpuid.h>

#define MECHC_SAVED_256 0x06u /* registers of 128 and of 256 bits */
#define MECHC_SAVED_512 0xe6u /* masks, and registers of 512 bits, too */

typedef struct {
    const char *name;
    unsigned leaf;
    int word, bit; /* words: eax, ebx, ecx, edx */
    unsigned saved;
} mechc_feature;

static const mechc_feature mechc_features[] = {
    {"fma", 1, 2, 12, MECHC_SAVED_256},      {"avx2", 7, 1, 5, MECHC_SAVED_256},
    {"avx512f", 7, 1, 16, MECHC_SAVED_512},  {"avx512dq", 7, 1, 17, MECHC_SAVED_512},
    {"avx512vl", 7, 1, 31, MECHC_SAVED_512},
};

static inline int mechc_processor_bit(unsigned leaf, int word, int bit)
{
    unsigned words[4];
    return __get_cpuid_count(leaf, 0, &words[0], &words[1], &words[2], &words[3])
        && (words[word] >> bit & 1u);
}

/* The register XCR0, whose reading is allowed where the system has set OSXSAVE. */
static inline unsigned mechc_saved_registers(void)
{
    unsigned low, high;
    if (!mechc_processor_bit(1, 2, 27)) return 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

static inline int mechc_processor_has(const char *name)
{
    const unsigned saved = mechc_saved_registers();
    for (size_t i = 0; i < sizeof mechc_features / sizeof *mechc_features; i++) {
        const mechc_feature *one = &mechc_features[i];
        if (!strcmp(name, one->name))
            return (saved & one->saved) == one->saved
                && mechc_processor_bit(one->leaf, one->word, one->bit);
    }
    return 0;
}
#endif
