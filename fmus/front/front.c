/* Front library of the project's FMUs: the FMI 2.0 functions an importer sees, handed on to pythonfmu's library.
 *
 * It stands between importer and pythonfmu for three reasons. pythonfmu takes it for granted that Python runs in the
 * process, or that its library will be found: `python.c` sees to that. pythonfmu knows only fmi2OK and fmi2Fatal: the
 * FMU's Python code logs a fault with its status and goes on; this library returns the worst status that was logged
 * during a call. It switches the log on for that and passes on what the importer asked for: errors, and what is said of
 * the Python that was found, always; the rest with loggingOn. And pythonfmu makes Python lists for every value: the
 * Python code tells this library, by log messages of the category "front", where its variables are, and its compiled
 * step, and plain reads and writes of reals and steps that go well need no Python at all.
 *
 * pythonfmu's library lies beside this one as <modelIdentifier>_pythonfmu.so (and `quiet.c` as _quiet.so). After
 * fmi2Fatal the instance is not touched any more, because pythonfmu has freed parts of it by then.
 */
#define _GNU_SOURCE
#include "fmi2.h"
#include "python.h"

#include <ctype.h>
#include <dlfcn.h>
#include <fenv.h>
#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { NOT_REAL, INPUT, OUTPUT, PARAMETER };

/* the variables in the memory of the Python instance, by value reference */
typedef struct {
    double *values;
    const double *low, *high;       /* ranges */
    const unsigned char *role;      /* what each variable is */
    int *stale;                     /* set when outputs have to be computed anew before they are read */
    double *time;                   /* where the instance is [s] */
    long long *pending;             /* what the step returned that was made here, for Python to go on from */
    int count;
} Shared;

/* the instance's compiled step: core/jit.py, STEP */
typedef long long Step(double *values, long long n, double *row, long long m, double t, double h);

typedef struct {
    Step *call;       /* NULL while the instance does not run */
    double *row;
    long long size;
} Model;

enum { UNSETTLED = -1 }; /* pending: the step was made, the outputs are not finite */

typedef struct {
    fmi2Component inner;
    Shared shared;    /* values is NULL until Python has told */
    Model model;
    fmi2CallbackFunctions importer, mine; /* copies: not every importer keeps its own */
    fmi2Boolean logging;
    unsigned muted;   /* categories that the importer has not asked for, a bit each */
    fmi2Status worst; /* worst status logged during the present call */
    int lost;         /* a call returned fmi2Fatal */
} Instance;

static void *library;
static char trouble[8192]; /* why something could not be loaded */

/* One call at a time: pythonfmu's buffers are shared by all instances, and only one thread can run Python anyway. Who
 * waits must not hold up Python, which the one inside needs. */
static pthread_mutex_t inside = PTHREAD_RECURSIVE_MUTEX_INITIALIZER_NP;

static fenv_t outside; /* the importer's floating-point environment, where it traps NaN or rounds otherwise */
static int depth, strange;

static void lock(void)
{
    void *state;
    if (pthread_mutex_trylock(&inside)) {
        state = python_let_go();
        pthread_mutex_lock(&inside);
        python_hold(state);
    }
    if (!depth++ && (strange = fegetexcept() || fegetround() != FE_TONEAREST)) {
        fegetenv(&outside);
        fesetenv(FE_DFL_ENV);
    }
}

static void unlock(void)
{
    if (!--depth && strange) fesetenv(&outside);
    pthread_mutex_unlock(&inside);
}

static const char *const categories[] = {"logStatusWarning", "logStatusError", "logStatusFatal", "logAll"};
enum { CATEGORIES = sizeof categories / sizeof *categories };

/* the number of a category; CATEGORIES if there is none of that name */
static unsigned category_of(fmi2String name)
{
    unsigned i = 0;
    while (i < CATEGORIES && (!name || strcmp(name, categories[i]))) i++;
    return i;
}

