/* Finds Python for an importer that is not Python itself.
 *
 * In this order: the interpreter that the environment variable DEEPSEA_COSIM_PYTHON names; the one that the build wrote into
 * resources/python.txt (`cosim-fmus build --portable`), or that the FMU carries (`--standalone`); python3 on the path. Its library is opened for all to see, because
 * pythonfmu's library and Python's own extension modules take it for granted, and it is started as that interpreter, so
 * that it finds the packages of its (virtual) environment. Where Python runs already, all this is left alone. In both
 * cases the packages of resources/requirements.txt have to be there.
 */
#define _GNU_SOURCE
#include "python.h"

#include <dlfcn.h>
#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>

#define LENGTH 4096

static void *python; /* the library, or the whole process where Python runs already */

/* the first line of a file or of a command's output, without its end; 0 if there is none */
static int first_line(FILE *file, char *line)
{
    char *got = file ? fgets(line, LENGTH, file) : NULL;
    if (got) line[strcspn(line, "\r\n")] = 0;
    return got && *line;
}

/* interpreter (its path) and library of an interpreter that can be run */
static int ask(const char *interpreter, char *program, char *library)
{
    static const char question[] =
        "import os, sys, sysconfig as c; v = c.get_config_var; print(sys.executable); "
        "print(next((p for p in (os.path.join(str(v(d)), str(v(n))) for d in ('LIBDIR', 'LIBPL') "
        "for n in ('INSTSONAME', 'LDLIBRARY')) if '.so' in p and os.path.exists(p)), ''))";
    char command[2 * LENGTH];
    FILE *pipe;
    int ok;
    if (strchr(interpreter, '\'')) return 0;
    snprintf(command, sizeof command, "'%s' -c \"%s\" 2>/dev/null", interpreter, question);
    pipe = popen(command, "r");
    ok = first_line(pipe, program);
    if (!ok || !first_line(pipe, library)) *library = 0;
    if (pipe) pclose(pipe);
    return ok;
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
    if (!inside(resources, program) || !inside(resources, library) || !(file = fopen(library, "r"))) return 0;
    fclose(file);
    return 1;
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
    wchar_t *(*decode)(const char *, size_t *);
    void (*name)(const wchar_t *), (*home)(const wchar_t *), (*initialise)(int), *(*release)(void);
    int *flag;
    void *opened = dlopen(library, RTLD_NOW | RTLD_GLOBAL);
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
    if (name) name(decode(program, NULL)); /* Python keeps the name */
    if (*carried) {
        preload(carried);
        *(void **)&home = dlsym(opened, "Py_SetPythonHome");
        if (home) home(decode(carried, NULL));
        /* the user's own Python is another one */
        if ((flag = dlsym(opened, "Py_IgnoreEnvironmentFlag"))) *flag = 1;
        if ((flag = dlsym(opened, "Py_NoUserSiteDirectory"))) *flag = 1;
        if ((flag = dlsym(opened, "Py_DontWriteBytecodeFlag"))) *flag = 1;
    }
    initialise(0);                         /* the importer's signal handlers stay */
    release();
    python = opened;
    return 1;
}

static int found(const char *resources, char *told, size_t size)
{
    char program[LENGTH], library[LENGTH], carried[LENGTH] = "";
    const char *chosen = getenv("DEEPSEA_COSIM_PYTHON");
    int (*running)(void);
    *(void **)&running = dlsym(RTLD_DEFAULT, "Py_IsInitialized");
    if (running && running()) {
        python = RTLD_DEFAULT;
        return 1;
    }
    if (chosen && *chosen) {
        if (!ask(chosen, program, library)) {
            snprintf(told, size, "DEEPSEA_COSIM_PYTHON=%s is not a Python interpreter", chosen);
            return 0;
        }
    } else if (!written(resources, program, library, carried) && (*carried = 0, !ask("python3", program, library))) {
        snprintf(told, size,
                 "this FMU needs Python 3, which is not found: install it, and let the environment variable "
                 "DEEPSEA_COSIM_PYTHON name the interpreter");
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

/* which packages Python does not find; `lacking` is written by Python itself */
static int complete(const char *resources, char *told, size_t size)
{
    static const char question[] =
        "def _deepsea_cosim_look(path, place, size):\n"
        "    import ctypes, importlib.util, re, sys\n"
        "    try:\n"
        "        wanted = [line.strip() for line in open(path) if line.strip()]\n"
        "    except OSError:\n"
        "        wanted = []\n"
        "    names = [re.split('[=<>~!]', line)[0] for line in wanted]\n"
        "    gone = [line for line, name in zip(wanted, names) if importlib.util.find_spec(name) is None]\n"
        "    if gone:\n"
        "        text = '%%s lacks what this FMU needs: %%s -m pip install %%s' %% (sys.prefix, sys.executable or\n"
        "            'python3', ' '.join('\"%%s\"' %% line for line in gone))\n"
        "        text = text.encode()[:size - 1] + b'\\0'\n"
        "        ctypes.memmove(place, text, len(text))\n"
        "_deepsea_cosim_look(bytes.fromhex('%s').decode(), %llu, %llu)\n"
        "del _deepsea_cosim_look\n";
    int (*ensure)(void), (*run)(const char *);
    void (*release)(int);
    char script[4 * LENGTH], path[LENGTH], hex[2 * LENGTH] = "";
    size_t i;
    int state;
    *(void **)&ensure = dlsym(python, "PyGILState_Ensure");
    *(void **)&release = dlsym(python, "PyGILState_Release");
    *(void **)&run = dlsym(python, "PyRun_SimpleString");
    if (!ensure || !release || !run) return 1;
    if (snprintf(path, sizeof path, "%s/requirements.txt", resources) >= LENGTH) return 1;
    for (i = 0; path[i]; i++) sprintf(hex + 2 * i, "%02x", (unsigned char)path[i]);
    snprintf(script, sizeof script, question, hex, (unsigned long long)(size_t)told, (unsigned long long)size);
    *told = 0;
    state = ensure();
    run(script);
    release(state);
    return !*told;
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
    return (python || found(resources, told, size)) && complete(resources, told, size);
}
