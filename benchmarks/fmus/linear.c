/* A linear FMU for FMI 1.0, 2.0 or 3.0 (-DFMI=1, 2, 3) without any header: x' = A x + B u, y = C x + D u, exact for
   inputs that are held during a step or go along a straight line. Value references: 0.. u, 10.. y, 20.. x0, 100 + 10 i + j A, 200.. B, 300.. C,
   400.. D; 500 integer in, 501 integer out, 510/511 boolean, 520/521 string, 530/531 enumeration; 600 what goes wrong and
   601 when; FMI 3.0 also 700/701 an array of three doubles and 710/711 an Int64, 720/721 a Float32, 730/731 a UInt64,
   740 the size (structural parameter) of the array 750/751, which starts as 1, 2, 3, ... */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

#define N 6
#if FMI == 1
#define EXPORT(name) Linear_fmi##name
typedef char Bool;
#elif FMI == 2
#define EXPORT(name) fmi2##name
typedef int Bool;
#else
#define EXPORT(name) fmi3##name
typedef uint8_t Bool;
#endif

typedef struct {
    double u[N], slope[N], y[N], x[N], x0[N], A[N][N], B[N][N], C[N][N], D[N][N];
    double trouble, when, square, array_in[3], array_out[3];
    double first, last;
    int integer_in, integer_out, item_in, item_out, entered, ready, ended, fresh;
    Bool boolean_in, boolean_out;
    int64_t wide_in, wide_out;
    float single_in, single_out;
    uint64_t huge_in, huge_out, size;
    double many_in[8], many_out[8];
    char text_in[256], text_out[256];
} Model;

static void reset(Model *m) {
    memset(m, 0, sizeof *m);
    m->when = 1e300;
    m->item_in = m->item_out = 1;
    m->size = 2;
    for (int i = 0; i < 8; i++) m->many_in[i] = i + 1.0;
}

/* y = C x + D u and the values that are passed through; trouble 20: D counts only from the time on */
static void output(Model *m) {
    double d = m->trouble == 20.0 && m->last < m->when - 1e-9 ? 0.0 : 1.0;
    for (int i = 0; i < N; i++) {
        m->y[i] = 0.0;
        for (int j = 0; j < N; j++) m->y[i] += m->C[i][j] * m->x[j] + d * m->D[i][j] * m->u[j];
    }
    if (m->square != 0.0) m->y[0] += m->square * m->u[0] * m->u[0];
    m->integer_out = m->integer_in;
    m->boolean_out = m->boolean_in;
    m->item_out = m->item_in;
    m->wide_out = m->wide_in;
    m->single_out = m->single_in;
    m->huge_out = m->huge_in;
    memcpy(m->many_out, m->many_in, sizeof m->many_out);
    for (int i = 0; i < 3; i++) m->array_out[i] = m->array_in[i];
    strcpy(m->text_out, m->text_in);
}

/* x(t + h) by the Taylor series of the matrix exponential, in pieces that are short for it */
static void advance(Model *m, double h) {
    double size = 0.0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) size += fabs(m->A[i][j]);
    int pieces = 1 + (int)(2.0 * size * h);
    double d = h / pieces;
    for (int k = 0; k < pieces; k++) {
        double term[N], sum[N];
        for (int i = 0; i < N; i++) {
            term[i] = 0.0;
            for (int j = 0; j < N; j++) term[i] += m->A[i][j] * m->x[j] + m->B[i][j] * m->u[j];
            term[i] *= d;
            sum[i] = m->x[i] + term[i];
        }
        for (int p = 2; p < 20; p++) {
            double next[N];
            for (int i = 0; i < N; i++) {
                next[i] = 0.0;
                for (int j = 0; j < N; j++) next[i] += m->A[i][j] * term[j];
                if (p == 2)
                    for (int j = 0; j < N; j++) next[i] += m->B[i][j] * m->slope[j] * d;
                next[i] *= d / p;
            }
            for (int i = 0; i < N; i++) { term[i] = next[i]; sum[i] += next[i]; }
        }
        memcpy(m->x, sum, sizeof sum);
        for (int j = 0; j < N; j++) m->u[j] += m->slope[j] * d;
    }
}