/* hand a text to the importer's logger, for which it is a printf format */
static void tell(const Instance *instance, fmi2String name, fmi2Status status, fmi2String category, fmi2String text)
{
    const fmi2CallbackFunctions *importer = &instance->importer;
    char *plain, *to;
    if (!importer->logger || !text || !(plain = to = malloc(2 * strlen(text) + 1))) return;
    for (; *text; text++) {
        if (*text == '%') *to++ = '%';
        *to++ = *text;
    }
    *to = 0;
    if (!category || !strcmp(category, "cppfmu")) /* pythonfmu's own words */
        category = status >= fmi2Fatal ? "logStatusFatal" : status == fmi2Error ? "logStatusError" : "logAll";
    importer->logger(importer->componentEnvironment, name, status, category, plain);
    free(plain);
}

static void on_log(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    Instance *instance = environment;
    unsigned kind;
    if (category && !strcmp(category, "front")) {
        Shared s;
        Model m;
        if (sscanf(message, "variables %p %p %p %p %p %p %p %d", (void **)&s.values, (void **)&s.low, (void **)&s.high,
                   (void **)&s.role, (void **)&s.stale, (void **)&s.time, (void **)&s.pending, &s.count) == 8)
            instance->shared = s;
        if (sscanf(message, "step %p %p %lld", (void **)&m.call, (void **)&m.row, &m.size) == 3) instance->model = m;
        return;
    }
    if (status > instance->worst && status <= fmi2Fatal) instance->worst = status;
    kind = category_of(category);
    if (kind == CATEGORIES) kind = status == fmi2Warning ? 0 : CATEGORIES - 1; /* pythonfmu's own words */
    if (status >= fmi2Error || (instance->logging && !(instance->muted >> kind & 1)))
        tell(instance, name, status, category, message);
}

static char own[PATH_MAX]; /* where this library lies */

/* when it is loaded: the importer may have named it by a relative path, and go elsewhere later */
__attribute__((constructor)) static void look_around(void)
{
    Dl_info info;
    if (!dladdr((void *)&look_around, &info) || !info.dli_fname || !realpath(info.dli_fname, own)) *own = 0;
}

/* load a library that lies beside this one and whose name continues this one's */
static void *beside(const char *suffix, int flags)
{
    char path[PATH_MAX];
    size_t length = strlen(own);
    void *handle;
    if (length < 3 || length + strlen(suffix) >= sizeof path) return NULL;
    memcpy(path, own, length - 3); /* without .so */
    strcpy(path + length - 3, suffix);
    handle = dlopen(path, flags);
    if (!handle) snprintf(trouble, sizeof trouble, "%s", dlerror());
    return handle;
}

static void *function(const char *name)
{
    if (!library) {
        beside("_quiet.so", RTLD_NOW | RTLD_GLOBAL);
        library = beside("_pythonfmu.so", RTLD_NOW | RTLD_LOCAL);
    }
    return library ? dlsym(library, name) : NULL;
}

static fmi2Status settled(Instance *instance, fmi2Status status)
{
    if (status == fmi2Fatal) instance->lost = 1;
    return status > instance->worst ? status : instance->worst;
}

#define EXPORT __attribute__((visibility("default")))

