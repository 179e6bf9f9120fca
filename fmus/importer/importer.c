/* A plain FMI 2.0 co-simulation importer, to run an FMU without Python's help.
 *
 *     importer LIBRARY RESOURCES_URI GUID STEP STEPS INPUTS REFERENCE...
 *
 * INPUTS is a text file: how many inputs and their value references, then a row of their values for every step. They are
 * set before the step; the outputs with the given references are read after it and printed with the time, those of the
 * start first. The time of a doStep goes to stderr. Exit code 1 when the FMU refuses anything.
 */
#define _GNU_SOURCE
#include "../front/fmi2.h"

#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void tell(void *environment, const char *instance, int status, const char *category, const char *message, ...)
{
    va_list rest;
    (void)environment;
    fprintf(stderr, "[%s %s %d] ", instance, category ? category : "", status);
    va_start(rest, message);
    vfprintf(stderr, message, rest);
    va_end(rest);
    fputc('\n', stderr);
}

static void *symbol(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (!found) fprintf(stderr, "%s\n", dlerror()), exit(1);
    return found;
}

#define CALL(...)                                                   \
    do {                                                            \
        int status = __VA_ARGS__;                                   \
        if (status > 1) {                                           \
            fprintf(stderr, "%s: status %d\n", #__VA_ARGS__, status); \
            return 1;                                               \
        }                                                           \
    } while (0)

int main(int argc, char **argv)
{
    static fmi2CallbackFunctions callbacks = {tell, calloc, free, NULL, NULL};
    fmi2Component (*Instantiate)(const char *, int, const char *, const char *, const fmi2CallbackFunctions *, int, int);
    int (*SetupExperiment)(fmi2Component, int, double, double, int, double);
    int (*EnterInitializationMode)(fmi2Component), (*ExitInitializationMode)(fmi2Component), (*Terminate)(fmi2Component);
    int (*SetReal)(fmi2Component, const unsigned *, size_t, const double *);
    int (*GetReal)(fmi2Component, const unsigned *, size_t, double *);
    int (*DoStep)(fmi2Component, double, double, int);
    void (*FreeInstance)(fmi2Component);
    struct timespec begin, end;
    double step, seconds = 0.0, values[64], outputs[64];
    unsigned in[64], out[64];
    int count, inputs, wanted = argc - 7, i, k;
    void *library;
    FILE *file;
    fmi2Component c;
    if (wanted < 1 || wanted > 64) return fprintf(stderr, "usage: see importer.c\n"), 2;
    step = atof(argv[4]), count = atoi(argv[5]), file = fopen(argv[6], "r");
    if (!file || fscanf(file, "%d", &inputs) != 1 || inputs > 64) return fprintf(stderr, "%s: no inputs\n", argv[6]), 2;
    for (i = 0; i < inputs; i++)
        if (fscanf(file, "%u", in + i) != 1) return 2;
    for (i = 0; i < wanted; i++) out[i] = (unsigned)atoi(argv[7 + i]);
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
#define LOAD(name) *(void **)&name = symbol(library, "fmi2" #name)
    LOAD(Instantiate), LOAD(SetupExperiment), LOAD(EnterInitializationMode), LOAD(ExitInitializationMode);
    LOAD(Terminate), LOAD(SetReal), LOAD(GetReal), LOAD(DoStep), LOAD(FreeInstance);
    c = Instantiate("importer", 1, argv[3], argv[2], &callbacks, 0, 0);
    if (!c) return fprintf(stderr, "no instance\n"), 1;
    CALL(SetupExperiment(c, 0, 0.0, 0.0, 1, step * count));
    CALL(EnterInitializationMode(c));
    for (k = 0; k <= count; k++) {
        if (k < count)
            for (i = 0; i < inputs; i++)
                if (fscanf(file, "%lf", values + i) != 1) return fprintf(stderr, "%s: row %d\n", argv[6], k), 2;
        if (k == 0) {
            CALL(SetReal(c, in, (size_t)inputs, values));
            CALL(ExitInitializationMode(c));
        }
        CALL(GetReal(c, out, (size_t)wanted, outputs));
        printf("%.17g", k * step);
        for (i = 0; i < wanted; i++) printf(",%.17g", outputs[i]);
        putchar('\n');
        if (k == count) break;
        CALL(SetReal(c, in, (size_t)inputs, values));
        clock_gettime(CLOCK_MONOTONIC, &begin);
        CALL(DoStep(c, k * step, step, 1));
        clock_gettime(CLOCK_MONOTONIC, &end);
        seconds += (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    }
    CALL(Terminate(c));
    FreeInstance(c);
    dlclose(library);
    fprintf(stderr, "%.3f us per doStep\n", 1e6 * seconds / count);
    return 0;
}