static double *real(Model *m, unsigned r) {
    unsigned i = r % 100 / 10, j = r % 10;
    if (r < 6) return &m->u[r];
    if (r >= 10 && r < 16) return &m->y[r - 10];
    if (r >= 20 && r < 26) return &m->x0[r - 20];
    if (r == 600) return &m->trouble;
    if (r == 601) return &m->when;
    if (r == 602) return &m->square;
    if (r == 700) return m->array_in;
    if (r == 701) return m->array_out;
    if (r < 100 || r >= 500 || i >= N || j >= N) return NULL;
    return r < 200 ? &m->A[i][j] : r < 300 ? &m->B[i][j] : r < 400 ? &m->C[i][j] : &m->D[i][j];
}

#if FMI == 3
#define COUNT , size_t count
#else
#define COUNT
#endif

int EXPORT(SetReal)(Model *m, const unsigned *r, size_t n, const double *v) {
    if (FMI == 2 && m->ended) return 3; /* not after a step that failed */
    for (size_t k = 0; k < n; k++) {
        double *p = real(m, r[k]);
        if (!p) return 3;
        *p = v[k];
        m->fresh = 1;
        if (!m->ready && r[k] >= 20 && r[k] < 26) m->x[r[k] - 20] = v[k];
    }
    return 0;
}
int EXPORT(GetReal)(Model *m, const unsigned *r, size_t n, double *v) {
    if (!m->entered) return 3; /* not before the initialisation */
    if (m->fresh && (m->trouble == 14.0 || m->trouble == 15.0)) return 3;
    output(m);
    for (size_t k = 0; k < n; k++) {
        double *p = real(m, r[k]);
        if (!p) return 3;
        v[k] = *p;
    }
    return 0;
}
#if FMI == 3
int fmi3SetFloat64(Model *m, const unsigned *r, size_t n, const double *v, size_t count) {
    (void)count;
    for (size_t k = 0; k < n; k++) {
        if (r[k] == 700) { memcpy(m->array_in, v, sizeof m->array_in); v += 3; }
        else if (r[k] == 750) { memcpy(m->many_in, v, m->size * sizeof *v); v += m->size; }
        else if (fmi3SetReal(m, r + k, 1, v++)) return 3;
    }
    return 0;
}
int fmi3GetFloat64(Model *m, const unsigned *r, size_t n, double *v, size_t count) {
    (void)count;
    if (!m->entered) return 3;
    output(m);
    for (size_t k = 0; k < n; k++) {
        if (r[k] == 700 || r[k] == 701) { memcpy(v, r[k] == 700 ? m->array_in : m->array_out, 24); v += 3; }
        else if (r[k] == 750 || r[k] == 751) {
            memcpy(v, r[k] == 750 ? m->many_in : m->many_out, m->size * sizeof *v);
            v += m->size;
        }
        else if (fmi3GetReal(m, r + k, 1, v++)) return 3;
    }
    return 0;
}
int fmi3SetInt64(Model *m, const unsigned *r, size_t n, const int64_t *v, size_t count) {
    (void)count;
    for (size_t k = 0; k < n; k++) {
        if (r[k] == 710) m->wide_in = v[k];
        else if (r[k] == 530) m->item_in = (int)v[k];
        else return 3;
    }
    return 0;
}
int fmi3GetInt64(Model *m, const unsigned *r, size_t n, int64_t *v, size_t count) {
    (void)count;
    output(m);
    for (size_t k = 0; k < n; k++)
        v[k] = r[k] == 710 ? m->wide_in : r[k] == 711 ? m->wide_out : r[k] == 530 ? m->item_in : m->item_out;
    return 0;
}
int fmi3SetUInt64(Model *m, const unsigned *r, size_t n, const uint64_t *v, size_t count) {
    (void)count;
    for (size_t k = 0; k < n; k++) {
        if (r[k] == 740 && v[k] <= 8) m->size = v[k];
        else if (r[k] == 730) m->huge_in = v[k];
        else return 3;
    }
    return 0;
}
int fmi3GetUInt64(Model *m, const unsigned *r, size_t n, uint64_t *v, size_t count) {
    (void)count;
    output(m);
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 740 ? m->size : r[k] == 730 ? m->huge_in : m->huge_out;
    return 0;
}
int fmi3EnterConfigurationMode(Model *m) { (void)m; return 0; }
int fmi3ExitConfigurationMode(Model *m) { (void)m; return 0; }
int fmi3SetFloat32(Model *m, const unsigned *r, size_t n, const float *v, size_t count) {
    (void)count; (void)r;
    for (size_t k = 0; k < n; k++) m->single_in = v[k];
    return 0;
}
int fmi3GetFloat32(Model *m, const unsigned *r, size_t n, float *v, size_t count) {
    (void)count;
    output(m);
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 720 ? m->single_in : m->single_out;
    return 0;
}
#define INTEGER(verb) fmi3##verb##Int32
#else
#define INTEGER(verb) EXPORT(verb##Integer)
#endif