/* define a function that calls fmi2NAME of pythonfmu's library; FORWARD exports it under that name as well */
#define FORWARD(NAME, PARAMETERS, TYPES, ARGUMENTS) CALL(EXPORT, fmi2##NAME, NAME, PARAMETERS, TYPES, ARGUMENTS)
#define CALL(LINKAGE, OWN, NAME, PARAMETERS, TYPES, ARGUMENTS)              \
    LINKAGE fmi2Status OWN PARAMETERS                                       \
    {                                                                       \
        static fmi2Status(*call) TYPES;                                     \
        Instance *instance = c;                                             \
        if (!instance || instance->lost) return fmi2Fatal;                  \
        fmi2Status status = fmi2Fatal;                                      \
        lock();                                                             \
        if (!call) *(void **)&call = function("fmi2" #NAME);                \
        instance->worst = fmi2OK;                                           \
        if (call) status = settled(instance, call ARGUMENTS);               \
        unlock();                                                           \
        return status;                                                      \
    }

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

/* the path of a file URI with %XX decoded, or a plain path as it is: pythonfmu takes a URI for a path and knows only %20 */
static char *decoded(const char *uri)
{
    char *plain = uri ? malloc(strlen(uri) + 1) : NULL, *to = plain;
    unsigned code;
    int is_uri = uri && !strncasecmp(uri, "file:", 5);
    if (!plain) return NULL;
    if (is_uri) {
        uri += 5;
        if (!strncmp(uri, "//", 2)) uri += 2 + strcspn(uri + 2, "/"); /* and the host, if there is one */
    }
    while (*uri) {
        if (is_uri && uri[0] == '%' && isxdigit((unsigned char)uri[1]) && isxdigit((unsigned char)uri[2]) &&
            sscanf(uri + 1, "%2x", &code) == 1 && code) {
            *to++ = (char)code;
            uri += 3;
        } else {
            *to++ = *uri++;
        }
    }
    *to = 0;
    return plain;
}

/* whether a text is UTF-8, as FMI has it; what is not would crash pythonfmu */
static int is_utf8(const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    while (*c) {
        int more = *c < 0x80 ? 0 : *c >= 0xc2 && *c < 0xe0 ? 1 : (*c & 0xf0) == 0xe0 ? 2 : *c >= 0xf0 && *c < 0xf5 ? 3 : -1;
        unsigned low = *c == 0xe0 ? 0xa0 : *c == 0xf0 ? 0x90 : 0x80, high = *c == 0xed ? 0x9f : *c == 0xf4 ? 0x8f : 0xbf;
        if (more < 0) return 0;
        for (c++; more > 0; more--, c++, low = 0x80, high = 0xbf)
            if (*c < low || *c > high) return 0;
    }
    return 1;
}

/* whether the FMU's resources are where the importer says; pythonfmu crashes where they are not */
static int there(const char *folder)
{
    char path[4096];
    FILE *file = NULL;
    if (strstr(folder, "%20")) { /* pythonfmu would take it for a blank */
        snprintf(trouble, sizeof trouble, "this FMU cannot run from a folder with %%20 in its name: %.4000s", folder);
        return 0;
    }
    if (!is_utf8(folder)) {
        snprintf(trouble, sizeof trouble, "this FMU cannot run from a folder whose name is not UTF-8");
        return 0;
    }
    if (snprintf(path, sizeof path, "%s/slavemodule.txt", folder) < (int)sizeof path) file = fopen(path, "r");
    if (!file) {
        snprintf(trouble, sizeof trouble, "fmuResourceLocation does not lead to this FMU's resources: no %.4000s", path);
        return 0;
    }
    fclose(file);
    return 1;
}

/* whether the importer has this FMU's description in mind: what it says is in resources/guid.txt, by the build */
static int meant(const char *folder, int type, fmi2String guid)
{
    char line[4096];
    FILE *file = NULL;
    if (type != 1) {
        snprintf(trouble, sizeof trouble, "this FMU is for co-simulation only");
        return 0;
    }
    if (snprintf(line, sizeof line, "%s/guid.txt", folder) < (int)sizeof line) file = fopen(line, "r");
    if (!file) return 1;
    if (!fgets(line, sizeof line, file)) *line = 0;
    fclose(file);
    line[strcspn(line, "\r\n")] = 0;
    if (guid && !strcmp(guid, line)) return 1;
    snprintf(trouble, sizeof trouble, "the GUID '%.200s' is not that of this FMU, '%.200s'", guid ? guid : "", line);
    return 0;
}

static fmi2Status forward_get_real(fmi2Component, const fmi2ValueReference[], size_t, fmi2Real[]);

/* an empty read delivers what the constructor logged: pythonfmu crashes when it frees an instance with a full log */
static void deliver(Instance *instance) { forward_get_real(instance, NULL, 0, NULL); }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, int type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    fmi2Component (*call)(fmi2String, int, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean,
                          fmi2Boolean);
    Instance *instance = calloc(1, sizeof *instance);
    char *path = decoded(resources), *folder = NULL;
    if (!instance) return NULL;
    if (!name || !is_utf8(name)) name = "";
    if (functions) instance->importer = instance->mine = *functions;
    instance->mine.logger = on_log;
    instance->mine.componentEnvironment = instance;
    instance->logging = logging;
    lock();
    if (path && (folder = malloc(strlen(path) + 8))) sprintf(folder, "file://%s", path); /* as pythonfmu wants it */
    *trouble = 0;
    if (!folder) snprintf(trouble, sizeof trouble, "fmuResourceLocation is missing");
    else if (there(folder + 7) && meant(folder + 7, type, guid) && python_ready(folder + 7, trouble, sizeof trouble)) {
        if (*trouble) tell(instance, name, fmi2Warning, "logStatusWarning", trouble);
        *(void **)&call = function("fmi2Instantiate");
        if (call) {
            snprintf(trouble, sizeof trouble, "the Python code of this FMU could not be started");
            instance->inner = call(name, type, guid, folder, &instance->mine, visible, 1);
        }
    }
    if (!instance->inner) tell(instance, name, fmi2Fatal, "logStatusFatal", trouble);
    unlock();
    free(folder);
    free(path);
    if (!instance->inner) {
        free(instance);
        return NULL;
    }
    deliver(instance);
    return instance;
}

