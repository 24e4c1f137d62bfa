/* Reads a scene from bytes, all of which is checked: they may come from anybody. */
#pragma once

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "dynamics/sizes.h"
#include "general/counts.h"
#include "tape/series.h"
#include "tape/tape.h"

#define MECHC_TAPE_MAGIC "mechc tape 6\0\0\0"

/* The content of each part of the bytes, in their order. */
enum {
    MECHC_TAPE_UNIT, MECHC_TAPE_METADATA, MECHC_TAPE_COUNTS, MECHC_TAPE_SLIDES,
    MECHC_TAPE_OF_TREE, MECHC_TAPE_ANGLES, MECHC_TAPE_PERIODIC, MECHC_TAPE_KNOTS, MECHC_TAPE_KNOTS_BEGIN, MECHC_TAPE_KNOTS_PERIOD,
    MECHC_TAPE_NUMBERS, MECHC_TAPE_TAPES, MECHC_TAPE_OPERATIONS_OF_ALL, MECHC_TAPE_CALLED_TAPES,
    MECHC_TAPE_BY_NAME, MECHC_TAPE_OUTPUTS, MECHC_TAPE_NAMES, MECHC_TAPE_DEFAULTS, MECHC_TAPE_SERIES, MECHC_TAPE_ROOTS,
    MECHC_TAPE_LEFT, MECHC_TAPE_RIGHT, MECHC_TAPE_JACOBIANS, MECHC_TAPE_TABLES, MECHC_TAPE_NUMBERS_OF_TABLES,
    MECHC_TAPE_TEXTS,
    MECHC_TAPE_SECTION_COUNT
};

typedef struct {
    const unsigned char *content;
    size_t size;
} mechc_section;

typedef struct {
    mechc_section sections[MECHC_TAPE_SECTION_COUNT];
    mechc_counts *counts;
    mechc_series_counts *series;
    unsigned char slides[MECHC_NQ_MAX + MECHC_NU_MAX];
} mechc_tape_reader;

/* Why the bytes are no scene for this unit, or NULL. */
#define MECHC_TAPE_REQUIRE(condition, why) \
    if (!(condition)) return why

static size_t mechc_section_count(const mechc_section *section, size_t each) { return section->size / each; }

static const char *mechc_read_sections(const unsigned char *bytes, size_t size, mechc_section *sections)
{
    size_t at = sizeof MECHC_TAPE_MAGIC;
    MECHC_TAPE_REQUIRE(size >= at && !memcmp(bytes, MECHC_TAPE_MAGIC, at), "it is no tape, or of another version");
    for (int i = 0; i < MECHC_TAPE_SECTION_COUNT; i++) {
        uint64_t length;
        MECHC_TAPE_REQUIRE(size - at >= sizeof length, "it ends early");
        memcpy(&length, bytes + at, sizeof length);
        at += sizeof length;
        MECHC_TAPE_REQUIRE(length < size - at && 8 - length % 8 <= size - at - length, "it ends early");
        sections[i] = (mechc_section){bytes + at, (size_t)length};
        at += (size_t)length + 8 - (size_t)length % 8;
        MECHC_TAPE_REQUIRE(bytes[at - 1] == 0, "a part of it has no end"); /* which texts end with */
    }
    MECHC_TAPE_REQUIRE(at == size, "something follows its end");
    return NULL;
}

/* Whether whole numbers of a section are at least `least` and below `most`. */
static int mechc_all_within(const mechc_section *section, int32_t least, int32_t most)
{
    const int32_t *values = (const int32_t *)section->content;
    for (size_t i = 0; i < mechc_section_count(section, sizeof *values); i++)
        if (values[i] < least || values[i] >= most) return 0;
    return 1;
}