int INTEGER(Set)(Model *m, const unsigned *r, size_t n, const int *v COUNT) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] == 500) m->integer_in = v[k];
        else if (r[k] == 530) m->item_in = v[k];
        else return 3;
    }
    return 0;
}
int INTEGER(Get)(Model *m, const unsigned *r, size_t n, int *v COUNT) {
    output(m);
    for (size_t k = 0; k < n; k++)
        v[k] = r[k] == 500 ? m->integer_in : r[k] == 501 ? m->integer_out : r[k] == 530 ? m->item_in : m->item_out;
    return 0;
}
int EXPORT(SetBoolean)(Model *m, const unsigned *r, size_t n, const Bool *v COUNT) {
    (void)r;
    for (size_t k = 0; k < n; k++) m->boolean_in = v[k];
    return 0;
}
int EXPORT(GetBoolean)(Model *m, const unsigned *r, size_t n, Bool *v COUNT) {
    output(m);
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 510 ? m->boolean_in : m->boolean_out;
    return 0;
}
int EXPORT(SetString)(Model *m, const unsigned *r, size_t n, const char *const *v COUNT) {
    (void)r;
    for (size_t k = 0; k < n; k++) { strncpy(m->text_in, v[k], 255); m->text_in[255] = 0; }
    return 0;
}
int EXPORT(GetString)(Model *m, const unsigned *r, size_t n, const char **v COUNT) {
    output(m);
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 520 ? m->text_in : m->text_out;
    return 0;
}

/* Uses so much of the processor's time [s]. */
static void work(double seconds) {
#ifdef CLOCK_THREAD_CPUTIME_ID
    struct timespec begin, now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    do clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    while (now.tv_sec - begin.tv_sec + 1e-9 * (now.tv_nsec - begin.tv_nsec) < seconds);
#else
    (void)seconds;
#endif
}

static int meet(void) {
#ifdef __GNUC__
    static volatile int came = 0;
    int wanted = (__sync_add_and_fetch(&came, 1) + 1) / 2 * 2;
    for (int k = 0; k < 1000 && __sync_add_and_fetch(&came, 0) < wanted; k++) work(1e-3);
    return __sync_add_and_fetch(&came, 0) < wanted ? 3 : 0;
#else
    return 3;
#endif
}

/* 1 error, 2 NaN, 3 crash, 4 hang, 5 fatal, 6 ends the process with 0, 7 discard, 8 asks to end the run after the step,
   9 in the middle of it, 10 refuses steps of another length than the first, 13 warns without a word; 14 is not read
   between an input and the step or the end of the initialisation, 15 nor after that; 16 goes to another working
   directory; 17 crashes and 18 hangs as it is ended, 19 as it is freed; 20 see output; 21 works for a millisecond, 22
   does not come back before another instance steps, too, and fails where none does within a second */
