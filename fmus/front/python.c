/* Finds Python for an importer that is not Python itself.
 *
 * In this order: the interpreter that the environment variable DEEPSEA_COSIM_PYTHON names; the one that the build wrote
 * into resources/python.txt (`cosim-fmus build --portable`), or that the FMU carries (`--standalone`); python3 on the
 * path. Its library is opened for all to see, because pythonfmu's library and Python's own extension modules take it for
 * granted, and it is started as that interpreter, so that it finds the packages of its (virtual) environment. Where
 * Python runs already, all this is left alone. In both cases the packages of resources/requirements.txt have to be there.
 */
#define _GNU_SOURCE
#include "python.h"

#include <dlfcn.h>
#include <glob.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <wchar.h>

#define LENGTH 4096

#define LEAST 311 /* version of Python, times 100 */

static void *_Atomic python; /* the library, or the whole process where Python runs already */

/* Python starts once in a process, which may have loaded several of these libraries: a lock that all of them share,
 * because the linker makes symbols of this kind one. Where it does not know them, each library has its own. */
__asm__(".pushsection .data\n"
        ".balign 16\n"
        ".globl deepsea_cosim_start_of_python\n"
        ".type deepsea_cosim_start_of_python, @gnu_unique_object\n"
        ".size deepsea_cosim_start_of_python, 128\n"
        "deepsea_cosim_start_of_python: .zero 128\n"
        ".popsection\n");
extern pthread_mutex_t deepsea_cosim_start_of_python; /* zeros are an unlocked mutex */

static struct sigaction before; /* what Ctrl-C did before Python was started */
static int started;             /* this library has just done that */

/* the first line of a file or of a command's output, without its end; 0 if there is none */
static int first_line(FILE *file, char *line)
{
    char *got = file ? fgets(line, LENGTH, file) : NULL;
    if (got) line[strcspn(line, "\r\n")] = 0;
    return got && *line;
}

#define MARK "deepsea-cosim=" /* what an answer begins with: Python may be set up to greet */

/* the next line of an interpreter's output that answers */
static int answer(FILE *pipe, char *line)
{
    size_t length = strlen(MARK);
    while (pipe && fgets(line, LENGTH, pipe)) {
        line[strcspn(line, "\r\n")] = 0;
        if (strncmp(line, MARK, length)) continue;
        memmove(line, line + length, strlen(line + length) + 1);
        return *line != 0;
    }
    *line = 0;
    return 0;
}

/* interpreter (its path), library and version (times 100) of an interpreter that can be run */
static int ask(const char *interpreter, char *program, char *library, int *version)
{
    static const char question[] =
        "import os, sys, sysconfig as c; v = c.get_config_var; s = '\\n" MARK "'; sys.stdout.write(s + s.join(("
        "sys.executable, str(sys.version_info[0] * 100 + sys.version_info[1]), "
        "next((p for p in (os.path.join(str(v(d)), str(v(n))) for d in ('LIBDIR', 'LIBPL') "
        "for n in ('INSTSONAME', 'LDLIBRARY')) if '.so' in p and os.path.exists(p)), ''))) + '\\n')";
    char number[LENGTH];
    char command[4 * LENGTH], *to = command;
    FILE *pipe;
    int ok;
    if (strlen(interpreter) > LENGTH / 2) return 0;
    *to++ = '\'';
    for (; *interpreter; interpreter++) { /* for the shell: a quote ends the string, stands alone, and begins it anew */
        to += sprintf(to, *interpreter == '\'' ? "'\\''" : "%c", *interpreter);
    }
    sprintf(to, "' -c \"%s\" 2>/dev/null", question);
    pipe = popen(command, "r");
    ok = answer(pipe, program) && answer(pipe, number);
    if (ok) *version = atoi(number);
    if (!ok || !answer(pipe, library)) *library = 0;
    if (pipe) pclose(pipe);
    return ok && *program == '/' && !access(program, X_OK);
}