static const char *mechc_read_counts(mechc_tape_reader *reader)
{
    const mechc_section *section = reader->sections + MECHC_TAPE_COUNTS;
    const int32_t *given = (const int32_t *)section->content;
    mechc_counts *c = reader->counts;
    int *const counts[] = {&c->nq, &c->nu, &c->nh, &c->nc, &c->np, &c->nk, &c->saved, &c->turns, &c->ni,
                           &c->states, &c->switches, &c->features, &c->knotted, &c->multipliers, &c->lockstep,
                           &c->blocks_kept, &c->row_blocks, &c->identity_kinematics, &c->own,
                           &c->links, &c->planar, &c->columns, &c->speeds_shared, &c->carried, &c->factors, &c->moving_cuts,
                           &c->pairs, &c->moments, &c->several_loops};
    const int most[] = {MECHC_NQ_MAX, MECHC_NU_MAX, MECHC_NH_MAX, MECHC_NC_MAX, MECHC_NP_MAX, MECHC_NK_MAX,
                        MECHC_SAVED_MAX, MECHC_TURNS_MAX, MECHC_NI_MAX, MECHC_NQ_MAX, MECHC_SWITCHES_MAX,
                        MECHC_FEATURES_MAX, MECHC_KNOTTED_MAX, 1, 1, MECHC_BLOCKS_KEPT_MAX,
                        MECHC_BLOCKS_CODE ? MECHC_NC_MAX : 0, 1, MECHC_OWN_MAX,
                        MECHC_LINKS_MAX, 1, MECHC_COLUMNS_MAX, 1, MECHC_CARRIED_MAX, MECHC_FACTORS_MAX, 1,
                        MECHC_PAIRS_MAX, 1, 1};
    const size_t count = sizeof most / sizeof *most;
    MECHC_TAPE_REQUIRE(section->size == count * sizeof *given, "its counts are not whole");
    for (size_t i = 0; i < count; i++) {
        MECHC_TAPE_REQUIRE(given[i] >= 0 && given[i] <= most[i], "a count is beyond the bounds");
        *counts[i] = given[i];
    }
    MECHC_TAPE_REQUIRE(c->nq > 0 && c->nu > 0 && c->nh <= c->nc && c->states <= c->nq
                           && c->features + c->knotted <= c->switches,
                       "its counts contradict each other");
    MECHC_TAPE_REQUIRE(!MECHC_KIND_ONE_FREEDOM || c->nc == c->nu - 1, "it is of another kind");
    MECHC_TAPE_REQUIRE((c->nc > 0) == MECHC_KIND_ROWS && (c->links > 0) == MECHC_KIND_WALKED
                           && (MECHC_KIND_WALKED || (c->nh > 0) == MECHC_KIND_LOOPS),
                       "it is of another kind");
    const int arm = c->planar ? 2 : 3, columns = c->columns * (arm == 2 ? 3 : 6), masses = arm == 2 ? 4 : 10;
    const int cut = 3 * arm + (c->moments ? 2 * arm - 3 : 0);
    const int kept = columns + c->links * (arm + masses) + (c->nc ? c->links * arm + c->pairs * cut : 0);
    MECHC_TAPE_REQUIRE(!c->links
                           || (c->nc <= c->pairs && kept <= c->saved && (c->speeds_shared || c->columns == c->nu)
                               && !(c->speeds_shared && (c->carried || c->moving_cuts))
                               && !(c->carried && c->pairs > c->nc) && (c->nc > 0 || c->pairs == 0)),
                       "its counts contradict each other");
    c->of_tree = c->links ? kept : 0;
    MECHC_TAPE_REQUIRE(!c->own || !c->nc || c->multipliers, "its counts contradict each other");
    MECHC_TAPE_REQUIRE((!c->row_blocks || c->nc <= c->nu) && (!c->identity_kinematics || c->nq == c->nu),
                       "its counts contradict each other");
    return NULL;
}