static int trouble(Model *m, double t) {
    if (t < m->when - 1e-9) return 0;
    switch ((int)m->trouble) {
    case 1: return 3;
    case 2: m->x[0] = NAN; m->C[0][0] = 1.0; return 0;
    case 3: *(volatile int *)8 = 1; return 0;
    case 4: for (;;) sleep(1);
    case 5: return 4;
    case 6: exit(0);
    case 16: return chdir("/") ? 3 : 0;
    case 7: return 2;
    case 13: return 1;
    case 21: work(1e-3); return 0;
    case 22: return meet();
    default: return 0;
    }
}

static int take(Model *m, double t, double h) {
    int status = trouble(m, t);
    if (status != 0 && status != 1) return status;
    if (m->first == 0.0) m->first = h;
    if (m->trouble == 10.0 && h != m->first) return 3;
    m->ended = (m->trouble == 8.0 || m->trouble == 9.0) && t >= m->when - 1e-9;
    if (m->trouble == 9.0 && m->ended) h *= 0.5;
    m->last = t + h;
    m->fresh = 0;
    advance(m, h);
    return status;
}

#if FMI == 3
int fmi3DoStep(Model *m, double t, double h, Bool keep, Bool *event, Bool *terminate, Bool *early, double *last) {
    (void)keep;
    *event = *early = *terminate = 0;
    int status = take(m, t, h);
    *last = m->last;
    *terminate = m->ended;
    return status ? status : m->ended && m->trouble == 9.0 ? 2 : 0;
}
#else
int EXPORT(DoStep)(Model *m, double t, double h, Bool keep) {
    (void)keep;
    int status = take(m, t, h);
    return status ? status : m->ended ? 2 : 0;
}
#endif

static int slopes(Model *m, const unsigned *r, size_t n, const int *order, const double *v) {
    if (FMI == 2 && m->ended) return 3;
    for (size_t k = 0; k < n; k++) {
        if (r[k] >= N || order[k] != 1) return 3;
        m->slope[r[k]] = v[k];
    }
    return 0;
}

/* trouble 11: none are given; 12: they are wrong by a factor of 2 */
static int derivatives(Model *m, const unsigned *z, size_t nz, const unsigned *v, size_t nv, const double *dv,
                       double *dz) {
    if (m->trouble == 11.0) return 3;
    for (size_t i = 0; i < nz; i++) {
        dz[i] = 0.0;
        for (size_t j = 0; j < nv; j++) {
            if (z[i] < 10 || z[i] >= 10 + N || v[j] >= N) return 3;
            dz[i] += m->D[z[i] - 10][v[j]] * dv[j] * (m->trouble == 12.0 ? 2.0 : 1.0);
        }
    }
    return 0;
}

static void crash_or_hang(int crash, int hang) {
    if (crash) *(volatile int *)8 = 1;
    while (hang) sleep(1);
}
static int initialised(Model *m) {
    m->ready = 1;
    if (m->trouble == 14.0) m->fresh = 0;
    crash_or_hang(m->trouble == 23.0, m->trouble == 24.0);
    if (m->trouble == 25.0) exit(0);
    return m->trouble == 26.0 ? 3 : 0;
}
static int terminate(Model *m) { crash_or_hang(m->trouble == 17.0, m->trouble == 18.0); return 0; }
static void release(Model *m) { crash_or_hang(m->trouble == 19.0, 0); free(m); }

static Model *make(void) {
    Model *m = malloc(sizeof *m);
    reset(m);
    return m;
}

