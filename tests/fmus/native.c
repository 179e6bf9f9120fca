/* Lives of instances in a program that is not Python.
 *     native cycles LIBRARY RESOURCES_URI GUID N        load, instantiate, step, free, unload N times; memory in kB at times
 *     native threads LIBRARY RESOURCES_URI GUID REF     two instances in two threads; what each has come to
 *     native alone LIBRARY RESOURCES_URI GUID REF       the same, one after the other
 *     native corners LIBRARY RESOURCES_URI GUID REF     what is legal and seldom done
 *     native interrupted LIBRARY RESOURCES_URI GUID REF Ctrl-C between two steps: it has to end this program
 *     native elsewhere LIBRARY RESOURCES_URI GUID REF   loaded by a relative path, used from another folder
 *     native pair LIBRARY RESOURCES_URI GUID REF LIBRARY RESOURCES_URI GUID   two FMUs begin at the same time
 */
#define _GNU_SOURCE
#include "../../fmus/front/fmi2.h"

#include <dlfcn.h>
#include <fenv.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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

static void *load(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
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

/* a whole life with functions of its own: arguments first, first + 1, first + 2 are library, resources and GUID */
static void *begin(void *first)
{
    char **mine = first;
    void *(*create)(const char *, int, const char *, const char *, const fmi2CallbackFunctions *, int, int), *c;
    void (*end)(void *), *library = dlopen(mine[0], RTLD_NOW | RTLD_LOCAL);
    if (!library) exit(1);
    *(void **)&create = dlsym(library, "fmi2Instantiate");
    *(void **)&end = dlsym(library, "fmi2FreeInstance");
    c = create("native", 1, mine[2], mine[1], &callbacks, 0, 0);
    if (!c) exit(1);
    end(c);
    return NULL;
}

#define MUST(CONDITION)                                                      \
    do {                                                                     \
        if (!(CONDITION)) return fprintf(stderr, "not: %s\n", #CONDITION), 1; \
    } while (0)

static int corners(void *library, unsigned reference)
{
    int (*terminate)(void *), (*reset)(void *), (*keep)(void *, void **), (*back)(void *, void *), (*drop)(void *, void **);
    int (*set)(void *, const unsigned *, size_t, const double *), (*texts)(void *, const unsigned *, size_t, const char **);
    int (*size_of)(void *, void *, size_t *), (*pack)(void *, void *, char *, size_t);
    int (*unpack)(void *, const char *, size_t, void **), k;
    unsigned wrong[] = {99999u, 4294967295u};
    void *state = NULL, *copy = NULL, *c;
    size_t size;
    char *bytes;
    double value, again;
    fmi2CallbackFunctions *own = malloc(sizeof *own);
    *own = callbacks;
    *(void **)&terminate = dlsym(library, "fmi2Terminate");
    *(void **)&reset = dlsym(library, "fmi2Reset");
    *(void **)&keep = dlsym(library, "fmi2GetFMUstate");
    *(void **)&back = dlsym(library, "fmi2SetFMUstate");
    *(void **)&drop = dlsym(library, "fmi2FreeFMUstate");
    *(void **)&set = dlsym(library, "fmi2SetReal");
    *(void **)&texts = dlsym(library, "fmi2GetString");
    *(void **)&size_of = dlsym(library, "fmi2SerializedFMUstateSize");
    *(void **)&pack = dlsym(library, "fmi2SerializeFMUstate");
    *(void **)&unpack = dlsym(library, "fmi2DeSerializeFMUstate");
    MUST(!instantiate("native", 0, arguments[4], arguments[3], own, 0, 0)); /* model exchange */
    MUST(!instantiate("native", 1, "another", arguments[3], own, 0, 0));
    MUST(c = instantiate("caf\xe9", 1, arguments[4], arguments[3], own, 0, 0)); /* not UTF-8 */
    release(c);
    MUST(c = instantiate(NULL, 1, arguments[4], arguments[3], own, 0, 0));
    memset(own, 0x55, sizeof *own);
    free(own);
    for (k = 0; k < 3; k++) { /* with nothing between the last reset and the end */
        MUST(leave(c) == 3 && step(c, 0.0, 1e-3, 1) == 3 && setup(c, 0, 0.0, 1.0, 1, 0.0) == 3);
        MUST(!(setup(c, 0, 0.0, 0.0, 0, 0.0) | enter(c) | leave(c) | step(c, 0.0, 1e-3, 1)));
        MUST(enter(c) == 3 && leave(c) == 3 && setup(c, 0, 0.0, 0.0, 0, 0.0) == 3 && !texts(c, NULL, 0, NULL));
        if (k == 1) {
            MUST(!keep(c, &state) && state);
            MUST(!step(c, 1e-3, 1e-3, 1) && !get(c, &reference, 1, &value));
            MUST(!keep(c, &state) && state); /* used again */
            MUST(!step(c, 2e-3, 1e-3, 1) && !back(c, state));
            MUST(!get(c, &reference, 1, &again) && again == value);
            MUST(!size_of(c, state, &size) && (bytes = malloc(size + 100)));
            MUST(pack(c, state, bytes, size - 1) == 3 && !pack(c, state, bytes, size + 100)); /* more than it needs */
            MUST(unpack(c, bytes, size + 100, NULL) == 3 && !unpack(c, bytes, size + 100, &copy));
            MUST(!step(c, 2e-3, 1e-3, 1) && !back(c, copy) && !drop(c, &copy));
            MUST(!get(c, &reference, 1, &again) && again == value);
            free(bytes);
            MUST(!drop(c, &state) && !state && !drop(c, &state));
            MUST(back(c, NULL) == 3);
            MUST(get(c, wrong, 1, &again) == 3 && set(c, wrong + 1, 1, &value) == 3);
            MUST(!step(c, 2e-3, 1e-3, 1));
        }
        MUST(!terminate(c) && step(c, 0.0, 1e-3, 1) == 3 && !get(c, &reference, 1, &again) && !reset(c));
    }
    release(c);
    return 0;
}

int main(int argc, char **argv)
{
    arguments = argv;
    if (argc != 6 && argc != 9) return 2;
    if (!strcmp(argv[1], "cycles")) {
        int n = atoi(argv[5]), k;
        for (k = 0; k < n; k++) {
            void *library = load(argv[2]);
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
        feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW); /* an importer that traps NaN; Python makes some */
        if (corners(load(argv[2]), (unsigned)atoi(argv[5]))) return 1;
        return fegetexcept() != (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    } else if (!strcmp(argv[1], "interrupted")) {
        signal(SIGINT, SIG_DFL); /* in the background of a shell it is ignored */
        load(argv[2]);
        life(1, 1e-3, 0, NULL);
        raise(SIGINT);
        return 0; /* it has been taken away */
    } else if (!strcmp(argv[1], "elsewhere")) {
        char relative[4096], *name = strrchr(argv[2], '/');
        snprintf(relative, sizeof relative, "./%s", name + 1);
        *name = 0;
        if (chdir(argv[2])) return 1;
        load(relative);
        if (chdir("/")) return 1;
        life(1, 1e-3, 0, NULL);
    } else if (!strcmp(argv[1], "pair")) {
        pthread_t threads[2];
        pthread_create(threads, NULL, begin, argv + 2);
        pthread_create(threads + 1, NULL, begin, argv + 6);
        pthread_join(threads[0], NULL);
        pthread_join(threads[1], NULL);
    } else {
        double slots[2][2] = {{0.0, 1e-3}, {0.0, 2e-3}}; /* value, step size */
        pthread_t threads[2];
        int k;
        load(argv[2]);
        for (k = 0; k < 2; k++) {
            if (!strcmp(argv[1], "alone")) run(slots[k]);
            else pthread_create(threads + k, NULL, run, slots[k]);
        }
        for (k = 0; k < 2 && strcmp(argv[1], "alone"); k++) pthread_join(threads[k], NULL);
        printf("%.17g %.17g\n", slots[0][0], slots[1][0]);
    }
    return 0;
}