/* a path that may be relative to the FMU's resources; 0 if it does not fit */
static int inside(const char *resources, char *path)
{
    char whole[LENGTH];
    if (*path == '/') return 1;
    if (snprintf(whole, sizeof whole, "%s/%s", resources, path) >= LENGTH) return 0;
    strcpy(path, whole);
    return 1;
}

/* what the build wrote: interpreter and library, if they are still there; `carried` is the home of a Python that the FMU
   carries with it, or empty */
static int written(const char *resources, char *program, char *library, char *carried)
{
    char path[LENGTH];
    FILE *file;
    int ok;
    *carried = 0;
    if (snprintf(path, sizeof path, "%s/python.txt", resources) >= LENGTH) return 0;
    file = fopen(path, "r");
    ok = first_line(file, program) && first_line(file, library);
    if (file) fclose(file);
    if (!ok) return 0;
    if (*library != '/' && snprintf(carried, LENGTH, "%s/python", resources) >= LENGTH) return 0;
    if (!inside(resources, program) || !inside(resources, library) || access(library, R_OK)) return 0;
    if (*carried) {
        glob_t found; /* without them Python ends the process */
        snprintf(path, sizeof path, "%s/lib/python3*/encodings/__init__.py", carried);
        ok = !glob(path, 0, NULL, &found);
        if (ok) globfree(&found);
        return ok;
    }
    return !access(program, X_OK);
}

/* open the libraries that a carried Python's modules need, so that they are found; in any order that works */
static void preload(const char *carried)
{
    char pattern[LENGTH];
    glob_t found;
    size_t i;
    int round;
    if (snprintf(pattern, sizeof pattern, "%s/lib/preload/*.so*", carried) >= LENGTH) return;
    if (glob(pattern, 0, NULL, &found)) return;
    for (round = 0; round < 3; round++)
        for (i = 0; i < found.gl_pathc; i++) dlopen(found.gl_pathv[i], RTLD_NOW | RTLD_GLOBAL);
    globfree(&found);
}

static int start(const char *program, const char *library, const char *carried, char *told, size_t size)
{
    char *locale;
    wchar_t *(*decode)(const char *, size_t *);
    void (*name)(const wchar_t *), (*home)(const wchar_t *), (*initialise)(int), *(*release)(void);
    int *flag, (*running)(void);
    void *opened;
    if (*carried) preload(carried);
    opened = dlopen(library, RTLD_NOW | RTLD_GLOBAL);
    if (!opened) {
        snprintf(told, size, "Python's library cannot be opened: %s", dlerror());
        return 0;
    }
    *(void **)&decode = dlsym(opened, "Py_DecodeLocale");
    *(void **)&name = dlsym(opened, "Py_SetProgramName");
    *(void **)&initialise = dlsym(opened, "Py_InitializeEx");
    *(void **)&release = dlsym(opened, "PyEval_SaveThread");
    if (!decode || !initialise || !release) {
        snprintf(told, size, "%s is not a library of Python 3", library);
        return 0;
    }
    *(void **)&running = dlsym(opened, "Py_IsInitialized");
    if (running && running()) { /* the importer keeps its Python to itself */
        python = opened;
        return 1;
    }
    if ((flag = dlsym(opened, "Py_UTF8Mode"))) *flag = 1; /* names of files are UTF-8, whatever the locale */
    if (name) name(decode(program, NULL)); /* Python keeps the name */
    if (*carried) {
        *(void **)&home = dlsym(opened, "Py_SetPythonHome");
        if (home) home(decode(carried, NULL));
        /* the user's own Python is another one */
        if ((flag = dlsym(opened, "Py_IgnoreEnvironmentFlag"))) *flag = 1;
        if ((flag = dlsym(opened, "Py_NoUserSiteDirectory"))) *flag = 1;
        if ((flag = dlsym(opened, "Py_DontWriteBytecodeFlag"))) *flag = 1;
    }
    locale = setlocale(LC_CTYPE, NULL);
    if (locale) locale = strdup(locale);
    started = !sigaction(SIGINT, NULL, &before);
    initialise(0);
    release();
    if (locale) setlocale(LC_CTYPE, locale); /* the importer's; Python itself reads and writes UTF-8 */
    free(locale);
    python = opened;
    return 1;
}

