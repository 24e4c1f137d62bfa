/* An exported file used as its page shows, by a test that knows what each word should be.
 *
 * Defined by the test: NAME, HEADER, REAL, STATES, PARAMETERS, INPUTS, OUTPUTS(X) over label and width.
 * From standard input: steps, their length, the start, how many parameters are given, place and value of
 * each, inputs, 1 where a function gives them.  A line of words for each thing that is checked. */
#include <stdio.h>
#include <string.h>
#include HEADER

#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define OF(word) JOIN(NAME, word)
#define GUARD 0xa5

static REAL number(void)
{
    double read = 0.0;
    return scanf("%lf", &read) == 1 ? (REAL)read : (REAL)0;
}

static void line(const char *head, const REAL *values, int count)
{
    printf("%s", head);
    for (int i = 0; i < count; i++) printf(" %.17g", (double)values[i]);
    printf("\n");
}

static void drive(void *data, REAL t, const REAL *q, const REAL *u, REAL *inputs)
{
    const REAL *values = data;
    (void)t, (void)q, (void)u;
    for (int i = 0; i < INPUTS; i++) inputs[i] = values[i];
}

static int untouched(const unsigned char *bytes, size_t size)
{
    size_t same = 0;
    for (size_t i = 0; i < size; i++) same += bytes[i] == GUARD;
    return same == size;
}

int main(void)
{
    struct {
        unsigned char before[64];
        OF(model) model;
        unsigned char after[64];
    } kept;
    REAL y[STATES + 1], p[PARAMETERS + 1], inputs[INPUTS + 1] = {0};
    const int steps = (int)number();
    const REAL h = number();
    int status;
    memset(&kept, GUARD, sizeof kept);
    memset(y, GUARD, sizeof y);
    memset(p, GUARD, sizeof p);
    for (int i = 0; i < STATES; i++) y[i] = number();
    OF(defaults)(p);
    line("defaults", p, PARAMETERS);
    for (int given = (int)number(); given > 0; given--) {
        const int place = (int)number();
        p[place] = number();
    }
    for (int i = 0; i < INPUTS; i++) inputs[i] = number();
    const int driven = (int)number();

    printf("set %d\n", OF(set)(&kept.model, p, 0, y));
    printf("again %d\n", OF(set)(&kept.model, kept.model.p, 0, y));
    line("parameters", kept.model.p, PARAMETERS);
    line("inputs", kept.model.inputs, INPUTS);
    printf("drive %d\n", kept.model.drive != 0 || kept.model.data != 0);
    memcpy(kept.model.inputs, inputs, INPUTS * sizeof *inputs);
    if (driven) {
        memset(kept.model.inputs, 0, sizeof kept.model.inputs);
        kept.model.drive = drive, kept.model.data = inputs;
    }
    const OF(model) before = kept.model;
    printf("project %d\n", OF(project)(&kept.model, 0, y));
    line("start", y, STATES);
    printf("assemble %d\n", OF(assemble)(&kept.model, 0, y, NULL));
    line("assembled", y, STATES);
    const REAL conditioning = OF(conditioning)(&kept.model, 0, y);
    line("conditioning", &conditioning, 1);
#define SHOWN(label, width)                                                                       \
    do {                                                                                          \
        REAL out[width + 1];                                                                      \
        memset(out, GUARD, sizeof out);                                                           \
        OF(label)(&kept.model, 0, y, out);                                                        \
        line(#label, out, width);                                                                 \
        printf("beyond %d\n", untouched((unsigned char *)(out + width), sizeof *out));            \
    } while (0);
    OUTPUTS(SHOWN)
    for (int n = 0; n < steps; n++) {
        status = OF(step)(&kept.model, (REAL)n * h, h, y);
        if (status != 0) {
            printf("step %d\n", status);
            return 0;
        }
    }
    line("end", y, STATES);
    printf("beyond %d\n", memcmp(&before, &kept.model, sizeof before) == 0);
    printf("beyond %d\n", untouched(kept.before, 64) && untouched(kept.after, 64));
    printf("beyond %d\n", untouched((unsigned char *)(y + STATES), sizeof *y)
                              && untouched((unsigned char *)(p + PARAMETERS), sizeof *p));
    return 0;
}