static const char *mechc_read_tables(mechc_tape_reader *reader)
{
    const mechc_section *s = reader->sections;
    mechc_counts *c = reader->counts;
    const size_t states = (size_t)(c->nq + c->nu), slides = mechc_section_count(s + MECHC_TAPE_SLIDES, 4);
    MECHC_TAPE_REQUIRE(slides == 0 || slides == states, "a table is not whole");
    for (size_t i = 0; i < slides; i++)
        reader->slides[i] = ((const int32_t *)s[MECHC_TAPE_SLIDES].content)[i] != 0;
    c->slides = slides ? reader->slides : NULL;
    c->angles = (const int *)s[MECHC_TAPE_ANGLES].content;
    c->periodic = (const int *)s[MECHC_TAPE_PERIODIC].content;
    c->angle_count = (int)mechc_section_count(s + MECHC_TAPE_ANGLES, 4);
    c->periodic_count = (int)mechc_section_count(s + MECHC_TAPE_PERIODIC, 4);
    MECHC_TAPE_REQUIRE(c->angle_count <= c->nq && c->periodic_count <= c->nq
                           && mechc_all_within(s + MECHC_TAPE_ANGLES, 0, c->nq)
                           && mechc_all_within(s + MECHC_TAPE_PERIODIC, 0, c->nq),
                       "an angle is no coordinate");
    if (!c->knotted) return NULL;
    c->knots = (const double *)s[MECHC_TAPE_KNOTS].content;
    c->knots_begin = (const int *)s[MECHC_TAPE_KNOTS_BEGIN].content;
    c->knots_period = (const double *)s[MECHC_TAPE_KNOTS_PERIOD].content;
    const int count = (int)mechc_section_count(s + MECHC_TAPE_KNOTS, sizeof(double));
    MECHC_TAPE_REQUIRE(s[MECHC_TAPE_KNOTS].size / sizeof(double) < INT32_MAX
                           && mechc_section_count(s + MECHC_TAPE_KNOTS_BEGIN, 4) == (size_t)c->knotted + 1
                           && mechc_section_count(s + MECHC_TAPE_KNOTS_PERIOD, 8) == (size_t)c->knotted
                           && mechc_all_within(s + MECHC_TAPE_KNOTS_BEGIN, 0, count + 1),
                       "a table of knots is not whole");
    for (int i = 0; i < c->knotted; i++)
        MECHC_TAPE_REQUIRE(c->knots_begin[i] < c->knots_begin[i + 1], "a table of knots is not whole");
    return NULL;
}

/* The tables of a tree, one after the other: a link's parent comes before it, and what is eliminated at it
 * stays within what is kept. */
static const char *mechc_read_tree(mechc_tape_reader *reader)
{
    mechc_counts *c = reader->counts;
    const mechc_section *section = reader->sections + MECHC_TAPE_OF_TREE;
    const int *at = (const int *)section->content, carried = c->carried > 0;
    const int sizes[] = {c->links, c->links + 1, c->columns, 2 * c->pairs, c->nc ? c->nc + 1 : 0,
                         carried * (c->links + 1), carried * c->nc,
                         carried * c->links, carried * c->nu, carried * (c->nu + 1)};
    const int **const tables[] = {&c->parent, &c->first_column, &c->column_speed, &c->cut, &c->first_pair,
                                  &c->first_row, &c->cut_place, &c->handed_to, &c->row_taken, &c->first_factor};
    size_t count = 0;
    if (!c->links) return NULL;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) count += (size_t)sizes[i];
    MECHC_TAPE_REQUIRE(mechc_section_count(section, sizeof *at) == count, "the tables of its links are not whole");
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; at += sizes[i++]) *tables[i] = at;
    int sound = c->first_column[0] == 0 && c->first_column[c->links] == c->columns;
    for (int i = 0; i < c->links; i++)
        sound &= c->parent[i] >= -1 && c->parent[i] < i && c->first_column[i] <= c->first_column[i + 1];
    unsigned char moved[MECHC_NU_MAX] = {0}, filled[MECHC_AT_LEAST_ONE(MECHC_CARRIED_MAX)] = {0};
    for (int i = 0; i < c->columns; i++) {
        const int speed = c->column_speed[i], within = speed >= 0 && speed < c->nu;
        if (within) moved[speed] = 1;
        sound &= within;
    }
    for (int i = 0; i < c->nu; i++) sound &= moved[i];
    for (int i = 0; i < 2 * c->pairs; i++) sound &= c->cut[i] >= -1 && c->cut[i] < c->links;
    for (int i = 0; i < c->nc; i++) sound &= c->first_pair[i] >= 0 && c->first_pair[i] < c->first_pair[i + 1];
    sound &= !c->nc || (c->first_pair[0] == 0 && c->first_pair[c->nc] == c->pairs);
    MECHC_TAPE_REQUIRE(sound, "the tables of its links are not sound");
    if (!carried) return NULL;
    sound = c->first_row[0] == 0 && c->first_row[c->links] == c->carried;
    for (int i = 0; i < c->nc; i++) {
        const int place = c->cut_place[i], within = place >= 0 && place < c->carried;
        if (within) filled[place] = 1;
        sound &= within && (c->cut[2 * i] < 0) != (c->cut[2 * i + 1] < 0);
    }
    for (int i = 0; i < c->links; i++) sound &= c->first_row[i] <= c->first_row[i + 1];
    for (int i = 0; sound && i < c->links; i++) {
        int rows = c->first_row[i + 1] - c->first_row[i];
        for (int k = c->first_column[i + 1] - 1; rows > 0 && k >= c->first_column[i]; k--, rows--)
            sound &= c->first_factor[k] >= 0 && c->first_factor[k] <= c->factors - (rows - 1);
        if (rows == 0 || c->parent[i] < 0) continue;
        sound &= c->handed_to[i] >= 0 && c->handed_to[i] <= c->carried - rows;
        if (sound) memset(filled + c->handed_to[i], 1, (size_t)rows);
    }
    for (int i = 0; i < c->carried; i++) sound &= filled[i]; /* before it is read, or beyond the bounds */
    MECHC_TAPE_REQUIRE(sound, "the tables of its rows are not sound");
    return NULL;
}