#if FMI == 1
const char *Linear_fmiGetTypesPlatform(void) { return "standard32"; }
const char *Linear_fmiGetVersion(void) { return "1.0"; }
int Linear_fmiSetDebugLogging(Model *m, char on) { (void)m; (void)on; return 0; }
Model *Linear_fmiInstantiateSlave(const char *name, const char *guid, const char *where, const char *mime, double timeout,
                                  char visible, char interactive, const void *functions, char logging) {
    (void)name; (void)guid; (void)where; (void)mime; (void)timeout; (void)visible; (void)interactive; (void)functions;
    (void)logging;
    return make();
}
int Linear_fmiInitializeSlave(Model *m, double start, char defined, double stop) {
    (void)start; (void)defined; (void)stop;
    initialised(m);
    m->entered = m->ready = 1;
    return 0;
}
int Linear_fmiTerminateSlave(Model *m) { return terminate(m); }
int Linear_fmiResetSlave(Model *m) { reset(m); return 0; }
void Linear_fmiFreeSlaveInstance(Model *m) { release(m); }
int Linear_fmiSetRealInputDerivatives(Model *m, const unsigned *r, size_t n, const int *o, const double *v) {
    return slopes(m, r, n, o, v);
}
int Linear_fmiGetRealOutputDerivatives(Model *m, const unsigned *r, size_t n, const int *o, double *v) { return 3; }
int Linear_fmiCancelStep(Model *m) { (void)m; return 3; }
int Linear_fmiGetStatus(Model *m, int k, int *v) { return 3; }
int Linear_fmiGetRealStatus(Model *m, int k, double *v) { return 3; }
int Linear_fmiGetIntegerStatus(Model *m, int k, int *v) { return 3; }
int Linear_fmiGetBooleanStatus(Model *m, int k, char *v) { return 3; }
int Linear_fmiGetStringStatus(Model *m, int k, const char **v) { return 3; }
#elif FMI == 2
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(Model *m, int on, size_t n, const char *const *c) { return 0; }
Model *fmi2Instantiate(const char *name, int type, const char *guid, const char *where, const void *functions, int visible,
                       int logging) {
    (void)name; (void)type; (void)guid; (void)where; (void)functions; (void)visible; (void)logging;
    return make();
}
void fmi2FreeInstance(Model *m) { release(m); }
int fmi2SetupExperiment(Model *m, int d, double tol, double start, int sd, double stop) { return 0; }
int fmi2EnterInitializationMode(Model *m) { m->entered = 1; return 0; }
int fmi2ExitInitializationMode(Model *m) { return initialised(m); }
int fmi2Terminate(Model *m) { return terminate(m); }
int fmi2Reset(Model *m) { reset(m); return 0; }
int fmi2GetFMUstate(Model *m, Model **s) { if (!*s) *s = malloc(sizeof *m); memcpy(*s, m, sizeof *m); return 0; }
int fmi2SetFMUstate(Model *m, Model *s) { memcpy(m, s, sizeof *m); return 0; }
int fmi2FreeFMUstate(Model *m, Model **s) { free(*s); *s = NULL; return 0; }
int fmi2SerializedFMUstateSize(Model *m, Model *s, size_t *n) { *n = sizeof *m; return 0; }
int fmi2SerializeFMUstate(Model *m, Model *s, char *b, size_t n) { memcpy(b, s, n); return 0; }
int fmi2DeSerializeFMUstate(Model *m, const char *b, size_t n, Model **s) {
    *s = malloc(sizeof *m);
    memcpy(*s, b, n);
    return 0;
}
int fmi2GetDirectionalDerivative(Model *m, const unsigned *z, size_t nz, const unsigned *v, size_t nv, const double *dv,
                                 double *dz) { return derivatives(m, z, nz, v, nv, dv, dz); }