static int found(const char *resources, char *told, size_t size)
{
    char program[LENGTH], library[LENGTH], carried[LENGTH] = "", own[LENGTH], other[LENGTH];
    const char *chosen = getenv("DEEPSEA_COSIM_PYTHON");
    int (*running)(void), version = LEAST;
    *(void **)&running = dlsym(RTLD_DEFAULT, "Py_IsInitialized");
    if (running && running()) {
        python = RTLD_DEFAULT;
        return 1;
    }
    if (chosen && *chosen) {
        if (!ask(chosen, program, library, &version)) {
            snprintf(told, size, "DEEPSEA_COSIM_PYTHON=%s is not a Python interpreter", chosen);
            return 0;
        }
    } else if (written(resources, program, library, carried)) {
        strcpy(own, program);
        if (!*carried && !ask(program, own, other, &version)) { /* where it cannot start it would end this process */
            snprintf(told, size, "%s cannot be started%s", program,
                     getenv("PYTHONHOME") || getenv("PYTHONPATH")
                         ? ": the environment's PYTHONHOME or PYTHONPATH are those of another Python"
                         : "");
            return 0;
        }
    } else if (*carried = 0, !ask("python3", program, library, &version)) {
        snprintf(told, size,
                 "this FMU needs Python 3, which is not found: install it, and let the environment variable "
                 "DEEPSEA_COSIM_PYTHON name the interpreter");
        return 0;
    }
    if (version < LEAST) { /* once opened it would stay in the process */
        snprintf(told, size, "this FMU needs Python %d.%d or a later one; %s is %d.%d", LEAST / 100, LEAST % 100, program,
                 version / 100, version % 100);
        return 0;
    }
    if (!*library) {
        snprintf(told, size,
                 "%s has no shared library (libpython3.x.so): install it (Debian: libpython3-dev), or let "
                 "DEEPSEA_COSIM_PYTHON name an interpreter that has one",
                 program);
        return 0;
    }
    return start(program, library, carried, told, size);
}

/* which packages Python does not find; `told` is written by Python itself, and begins with ! where one is missing.
 *
 * A Python that another FMU of ours has brought into the process lacks what only this one carries: then the packages of
 * this FMU, or of the interpreter it was built with, are added.
 */