EXPORT void fmi2FreeInstance(fmi2Component c)
{
    void (*call)(fmi2Component);
    Instance *instance = c;
    if (!instance) return;
    lock();
    *(void **)&call = function("fmi2FreeInstance");
    if (call && !instance->lost) call(instance->inner);
    unlock();
    free(instance);
}

static fmi2Status refused(const Instance *instance, fmi2String why)
{
    if (!instance || instance->lost) return fmi2Fatal;
    tell(instance, "", fmi2Error, "logStatusError", why);
    return fmi2Error;
}

/* errors are told whatever is asked for; logAll is all categories */
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    Instance *instance = c;
    unsigned meant = 0, all = (1u << CATEGORIES) - 1;
    char why[256];
    size_t i;
    if (!instance) return fmi2Error;
    for (i = 0; names && i < n; i++) {
        unsigned k = category_of(names[i]);
        if (k == CATEGORIES) {
            snprintf(why, sizeof why, "there is no log category '%.100s'", names[i] ? names[i] : "");
            return refused(instance, why);
        }
        meant |= strcmp(names[i], "logAll") ? 1u << k : all;
    }
    if (!n || !names) meant = all;
    if (!on && meant != all && instance->logging) {
        instance->muted |= meant; /* the others go on */
    } else {
        instance->muted = on ? all & ~meant : 0;
        instance->logging = on;
    }
    return fmi2OK;
}

FORWARD(SetupExperiment,
        (fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start, fmi2Boolean sd, fmi2Real stop),
        (fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean, fmi2Real),
        (instance->inner, td, tol, start, sd, stop))
FORWARD(EnterInitializationMode, (fmi2Component c), (fmi2Component), (instance->inner))
FORWARD(ExitInitializationMode, (fmi2Component c), (fmi2Component), (instance->inner))
FORWARD(Terminate, (fmi2Component c), (fmi2Component), (instance->inner))
CALL(static, forward_reset, Reset, (fmi2Component c), (fmi2Component), (instance->inner))

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    Instance *instance = c;
    fmi2Status status;
    if (instance) { /* the Python instance will be a new one */
        memset(&instance->shared, 0, sizeof instance->shared);
        memset(&instance->model, 0, sizeof instance->model);
    }
    status = forward_reset(c);
    if (instance && !instance->lost) deliver(instance);
    return status;
}

#define ACCESS(KIND, TYPE)                                                                                \
    FORWARD(Get##KIND, (fmi2Component c, const fmi2ValueReference vr[], size_t n, TYPE value[]),      \
            (fmi2Component, const fmi2ValueReference *, size_t, TYPE *), (instance->inner, vr, n, value)) \
    FORWARD(Set##KIND, (fmi2Component c, const fmi2ValueReference vr[], size_t n, const TYPE value[]), \
            (fmi2Component, const fmi2ValueReference *, size_t, const TYPE *), (instance->inner, vr, n, value))
CALL(static, forward_get_real, GetReal, (fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]),
     (fmi2Component, const fmi2ValueReference *, size_t, fmi2Real *), (instance->inner, vr, n, value))