/* Lookup tables: all that an index of a piece or of a coefficient can reach is there. */
static const char *mechc_read_lookups(const mechc_tape_reader *reader)
{
    const mechc_section *s = reader->sections;
    const mechc_tape_table *tables = (const mechc_tape_table *)s[MECHC_TAPE_TABLES].content;
    const size_t numbers = mechc_section_count(s + MECHC_TAPE_NUMBERS_OF_TABLES, sizeof(double));
    MECHC_TAPE_REQUIRE(numbers < INT32_MAX, "its tables are too large");
    for (size_t i = 0; i < mechc_section_count(s + MECHC_TAPE_TABLES, sizeof *tables); i++) {
        const mechc_tape_table *table = tables + i;
        int sound = (table->axis_count == 1 || table->axis_count == 2) && table->degree >= 0
                 && table->degree <= MECHC_TAPE_HIGHEST_DEGREE && table->coefficients >= 0
                 && (size_t)table->coefficients <= numbers;
        size_t left = sound ? numbers - (size_t)table->coefficients : 0; /* for the coefficients */
        for (int k = 0; sound && k < table->axis_count; k++) {
            sound = table->order[k] >= 0 && table->order[k] <= table->degree && table->pieces[k] > 0
                 && table->starts[k] >= 0 && (size_t)table->starts[k] < numbers
                 && (size_t)table->pieces[k] < numbers - (size_t)table->starts[k]; /* a period follows */
            left /= sound ? (size_t)(table->degree + 1) * (size_t)table->pieces[k] : 1;
        }
        MECHC_TAPE_REQUIRE(sound && left > 0, "a table is not sound");
    }
    return NULL;
}

static const char *mechc_read_series(mechc_tape_reader *reader)
{
#if MECHC_TAPES_OF_SERIES
    const mechc_section *s = reader->sections;
    const mechc_counts *c = reader->counts;
    mechc_series_counts *series = reader->series;
    int *const counts[] = {&series->row, &series->sums, &series->kept, &series->integrated, &series->hides,
                           &series->root_count, &series->few, &series->momenta};
    const int most[] = {MECHC_SERIES_MAX, MECHC_SERIES_SUMS_MAX, MECHC_SERIES_KEPT_MAX,
                        MECHC_SERIES_INTEGRATED_MAX, 1, MECHC_SERIES_ROOTS_MAX, 1, 1};
    const size_t count = sizeof most / sizeof *most;
    memset(series, 0, sizeof *series);
    if (!s[MECHC_TAPE_SERIES].size) return NULL; /* it has none */
    MECHC_TAPE_REQUIRE(s[MECHC_TAPE_SERIES].size == count * sizeof(int32_t), "its series is not whole");
    for (size_t i = 0; i < count; i++) {
        const int32_t given = ((const int32_t *)s[MECHC_TAPE_SERIES].content)[i];
        MECHC_TAPE_REQUIRE(given >= 0 && given <= most[i], "a count of its series is beyond the bounds");
        *counts[i] = given;
    }
    MECHC_TAPE_REQUIRE(c->nq + c->nu <= series->integrated && series->integrated <= series->row
                           && series->sums >= !series->few
                           && mechc_section_count(s + MECHC_TAPE_ROOTS, 4) == (size_t)series->root_count
                           && mechc_section_count(s + MECHC_TAPE_LEFT, 4) == (size_t)series->sums
                           && mechc_section_count(s + MECHC_TAPE_RIGHT, 4) == (size_t)series->sums
                           && mechc_all_within(s + MECHC_TAPE_ROOTS, 0, series->row)
                           && mechc_all_within(s + MECHC_TAPE_LEFT, 0, series->row)
                           && mechc_all_within(s + MECHC_TAPE_RIGHT, 0, series->row),
                       "its series is not whole");
    series->roots = (const int *)s[MECHC_TAPE_ROOTS].content;
    series->left = (const int *)s[MECHC_TAPE_LEFT].content;
    series->right = (const int *)s[MECHC_TAPE_RIGHT].content;
#else
    (void)reader;
#endif
    return NULL;
}