static int complete(const char *resources, char *told, size_t size)
{
    static const char question[] =
        "import os, sys\n"
        "if not os.path.isdir(sys.prefix):\n" /* carried by an FMU whose folder is gone */
        "    home = os.path.join(resources, 'python', 'lib', 'python%d.%d' % sys.version_info[:2])\n"
        "    sys.path[:] = [p for p in sys.path if os.path.exists(p)]\n"
        "    sys.path += [p for p in (home, os.path.join(home, 'lib-dynload')) if os.path.isdir(p) and p not in sys.path]\n"
        "import ctypes, importlib.util, re, signal\n"
        "importlib.invalidate_caches()\n"
        "def look():\n"
        "    if sys.version_info < (3, 11):\n"
        "        return '!this FMU needs Python 3.11 or a later one; %s is %d.%d' % (\n"
        "            sys.executable or 'that of this process', *sys.version_info[:2])\n"
        "    lost = ''\n"
        "    try:\n"
        "        wanted = [line.strip() for line in open(os.path.join(resources, 'requirements.txt')) if line.strip()]\n"
        "    except OSError:\n"
        "        return ''\n"
        "    name = lambda line: re.split('[=<>~!]', line)[0]\n"
        "    gone = lambda: [line for line in wanted if importlib.util.find_spec(name(line)) is None]\n"
        "    tail = os.path.join('lib', 'python%d.%d' % sys.version_info[:2], 'site-packages')\n"
        "    places = [os.path.join(resources, 'python', tail)]\n"
        "    try:\n"
        "        with open(os.path.join(resources, 'python.txt')) as file:\n"
        "            known = file.readline().strip()\n"
        "        if not os.environ.get('DEEPSEA_COSIM_PYTHON'):\n" /* who names an interpreter means its packages */
        "            places.append(os.path.join(os.path.dirname(os.path.dirname(known)), tail))\n"
        "        if os.path.isabs(known) and not os.path.exists(known):\n"
        "            lost = ' (%s, with which it was built, is gone)' % known\n"
        "    except OSError:\n"
        "        pass\n"
        "    for place in places:\n"
        "        if gone() and os.path.isabs(place) and os.path.isdir(place) and place not in sys.path:\n"
        "            sys.path.append(place)\n"
        "    if gone():\n"
        "        there = sys.executable and os.path.exists(sys.executable)\n"
        "        way = sys.executable if there else 'python3 (of the version that this process runs)'\n"
        "        return '!%s lacks what this FMU needs%s: %s -m pip install %s' % (\n"
        "            sys.prefix, lost, way, ' '.join('\"%s\"' % line for line in gone()))\n"
        "    from importlib import metadata\n"
        "    other = []\n"
        "    for line in wanted:\n"
        "        try:\n"
        "            found = metadata.version(name(line))\n"
        "        except metadata.PackageNotFoundError:\n"
        "            continue\n"
        "        if '==' in line and found != line.partition('==')[2]:\n"
        "            other.append('%s, here is %s' % (line, found))\n"
        "    return 'this FMU was built with %s: it may fail or compute something else' % '; '.join(other) if other else ''\n"
        "try:\n"
        "    text = look()\n"
        "except Exception as error:\n"
        "    text = 'the packages of Python could not be looked at: %r' % error\n"
        "text = text.encode('utf-8', 'replace')[:size - 1] + bytes(1)\n"
        "ctypes.memmove(place, text, len(text))\n";
    int (*ensure)(void), (*run)(const char *);
    void (*release)(int);
    char script[4 * LENGTH], hex[2 * LENGTH] = "";
    size_t i;
    int state;
    *told = 0;
    *(void **)&ensure = dlsym(python, "PyGILState_Ensure");
    *(void **)&release = dlsym(python, "PyGILState_Release");
    *(void **)&run = dlsym(python, "PyRun_SimpleString");
    if (!ensure || !release || !run || strlen(resources) >= LENGTH) return 1;
    for (i = 0; resources[i]; i++) sprintf(hex + 2 * i, "%02x", (unsigned char)resources[i]);
    snprintf(script, sizeof script,
             "exec(r\"\"\"%s\"\"\", {'resources': bytes.fromhex('%s').decode('utf-8', 'surrogateescape'), 'place': %llu, "
             "'size': %llu})\n",
             question, hex, (unsigned long long)(size_t)told, (unsigned long long)size);
    state = ensure();
    run(script);
    release(state);
    if (*told != '!') return 1;
    memmove(told, told + 1, strlen(told));
    return 0;
}

void *python_let_go(void)
{
    int (*holds)(void);
    void *(*release)(void);
    if (!python) return NULL;
    *(void **)&holds = dlsym(python, "PyGILState_Check");
    *(void **)&release = dlsym(python, "PyEval_SaveThread");
    return holds && release && holds() ? release() : NULL;
}

void python_hold(void *state)
{
    void (*restore)(void *);
    if (!state) return;
    *(void **)&restore = dlsym(python, "PyEval_RestoreThread");
    if (restore) restore(state);
}

int python_ready(const char *resources, char *told, size_t size)
{
    int ready = 1;
    if (!python) {
        pthread_mutex_lock(&deepsea_cosim_start_of_python);
        ready = found(resources, told, size);
        pthread_mutex_unlock(&deepsea_cosim_start_of_python);
    }
    ready = ready && complete(resources, told, size);
    if (started) { /* Python takes Ctrl-C for itself as soon as it imports `signal`, which has been done now */
        sigaction(SIGINT, &before, NULL);
        started = 0;
    }
    return ready;
}