CALL(static, forward_set_real, SetReal,
     (fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]),
     (fmi2Component, const fmi2ValueReference *, size_t, const fmi2Real *), (instance->inner, vr, n, value))

/* advance by h, or with 0 bring the outputs up to date, without Python; 0: it could not be done, or was done and is for
 * Python to go on from */
static int stepped(Instance *instance, double t, double h)
{
    const Shared *s = &instance->shared;
    const Model *m = &instance->model;
    long long code;
    int i;
    if (!m->call || *s->pending) return 0;
    lock();
    code = m->call(s->values, s->count, m->row, m->size, t, h);
    for (i = 0; !code && i < s->count; i++)
        if (s->role[i] == OUTPUT && !isfinite(s->values[i])) code = UNSETTLED;
    if (h > 0.0 && code) *s->pending = code;
    if (h > 0.0 && !code) *s->time = t + h;
    if (!code) *s->stale = 0;
    unlock();
    return !code;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    Instance *instance = c;
    const Shared *s = instance ? &instance->shared : NULL;
    size_t i, output = n;
    fmi2Real first = 0.0;
    fmi2Status status = fmi2OK;
    if (!s || !s->values || instance->lost) return forward_get_real(c, vr, n, value);
    for (i = 0; i < n; i++) {
        if (vr[i] >= (unsigned)s->count || s->role[vr[i]] == NOT_REAL) return forward_get_real(c, vr, n, value);
        if (s->role[vr[i]] == OUTPUT) output = i;
    }
    if (*s->stale && output < n && !stepped(instance, *s->time, 0.0)) { /* reading one brings all up to date */
        status = forward_get_real(c, vr + output, 1, &first);
        if (instance->lost) return status;
    }
    for (i = 0; i < n; i++) value[i] = status > fmi2Warning ? first : s->values[vr[i]];
    return status;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    const Instance *instance = c;
    size_t i;
    if (instance && instance->shared.values && !instance->lost) {
        const Shared *s = &instance->shared;
        for (i = 0; i < n; i++)
            if (vr[i] >= (unsigned)s->count || s->role[vr[i]] != INPUT ||
                !(isgreaterequal(value[i], s->low[vr[i]]) && islessequal(value[i], s->high[vr[i]]))) /* also true for NaN */
                return forward_set_real(c, vr, n, value);
        for (i = 0; i < n; i++) s->values[vr[i]] = value[i];
        *s->stale = 1;
        return fmi2OK;
    }
    return forward_set_real(c, vr, n, value);
}

ACCESS(Integer, fmi2Integer)
ACCESS(Boolean, fmi2Boolean)
ACCESS(String, fmi2String)

CALL(static, forward_get_state, GetFMUstate, (fmi2Component c, fmi2FMUstate *state), (fmi2Component, fmi2FMUstate *),
     (instance->inner, state))
CALL(static, forward_set_state, SetFMUstate, (fmi2Component c, fmi2FMUstate state), (fmi2Component, fmi2FMUstate),
     (instance->inner, state))
CALL(static, forward_free_state, FreeFMUstate, (fmi2Component c, fmi2FMUstate *state), (fmi2Component, fmi2FMUstate *),
     (instance->inner, state))
CALL(static, forward_size, SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate state, size_t *size),
     (fmi2Component, fmi2FMUstate, size_t *), (instance->inner, state, size))
CALL(static, forward_serialize, SerializeFMUstate,
     (fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size),
     (fmi2Component, fmi2FMUstate, fmi2Byte *, size_t), (instance->inner, state, bytes, size))

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    fmi2Status status;
    if (!state || !*state) return fmi2OK;
    status = forward_free_state(c, state);
    *state = NULL;
    return status;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    fmi2FMUstate before;
    fmi2Status status;
    if (!state) return fmi2Error;
    before = *state; /* a state that is to be used again */
    *state = NULL;
    status = forward_get_state(c, state);
    if (before) forward_free_state(c, &before);
    return status;
}