/* The arrays of a function, with the number of elements of each, and whether it writes them. */
enum { MECHC_TAPE_WRITTEN = 1 << 24 };

static int mechc_tape_arrays(const mechc_counts *c, const mechc_series_counts *series, int function, int width,
                             int sizes[MECHC_TAPE_MOST_ARRAYS])
{
    const int free = c->nu > c->nc ? c->nu - c->nc : 0;
    const int arm = c->planar ? 2 : 3, dim = c->planar ? 3 : 6, masses = c->planar ? 4 : 10;
#define MECHC_TAPE_SIZE(name, size) const int of_##name = size;
    MECHC_TAPE_ARRAYS(MECHC_TAPE_SIZE)
#undef MECHC_TAPE_SIZE
#define A(name) of_##name,
#define W(name) of_##name | MECHC_TAPE_WRITTEN,
#define MECHC_TAPE_SIZES(name, arrays)                       \
    if (function == MECHC_TAPE_OF_##name) {                  \
        const int found[] = {arrays};                        \
        memcpy(sizes, found, sizeof found);                  \
        count = (int)(sizeof found / sizeof *found);         \
    }
    int count = 0;
    MECHC_TAPE_FUNCTIONS(MECHC_TAPE_SIZES)
#undef MECHC_TAPE_SIZES
#undef W
#undef A
    for (int i = count; i < MECHC_TAPE_MOST_ARRAYS; i++) sizes[i] = 0;
    return count;
}

/* Which of a, b, c are registers that an operation reads, as bits. */
static int mechc_tape_reads(int operation)
{
    switch (operation) {
    case MECHC_TAPE_NUMBER:
    case MECHC_TAPE_SCALAR:
    case MECHC_TAPE_LOAD:
    case MECHC_TAPE_INPUT:
    case MECHC_TAPE_CLEAR:
    case MECHC_TAPE_INPUTS_READ:
    case MECHC_TAPE_END: return 0;
    case MECHC_TAPE_STORE: return 4;
    case MECHC_TAPE_SINE_COSINE:
    case MECHC_TAPE_TURN:
    case MECHC_TAPE_NEGATE:
    case MECHC_TAPE_SQRT:
    case MECHC_TAPE_NOT:
    case MECHC_TAPE_CALL:
    case MECHC_TAPE_RETURN: return 1;
    case MECHC_TAPE_FMA:
    case MECHC_TAPE_FNMA:
    case MECHC_TAPE_FMS:
    case MECHC_TAPE_FNMS:
    case MECHC_TAPE_SELECT: return 7;
    }
    return 3;
}

/* What is known at an operation: the registers that have a value, the inputs that were read. */
typedef struct {
    const int *sizes;
    int function, registers, first_input, last_input;
    unsigned char known[MECHC_TAPE_MOST_REGISTERS];
} mechc_tape_place;

