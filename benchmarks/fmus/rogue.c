/* An FMU for FMI 2.0 that misbehaves: `resources/rogue.txt` says how and in which call, "segfault doStep". y is the time.
   Without that file it does what it should. */
#include <arpa/inet.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger log; void *allocate, *release, *finished, *environment; } Callbacks;
typedef struct { double time, u; Callbacks call; char name[200], how[40], where[60]; int steps; } Model;

static void *for_ever(void *p) { (void)p; for (;;) usleep(1000); return NULL; }
static void ignore(int s) { (void)s; }

static int act(Model *m, const char *call) {
    if (strcmp(m->where, call)) return 0;
    if (!strcmp(call, "fmi2DoStep") && m->steps++ < 3) return 0;
    if (!strcmp(m->how, "segfault")) *(volatile int *)8 = 1;
    if (!strcmp(m->how, "abort")) abort();
    if (!strcmp(m->how, "fpe")) raise(SIGFPE);
    if (!strcmp(m->how, "hang")) for (;;) sleep(1);
    if (!strcmp(m->how, "exit")) exit(0);
    if (!strcmp(m->how, "_exit")) _exit(7);
    if (!strcmp(m->how, "error")) return 3;
    if (!strcmp(m->how, "fatal")) return 4;
    if (!strcmp(m->how, "status")) return 77;
    if (!strcmp(m->how, "percent")) m->call.log(m->call.environment, m->name, 1, "%s", "100 %% of %n and %-5n");
    if (!strcmp(m->how, "storm"))
        for (int k = 0; k < 20000; k++) m->call.log(m->call.environment, m->name, 1, "storm", "message %d", k);
    if (!strcmp(m->how, "descriptors")) for (int k = 3; k < 1024; k++) close(k);
    if (!strcmp(m->how, "output")) for (int k = 0; k < 3; k++) close(k);
    if (!strcmp(m->how, "thread")) { pthread_t t; pthread_create(&t, NULL, for_ever, NULL); }
    if (!strcmp(m->how, "signals")) for (int s = 1; s < 32; s++) signal(s, ignore);
    if (!strcmp(m->how, "folder")) { if (chdir("/")) return 3; }
    if (!strcmp(m->how, "write")) { /* a file that is named by the environment */
        const char *path = getenv("HOME");
        char file[300];
        snprintf(file, sizeof file, "%s/rogue_was_here", path ? path : "/tmp");
        int f = open(file, O_CREAT | O_WRONLY, 0600);
        if (f < 0) return 3;
        close(f);
    }
    if (!strcmp(m->how, "network")) {
        struct sockaddr_in a = {.sin_family = AF_INET, .sin_port = htons(9), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
        int s = socket(AF_INET, SOCK_STREAM, 0), r = connect(s, (struct sockaddr *)&a, sizeof a);
        (void)r;
        close(s);
    }
    if (!strcmp(m->how, "parent")) { if (kill(getppid(), SIGTERM)) return 3; }
    if (!strcmp(m->how, "memory")) for (;;) memset(malloc(1 << 28), 1, 1 << 28);
    return 0;
}

#define SHOWN __attribute__((visibility("default")))
#define ACT(name) do { int s = act(m, #name); if (s) return s; } while (0)

SHOWN const char *fmi2GetTypesPlatform(void) { return "default"; }
SHOWN const char *fmi2GetVersion(void) { return "2.0"; }
SHOWN int fmi2SetDebugLogging(Model *m, int on, size_t n, const char *const *c) { return 0; }
SHOWN Model *fmi2Instantiate(const char *name, int type, const char *guid, const char *where, const Callbacks *call,
                             int visible, int logging) {
    Model *m = calloc(1, sizeof *m);
    char path[500];
    FILE *file;
    m->call = *call;
    snprintf(m->name, sizeof m->name, "%s", name);
    snprintf(path, sizeof path, "%s/rogue.txt", strncmp(where, "file://", 7) ? where : where + 7);
    if ((file = fopen(path, "r"))) {
        if (fscanf(file, "%39s %59s", m->how, m->where) != 2) m->where[0] = 0;
        fclose(file);
    }
    return act(m, "fmi2Instantiate") ? NULL : m;
}
SHOWN void fmi2FreeInstance(Model *m) { if (m) { act(m, "fmi2FreeInstance"); free(m); } }
SHOWN int fmi2SetupExperiment(Model *m, int d, double tol, double start, int sd, double stop) { ACT(fmi2SetupExperiment); return 0; }
SHOWN int fmi2EnterInitializationMode(Model *m) { ACT(fmi2EnterInitializationMode); return 0; }
SHOWN int fmi2ExitInitializationMode(Model *m) { ACT(fmi2ExitInitializationMode); return 0; }
SHOWN int fmi2Terminate(Model *m) { ACT(fmi2Terminate); return 0; }
SHOWN int fmi2Reset(Model *m) { m->time = 0; return 0; }
SHOWN int fmi2GetReal(Model *m, const unsigned *r, size_t n, double *v) {
    ACT(fmi2GetReal);
    for (size_t k = 0; k < n; k++) v[k] = strcmp(m->how, "nan") ? (r[k] ? m->time : m->u) : NAN;
    return 0;
}
SHOWN int fmi2SetReal(Model *m, const unsigned *r, size_t n, const double *v) {
    ACT(fmi2SetReal);
    for (size_t k = 0; k < n; k++) m->u = v[k];
    return 0;
}
SHOWN int fmi2DoStep(Model *m, double t, double h, int keep) { ACT(fmi2DoStep); m->time = t + h; return 0; }
#define NONE(name) SHOWN int name(void) { return 3; }
NONE(fmi2GetInteger) NONE(fmi2SetInteger) NONE(fmi2GetBoolean) NONE(fmi2SetBoolean) NONE(fmi2GetString) NONE(fmi2SetString)
NONE(fmi2GetFMUstate) NONE(fmi2SetFMUstate) NONE(fmi2FreeFMUstate) NONE(fmi2SerializedFMUstateSize)
NONE(fmi2SerializeFMUstate) NONE(fmi2DeSerializeFMUstate) NONE(fmi2GetDirectionalDerivative)
NONE(fmi2SetRealInputDerivatives) NONE(fmi2GetRealOutputDerivatives) NONE(fmi2CancelStep) NONE(fmi2GetStatus)
NONE(fmi2GetRealStatus) NONE(fmi2GetIntegerStatus) NONE(fmi2GetBooleanStatus) NONE(fmi2GetStringStatus)