/* for pythonfmu a state that is none is fatal */
static fmi2Status no_state(const Instance *instance) { return refused(instance, "FMUstate is NULL"); }

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return state ? forward_set_state(c, state) : no_state(c);
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    return state ? forward_size(c, state, size) : no_state(c);
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    size_t needed = 0;
    fmi2Status status;
    if (!state) return no_state(c);
    status = forward_size(c, state, &needed);
    if (status > fmi2Warning) return status;
    if (!bytes || size < needed) return refused(c, "the memory for the serialized FMUstate is too small");
    memset(bytes, 0, size); /* the rest, which DeSerialize leaves away */
    return forward_serialize(c, state, bytes, needed);
}

CALL(static, forward_deserialize, DeSerializeFMUstate,
     (fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state),
     (fmi2Component, const fmi2Byte *, size_t, fmi2FMUstate *), (instance->inner, bytes, size, state))

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return state && bytes ? forward_deserialize(c, bytes, size, state) : no_state(c);
}
CALL(static, forward_step, DoStep, (fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep),
     (fmi2Component, fmi2Real, fmi2Real, fmi2Boolean), (instance->inner, t, h, keep))

/* what Python would refuse is left to it, and what the step itself does not get done */
EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep)
{
    Instance *instance = c;
    if (instance && !instance->lost && instance->model.call && isgreater(h, 0.0) && isfinite(h) && isfinite(t)) {
        double now = *instance->shared.time;
        if (fabs(t - now) <= 1e-9 * fmax(1.0, fabs(now)) && stepped(instance, t, h)) return fmi2OK;
    }
    return forward_step(c, t, h, keep);
}

FORWARD(CancelStep, (fmi2Component c), (fmi2Component), (instance->inner))
FORWARD(GetDirectionalDerivative,
        (fmi2Component c, const fmi2ValueReference z[], size_t nz, const fmi2ValueReference v[], size_t nv,
         const fmi2Real dv[], fmi2Real dz[]),
        (fmi2Component, const fmi2ValueReference *, size_t, const fmi2ValueReference *, size_t, const fmi2Real *,
         fmi2Real *),
        (instance->inner, z, nz, v, nv, dv, dz))
FORWARD(SetRealInputDerivatives,
        (fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], const fmi2Real value[]),
        (fmi2Component, const fmi2ValueReference *, size_t, const fmi2Integer *, const fmi2Real *),
        (instance->inner, vr, n, order, value))
FORWARD(GetRealOutputDerivatives,
        (fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[]),
        (fmi2Component, const fmi2ValueReference *, size_t, const fmi2Integer *, fmi2Real *),
        (instance->inner, vr, n, order, value))
FORWARD(GetStatus, (fmi2Component c, int kind, fmi2Status *value), (fmi2Component, int, fmi2Status *),
        (instance->inner, kind, value))
CALL(static, forward_real_status, GetRealStatus, (fmi2Component c, int kind, fmi2Real *value),
     (fmi2Component, int, fmi2Real *), (instance->inner, kind, value))
FORWARD(GetIntegerStatus, (fmi2Component c, int kind, fmi2Integer *value), (fmi2Component, int, fmi2Integer *),
        (instance->inner, kind, value))
CALL(static, forward_boolean_status, GetBooleanStatus, (fmi2Component c, int kind, fmi2Boolean *value),
     (fmi2Component, int, fmi2Boolean *), (instance->inner, kind, value))

/* pythonfmu counts a step that was refused, and takes it for the wish to end the run */
EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, int kind, fmi2Real *value)
{
    const Instance *instance = c;
    if (!instance || instance->lost || !instance->shared.values || kind != fmi2LastSuccessfulTime || !value)
        return forward_real_status(c, kind, value);
    *value = *instance->shared.time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, int kind, fmi2Boolean *value)
{
    const Instance *instance = c;
    if (!instance || instance->lost || kind != fmi2Terminated || !value) return forward_boolean_status(c, kind, value);
    *value = 0;
    return fmi2OK;
}
FORWARD(GetStringStatus, (fmi2Component c, int kind, fmi2String *value), (fmi2Component, int, fmi2String *),
        (instance->inner, kind, value))