/* Whether an operation reads what is known, and stays within constants and arrays. */
static int mechc_is_sound(const mechc_tape_reader *reader, const mechc_operation *o, mechc_tape_place *place)
{
    const size_t numbers = mechc_section_count(reader->sections + MECHC_TAPE_NUMBERS, sizeof(double));
    const size_t lookups = mechc_section_count(reader->sections + MECHC_TAPE_TABLES, sizeof(mechc_tape_table));
    const uint16_t operands[] = {o->a, o->b, o->c};
    const int reads = mechc_tape_reads(o->operation), f = place->function;
    const int angle = o->operation == MECHC_TAPE_SINE_COSINE || o->operation == MECHC_TAPE_TURN;
    const int size = o->a < MECHC_TAPE_MOST_ARRAYS ? place->sizes[o->a] & (MECHC_TAPE_WRITTEN - 1) : 0;
    const int written = o->a < MECHC_TAPE_MOST_ARRAYS && place->sizes[o->a] & MECHC_TAPE_WRITTEN;
    for (int i = 0; i < 3; i++)
        if (reads >> i & 1 && !(operands[i] < place->registers && place->known[operands[i]])) return 0;
    if (o->to >= place->registers && place->registers > 0) return 0;
    switch (o->operation) {
    case MECHC_TAPE_STORE: return written && o->b < size;
    case MECHC_TAPE_CLEAR: return written && o->b <= size;
    case MECHC_TAPE_RETURN:
    case MECHC_TAPE_END: return 1;
    case MECHC_TAPE_INPUTS_READ:
        place->first_input = o->a, place->last_input = o->b;
        return (f == MECHC_TAPE_OF_plain || f == MECHC_TAPE_OF_solved || f == MECHC_TAPE_OF_adjoint
                || f == MECHC_TAPE_OF_motion || f == MECHC_TAPE_OF_tree_motion
                || ((f == MECHC_TAPE_OF_configuration || f == MECHC_TAPE_OF_tree_configuration) && !o->c))
            && o->a < o->b && o->b <= reader->counts->ni;
    }
    if (place->registers == 0 || o->operation >= MECHC_TAPE_OPERATION_COUNT) return 0;
    place->known[o->to] = 1;
    if (angle) {
        if (o->b >= place->registers) return 0;
        place->known[o->b] = 1;
    }
    switch (o->operation) {
    case MECHC_TAPE_NUMBER: return o->a < numbers;
    case MECHC_TAPE_SCALAR: return o->a < (f == MECHC_TAPE_OF_series_next ? 3 : 1);
    case MECHC_TAPE_LOAD: return o->b < size;
    case MECHC_TAPE_INPUT: return o->a < place->last_input - place->first_input;
    case MECHC_TAPE_TURN:
        return (f == MECHC_TAPE_OF_configuration || f == MECHC_TAPE_OF_tree_configuration)
            && o->c < reader->counts->turns;
    case MECHC_TAPE_CALL: return o->b < MECHC_TAPE_CALL_COUNT;
    case MECHC_TAPE_CALL2: return o->c < MECHC_TAPE_CALL_OF_TWO_COUNT;
    case MECHC_TAPE_LOOKUP: return o->c < lookups;
    }
    return 1;
}

/* Whether a tape can run as this function, or as an output of that width. */
static int mechc_tape_fits(const mechc_tape_reader *reader, int32_t tape, int function, int width)
{
    const mechc_section *s = reader->sections;
    const size_t tapes = mechc_section_count(s + MECHC_TAPE_TAPES, sizeof(mechc_tape));
    const size_t operations = mechc_section_count(s + MECHC_TAPE_OPERATIONS_OF_ALL, sizeof(mechc_operation));
    int sizes[MECHC_TAPE_MOST_ARRAYS];
    if (tape < 0 || (size_t)tape >= tapes) return 0;
    const mechc_tape *one = (const mechc_tape *)s[MECHC_TAPE_TAPES].content + tape;
    if (one->first < 0 || one->count < 1 || one->registers < 0 || one->registers > MECHC_TAPE_MOST_REGISTERS
        || (size_t)one->first > operations || (size_t)one->count > operations - (size_t)one->first)
        return 0;
    mechc_tape_arrays(reader->counts, reader->series, function, width, sizes);
    mechc_tape_place place = {.sizes = sizes, .function = function, .registers = one->registers};
    const mechc_operation *o = (const mechc_operation *)s[MECHC_TAPE_OPERATIONS_OF_ALL].content + one->first;
    for (int32_t i = 0; i < one->count; i++)
        if (!mechc_is_sound(reader, o + i, &place)) return 0;
    return o[one->count - 1].operation == MECHC_TAPE_END;
}

/* Whether the unit calls this function of a scene with these counts. */
static int mechc_tape_is_called(const mechc_counts *c, const mechc_series_counts *series, int function)
{
    switch (function) {
    case MECHC_TAPE_OF_hoist: return 1;
    case MECHC_TAPE_OF_configuration:
    case MECHC_TAPE_OF_motion: return !c->links;
    case MECHC_TAPE_OF_tree_configuration:
    case MECHC_TAPE_OF_tree_motion: return c->links > 0;
    case MECHC_TAPE_OF_series_start:
    case MECHC_TAPE_OF_series_next: return series->row > 0;
    case MECHC_TAPE_OF_series_solve: return series->row > 0 && series->momenta;
    }
    return c->row_blocks > 0;
}