int fmi2SetRealInputDerivatives(Model *m, const unsigned *r, size_t n, const int *o, const double *v) {
    return slopes(m, r, n, o, v);
}
int fmi2GetRealOutputDerivatives(Model *m, const unsigned *r, size_t n, const int *o, double *v) { return 3; }
int fmi2CancelStep(Model *m) { return 3; }
int fmi2GetStatus(Model *m, int k, int *v) { return 3; }
int fmi2GetRealStatus(Model *m, int k, double *v) { *v = m->last; return k == 2 ? 0 : 3; }
int fmi2GetIntegerStatus(Model *m, int k, int *v) { return 3; }
int fmi2GetBooleanStatus(Model *m, int k, int *v) { *v = m->ended; return k == 3 ? 0 : 3; }
int fmi2GetStringStatus(Model *m, int k, const char **v) { return 3; }
#else
const char *fmi3GetVersion(void) { return "3.0"; }
int fmi3SetDebugLogging(Model *m, Bool on, size_t n, const char *const *c) { return 0; }
Model *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path, Bool visible, Bool logging,
                                   Bool events, Bool early, const unsigned *r, size_t n, void *e, void *log, void *update) {
    return make();
}
void fmi3FreeInstance(Model *m) { release(m); }
int fmi3EnterInitializationMode(Model *m, Bool d, double tol, double start, Bool sd, double stop) {
    m->entered = 1;
    return 0;
}
int fmi3ExitInitializationMode(Model *m) { return initialised(m); }
int fmi3Terminate(Model *m) { return terminate(m); }
int fmi3Reset(Model *m) { reset(m); return 0; }
int fmi3GetFMUState(Model *m, Model **s) { if (!*s) *s = malloc(sizeof *m); memcpy(*s, m, sizeof *m); return 0; }
int fmi3SetFMUState(Model *m, Model *s) { memcpy(m, s, sizeof *m); return 0; }
int fmi3FreeFMUState(Model *m, Model **s) { free(*s); *s = NULL; return 0; }
int fmi3SerializedFMUStateSize(Model *m, Model *s, size_t *n) { *n = sizeof *m; return 0; }
int fmi3SerializeFMUState(Model *m, Model *s, uint8_t *b, size_t n) { memcpy(b, s, n); return 0; }
int fmi3DeserializeFMUState(Model *m, const uint8_t *b, size_t n, Model **s) {
    *s = malloc(sizeof *m);
    memcpy(*s, b, n);
    return 0;
}
#define MISSING(name) int fmi3##name(void) { return 3; }
MISSING(InstantiateModelExchange) MISSING(InstantiateScheduledExecution) MISSING(EnterEventMode) MISSING(GetInt8)
MISSING(GetUInt8) MISSING(GetInt16) MISSING(GetUInt16) MISSING(GetUInt32) MISSING(GetBinary)
MISSING(GetClock) MISSING(SetInt8) MISSING(SetUInt8) MISSING(SetInt16) MISSING(SetUInt16) MISSING(SetUInt32)
MISSING(SetBinary) MISSING(SetClock) MISSING(GetNumberOfVariableDependencies)
MISSING(GetVariableDependencies) MISSING(GetAdjointDerivative)
int fmi3GetDirectionalDerivative(Model *m, const unsigned *z, size_t nz, const unsigned *v, size_t nv, const double *dv,
                                 size_t ndv, double *dz, size_t ndz) { return derivatives(m, z, nz, v, nv, dv, dz); }
MISSING(GetIntervalDecimal) MISSING(GetIntervalFraction) MISSING(GetShiftDecimal)
MISSING(GetShiftFraction) MISSING(SetIntervalDecimal) MISSING(SetIntervalFraction) MISSING(SetShiftDecimal)
MISSING(SetShiftFraction) MISSING(EvaluateDiscreteStates) MISSING(UpdateDiscreteStates) MISSING(EnterStepMode)
MISSING(GetOutputDerivatives) MISSING(ActivateModelPartition)
MISSING(CompletedIntegratorStep) MISSING(EnterContinuousTimeMode) MISSING(SetTime) MISSING(SetContinuousStates)
MISSING(GetContinuousStateDerivatives) MISSING(GetEventIndicators) MISSING(GetContinuousStates)
MISSING(GetNominalsOfContinuousStates) MISSING(GetNumberOfEventIndicators) MISSING(GetNumberOfContinuousStates)
#endif
