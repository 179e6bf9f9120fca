/* Tells another thread that this process is about to end in foreign code: by a crash, or by exit().
 *
 * The thread that gets the byte, the signal's number or ENDED, writes what there is and ends the process in its own way.
 * If it does not answer within a moment (`heard`), because the one that crashed holds Python's lock or no foreign code
 * was called, all goes its way as without this.
 */
#include <signal.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define SHOWN __attribute__((visibility("default")))
#define ENDED 250
enum { PAUSE_NS = 10000000, MOMENT = 200, PATIENCE = 6000 }; /* 2 s, and 60 s for what is written */

static const int kinds[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
enum { KINDS = sizeof kinds / sizeof *kinds };
static struct sigaction before[KINDS];
static volatile int speaker = -1, answered, ending;
static volatile long thread;
static int registered;
static char stack[65536]; /* of the handler: the crash may be that the other one is full */

static void tell(unsigned char what)
{
    struct timespec pause = {0, PAUSE_NS};
    int k;
    answered = 0;
    if (speaker < 0 || write(speaker, &what, 1) != 1) return;
    for (k = 0; k < (answered ? PATIENCE : MOMENT); k++) nanosleep(&pause, NULL);
}

static void crashed(int number)
{
    int k;
    if (__atomic_exchange_n(&ending, 1, __ATOMIC_SEQ_CST)) /* another thread did, and has the word */
        for (;;) pause();
    thread = syscall(SYS_gettid);
    tell((unsigned char)number);
    for (k = 0; k < KINDS; k++) sigaction(kinds[k], &before[k], NULL);
    /* what crashed does so again, and finds the handler that was there before */
}

static void ended(void) { tell(ENDED); }

/* From here on `writer` gets the byte. */
SHOWN void watch_for_the_end(int writer)
{
    struct sigaction mine = {0};
    stack_t other = {0}, there;
    int k;
    if (!sigaltstack(NULL, &there) && (there.ss_flags & SS_DISABLE)) {
        other.ss_sp = stack;
        other.ss_size = sizeof stack;
        sigaltstack(&other, NULL);
    }
    ending = 0;
    mine.sa_handler = crashed;
    mine.sa_flags = SA_ONSTACK | SA_NODEFER;
    sigemptyset(&mine.sa_mask);
    for (k = 0; k < KINDS; k++) sigaction(kinds[k], &mine, &before[k]);
    if (!registered) registered = !atexit(ended);
    speaker = writer;
}

SHOWN void watch_no_longer(void)
{
    int k;
    if (speaker < 0 || ending) return; /* what crashes in several threads is told once */
    speaker = -1;
    for (k = 0; k < KINDS; k++) sigaction(kinds[k], &before[k], NULL);
}

/* Which thread has crashed, as the system numbers them. */
SHOWN long crashed_thread(void) { return thread; }

/* The other thread has understood, and ends the process. */
SHOWN void heard(void) { answered = 1; }
