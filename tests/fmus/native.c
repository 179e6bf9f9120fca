/* Lives of instances in a program that is not Python.
 *     native cycles LIBRARY RESOURCES_URI GUID N        load, instantiate, step, free, unload N times; memory in kB at times
 *     native threads LIBRARY RESOURCES_URI GUID REF     two instances in two threads; what each has come to
 *     native alone LIBRARY RESOURCES_URI GUID REF       the same, one after the other
 *     native corners LIBRARY RESOURCES_URI GUID REF     what is legal and seldom done
 */
#include "../../fmus/front/fmi2.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void tell(void *e, const char *i, int status, const char *c, const char *message, ...)
{
    (void)e, (void)i, (void)c;
    fprintf(stderr, "[%d] %s\n", status, message);
}
static const fmi2CallbackFunctions callbacks = {tell, calloc, free, NULL, NULL};
static char **arguments;

static void *(*instantiate)(const char *, int, const char *, const char *, const fmi2CallbackFunctions *, int, int);
static void (*release)(void *);
static int (*setup)(void *, int, double, double, int, double), (*enter)(void *), (*leave)(void *);
static int (*step)(void *, double, double, int), (*get)(void *, const unsigned *, size_t, double *);

static void *load(void)
{
    void *library = dlopen(arguments[2], RTLD_NOW | RTLD_LOCAL);
    if (!library) fprintf(stderr, "%s\n", dlerror()), exit(1);
    *(void **)&instantiate = dlsym(library, "fmi2Instantiate");
    *(void **)&release = dlsym(library, "fmi2FreeInstance");
    *(void **)&setup = dlsym(library, "fmi2SetupExperiment");
    *(void **)&enter = dlsym(library, "fmi2EnterInitializationMode");
    *(void **)&leave = dlsym(library, "fmi2ExitInitializationMode");
    *(void **)&step = dlsym(library, "fmi2DoStep");
    *(void **)&get = dlsym(library, "fmi2GetReal");
    return library;
}

static void life(int steps, double h, unsigned reference, double *value)
{
    void *c = instantiate("native", 1, arguments[4], arguments[3], &callbacks, 0, 0);
    int k, status;
    if (!c) exit(1);
    status = setup(c, 0, 0.0, 0.0, 0, 0.0) | enter(c) | leave(c);
    for (k = 0; k < steps && status < 2; k++) status |= step(c, k * h, h, 1);
    if (value) status |= get(c, &reference, 1, value);
    if (status > 1) exit(1);
    release(c);
}

static void *run(void *slot)
{
    double *value = slot;
    life(2000, value[1], (unsigned)atoi(arguments[5]), value);
    return NULL;
}

#define MUST(CONDITION)                                                      \
    do {                                                                     \
        if (!(CONDITION)) return fprintf(stderr, "not: %s\n", #CONDITION), 1; \
    } while (0)

static int corners(void *library, unsigned reference)
{
    int (*terminate)(void *), (*reset)(void *), (*keep)(void *, void **), (*back)(void *, void *), (*drop)(void *, void **);
    int (*set)(void *, const unsigned *, size_t, const double *), k;
    unsigned wrong[] = {99999u, 4294967295u};
    void *state = NULL, *c;
    double value, again;
    fmi2CallbackFunctions *own = malloc(sizeof *own);
    *own = callbacks;
    *(void **)&terminate = dlsym(library, "fmi2Terminate");
    *(void **)&reset = dlsym(library, "fmi2Reset");
    *(void **)&keep = dlsym(library, "fmi2GetFMUstate");
    *(void **)&back = dlsym(library, "fmi2SetFMUstate");
    *(void **)&drop = dlsym(library, "fmi2FreeFMUstate");
    *(void **)&set = dlsym(library, "fmi2SetReal");
    MUST(!instantiate("native", 0, arguments[4], arguments[3], own, 0, 0)); /* model exchange */
    MUST(!instantiate("native", 1, "another", arguments[3], own, 0, 0));
    MUST(c = instantiate(NULL, 1, arguments[4], arguments[3], own, 0, 0));
    memset(own, 0x55, sizeof *own);
    free(own);
    for (k = 0; k < 3; k++) { /* with nothing between the last reset and the end */
        MUST(!(setup(c, 0, 0.0, 0.0, 0, 0.0) | enter(c) | leave(c) | step(c, 0.0, 1e-3, 1)));
        if (k == 1) {
            MUST(!keep(c, &state) && state);
            MUST(!step(c, 1e-3, 1e-3, 1) && !get(c, &reference, 1, &value));
            MUST(!keep(c, &state) && state); /* used again */
            MUST(!step(c, 2e-3, 1e-3, 1) && !back(c, state));
            MUST(!get(c, &reference, 1, &again) && again == value);
            MUST(!drop(c, &state) && !state && !drop(c, &state));
            MUST(back(c, NULL) == 3);
            MUST(get(c, wrong, 1, &again) == 3 && set(c, wrong + 1, 1, &value) == 3);
            MUST(!step(c, 2e-3, 1e-3, 1));
        }
        MUST(!terminate(c) && !reset(c));
    }
    release(c);
    return 0;
}

int main(int argc, char **argv)
{
    arguments = argv;
    if (argc != 6) return 2;
    if (!strcmp(argv[1], "cycles")) {
        int n = atoi(argv[5]), k;
        for (k = 0; k < n; k++) {
            void *library = load();
            life(1, 1e-3, 0, NULL);
            dlclose(library);
            if (k % 50 == 49) {
                long pages = 0, shared = 0; /* shared: of files, which come and go as the system likes */
                FILE *file = fopen("/proc/self/statm", "r");
                if (!file || fscanf(file, "%*d %ld %ld", &pages, &shared) != 2) return 1;
                fclose(file);
                printf("%ld\n", (pages - shared) * 4);
            }
        }
    } else if (!strcmp(argv[1], "corners")) {
        return corners(load(), (unsigned)atoi(argv[5]));
    } else {
        double slots[2][2] = {{0.0, 1e-3}, {0.0, 2e-3}}; /* value, step size */
        pthread_t threads[2];
        int k;
        load();
        for (k = 0; k < 2; k++) {
            if (!strcmp(argv[1], "alone")) run(slots[k]);
            else pthread_create(threads + k, NULL, run, slots[k]);
        }
        for (k = 0; k < 2 && strcmp(argv[1], "alone"); k++) pthread_join(threads[k], NULL);
        printf("%.17g %.17g\n", slots[0][0], slots[1][0]);
    }
    return 0;
}