/* The functions that the unit calls. */
static const char *mechc_read_called(mechc_tape_reader *reader, mechc_tapes *tapes)
{
    const mechc_section *s = reader->sections;
    const mechc_counts *c = reader->counts;
    MECHC_TAPE_REQUIRE(s[MECHC_TAPE_CALLED_TAPES].size == MECHC_TAPE_OF_plain * sizeof(int32_t)
                           && s[MECHC_TAPE_BY_NAME].size == MECHC_TAPE_NAMED_COUNT * sizeof(int32_t),
                       "its functions are not whole");
    tapes->called = (const int32_t *)s[MECHC_TAPE_CALLED_TAPES].content;
    for (int f = 0; f < MECHC_TAPE_OF_plain; f++) {
        if (!mechc_tape_is_called(c, reader->series, f)) continue;
        MECHC_TAPE_REQUIRE(mechc_tape_fits(reader, tapes->called[f], f, 0), "a function is not sound");
    }
    return NULL;
}

/* The functions of states that it calls by their names; they say which derivatives a motion has. */
static const char *mechc_read_named(mechc_tape_reader *reader, mechc_tapes *tapes)
{
    mechc_counts *c = reader->counts;
    const int32_t *named = (const int32_t *)reader->sections[MECHC_TAPE_BY_NAME].content;
    const int states = c->nq + c->nu, motion = c->nu + c->nc;
    const int varies = named[MECHC_TAPE_NAMED_residual_adjoint] >= 0;
#define MECHC_TAPE_CHECK(name, function, width, needed)                                                       \
    MECHC_TAPE_REQUIRE((named[MECHC_TAPE_NAMED_##name] == -1 && !(needed))                                    \
                           || mechc_tape_fits(reader, named[MECHC_TAPE_NAMED_##name], MECHC_TAPE_OF_##function, \
                                              width),                                                         \
                       "a function is not sound");
    MECHC_TAPE_NAMED(MECHC_TAPE_CHECK)
#undef MECHC_TAPE_CHECK
    tapes->named = named;
    c->varies = varies;
    c->gradient = named[MECHC_TAPE_NAMED_constraint_gradient] >= 0;
    c->gap_by_parameters = named[MECHC_TAPE_NAMED_constraints_by_parameters] >= 0;
    c->gap_by_inputs = named[MECHC_TAPE_NAMED_constraints_by_inputs] >= 0;
    c->gap_rate_by_parameters = named[MECHC_TAPE_NAMED_velocity_constraints_by_parameters] >= 0;
    c->gap_rate_by_inputs = named[MECHC_TAPE_NAMED_velocity_constraints_by_inputs] >= 0;
    return NULL;
}

/* Whether such an output is one that its Jacobian gives. */
static int mechc_jacobian_fits(const mechc_tape_reader *reader, const mechc_tapes *tapes, const mechc_tape_output *o)
{
    const mechc_counts *c = reader->counts;
    const size_t count = mechc_section_count(reader->sections + MECHC_TAPE_JACOBIANS, sizeof(mechc_tape_jacobian));
    if (o->tape < 0 || (size_t)o->tape >= count) return 0;
    const mechc_tape_jacobian *by = tapes->jacobians + o->tape;
    const int columns = by->columns, motion = c->nu + c->nc;
    if (columns != c->nq + c->nu && columns != c->np && columns != c->ni) return 0;
    if (by->first < 0 || by->first > columns) return 0;
    if (!mechc_tape_fits(reader, by->residual, MECHC_TAPE_OF_solved, motion * columns)) return 0;
    if (o->way == MECHC_BY_OWN_JACOBIAN)
        return o->width == c->own * columns
            && mechc_tape_fits(reader, by->own, MECHC_TAPE_OF_solved, c->own * (columns + motion));
    return o->width == (c->nq + c->nu) * columns
        && (by->rates == -1 ? c->identity_kinematics : mechc_tape_fits(reader, by->rates, MECHC_TAPE_OF_plain, c->nq * columns));
}

static const char *mechc_read_outputs(mechc_tape_reader *reader, mechc_tapes *tapes)
{
    const mechc_section *s = reader->sections;
    const mechc_counts *c = reader->counts;
    const size_t count = mechc_section_count(s + MECHC_TAPE_OUTPUTS, sizeof *tapes->outputs);
    const size_t defaults = mechc_section_count(s + MECHC_TAPE_DEFAULTS, sizeof *tapes->defaults);
    MECHC_TAPE_REQUIRE(count <= MECHC_TAPE_MOST_OUTPUTS, "it has too many outputs");
    tapes->outputs = (const mechc_tape_output *)s[MECHC_TAPE_OUTPUTS].content;
    tapes->output_count = (int)count;
    tapes->jacobians = (const mechc_tape_jacobian *)s[MECHC_TAPE_JACOBIANS].content;
    for (size_t i = 0; i < count; i++) {
        const mechc_tape_output *o = tapes->outputs + i;
        const int function = o->way == MECHC_BY_TAPE ? MECHC_TAPE_OF_plain : MECHC_TAPE_OF_solved;
        int sound = o->name >= 0 && (size_t)o->name < s[MECHC_TAPE_NAMES].size && o->width >= 0
                 && o->width <= MECHC_TAPE_WIDEST;
        if (o->way == MECHC_BY_RATES) sound &= o->width == c->nq + c->nu;
        else if (o->way == MECHC_BY_MULTIPLIERS) sound &= c->nc > 0 && o->width == c->nc;
        else if (o->way == MECHC_BY_JACOBIAN || o->way == MECHC_BY_OWN_JACOBIAN)
            sound &= mechc_jacobian_fits(reader, tapes, o);
        else if (o->way == MECHC_BY_TREE)
            sound &= c->links && ((o->tape == 0 && o->width == c->nu * c->nu) || (o->tape == 1 && o->width == c->nu)
                                  || (o->tape == 2 && c->nc && o->width == c->nc * c->nu));
        else sound = sound && (o->way == MECHC_BY_TAPE || o->way == MECHC_BY_SOLVED)
                  && mechc_tape_fits(reader, o->tape, function, o->width);
        MECHC_TAPE_REQUIRE(sound,
                           "an output is not sound");
    }
    MECHC_TAPE_REQUIRE(defaults <= (size_t)c->np, "it has too many defaults");
    tapes->defaults = (const mechc_tape_default *)s[MECHC_TAPE_DEFAULTS].content;
    tapes->default_count = (int)defaults;
    for (size_t i = 0; i < defaults; i++) {
        const mechc_tape_default *d = tapes->defaults + i;
        MECHC_TAPE_REQUIRE(d->parameter >= 0 && d->parameter < c->np
                               && (d->tape == -1 || mechc_tape_fits(reader, d->tape, MECHC_TAPE_OF_default, 1)),
                           "a default is not sound");
    }
    return NULL;
}

/* Fill in the scene; its data stay in the bytes, which begin at a multiple of eight. */
static const char *mechc_read_tape(const unsigned char *bytes, size_t size,
                                   mechc_tape_reader *reader, mechc_tapes *tapes)
{
    const char *why = mechc_read_sections(bytes, size, reader->sections);
    const mechc_section *s = reader->sections;
    if (!why) why = mechc_read_counts(reader);
    if (!why) why = mechc_read_tables(reader);
    if (!why) why = mechc_read_tree(reader);
    if (!why) why = mechc_read_lookups(reader);
    if (!why) why = mechc_read_series(reader);
    if (!why) why = mechc_read_called(reader, tapes);
    if (!why) why = mechc_read_named(reader, tapes);
    if (!why) why = mechc_read_outputs(reader, tapes);
    if (why) return why;
    tapes->code = (mechc_tape_code){
        (const mechc_operation *)s[MECHC_TAPE_OPERATIONS_OF_ALL].content,
        (const mechc_tape *)s[MECHC_TAPE_TAPES].content,
        (const mechc_tape_table *)s[MECHC_TAPE_TABLES].content,
        (const double *)s[MECHC_TAPE_NUMBERS].content,
        (const double *)s[MECHC_TAPE_NUMBERS_OF_TABLES].content,
    };
    /* texts end with the zeros that fill each section up */
    tapes->names = (const char *)s[MECHC_TAPE_NAMES].content;
    tapes->metadata = (const char *)s[MECHC_TAPE_METADATA].content;
    tapes->texts = (const char *)s[MECHC_TAPE_TEXTS].content;
    return NULL;
}
