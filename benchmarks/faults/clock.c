/* Preloaded into a process: its clock of the day jumps by CLOCK_JUMP seconds, CLOCK_AFTER seconds from its start. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/time.h>
#include <time.h>

static double after, jump, begin = -1;
static int (*get)(clockid_t, struct timespec *);

static double monotonic(void)
{
    struct timespec now;
    get(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

__attribute__((constructor)) static void set_up(void)
{
    const char *a = getenv("CLOCK_AFTER"), *b = getenv("CLOCK_JUMP");
    get = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    after = a ? atof(a) : 0;
    jump = b ? atof(b) : 0;
    begin = monotonic();
}

int clock_gettime(clockid_t which, struct timespec *out)
{
    int failed;
    if (begin < 0) set_up();
    failed = get(which, out);
    if (!failed && which == CLOCK_REALTIME && monotonic() > begin + after) out->tv_sec += (time_t)jump;
    return failed;
}

int gettimeofday(struct timeval *out, void *zone)
{
    struct timespec now;
    (void)zone;
    if (clock_gettime(CLOCK_REALTIME, &now)) return -1;
    out->tv_sec = now.tv_sec;
    out->tv_usec = now.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *out)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out) *out = now.tv_sec;
    return now.tv_sec;
}
