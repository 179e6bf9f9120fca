"""The native linear FMU, made to talk: a note in every step, a warning, and what debug logging is switched to."""

from __future__ import annotations

from benchmarks import native

from .parts import redescribed

STRUCT = """
#include <stdarg.h>
#if FMI == 1
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger log; void *allocate, *release, *finished; } Callbacks;
#elif FMI == 2
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger log; void *allocate, *release, *finished, *environment; } Callbacks;
#else
typedef void (*Logger)(void *, int, const char *, const char *);
#endif
#define N 6
"""

SAY = """    Logger log; void *environment; char own[64];
} Model;

static void say(Model *m, int status, const char *category, const char *form, ...) {
    char text[512];
    va_list given;
    va_start(given, form);
    vsnprintf(text, sizeof text, form, given);
    va_end(given);
#if FMI == 3
    m->log(m->environment, status, category, text);
#elif FMI == 2
    m->log(m->environment, m->own, status, category, "%s", text);
#else
    m->log(m, m->own, status, category, "%s", text);
#endif
}
"""

STEP = """static int take(Model *m, double t, double h) {
    say(m, 0, "logEvents", "step at %.12g", t);
    say(m, 0, "logAll", "two\\nlines\\tand more");
    if (t > 0.45 && t < 0.55) say(m, 1, "logStatusWarning", "half way");
"""

ON = """{
    char all[256] = "";
    for (size_t k = 0; k < n; k++) { strcat(all, " "); strcat(all, c[k]); }
    say(m, 0, "logAll", "on:%s", all);
    return 0;
}"""

PLACES = {
    1: (
        ("{ (void)m; (void)on; return 0; }", '{ say(m, 0, "logAll", "on:"); return 0; }'),
        ("const void *functions, char logging) {", "Callbacks f, char logging) {"),
        ("(void)functions;\n", "\n"),
        ("return make();\n}\nint Linear_fmiInit",
         "Model *m = make(); m->log = f.log; strcpy(m->own, name); return m;\n}\nint Linear_fmiInit"),
    ),
    2: (
        ("int on, size_t n, const char *const *c) { return 0; }", f"int on, size_t n, const char *const *c) {ON}"),
        ("return make();\n}\nvoid fmi2Free",
         "Model *m = make(); const Callbacks *f = functions; m->log = f->log; m->environment = f->environment;\n"
         "strcpy(m->own, name); return m;\n}\nvoid fmi2Free"),
    ),
    3: (
        ("Bool on, size_t n, const char *const *c) { return 0; }", f"Bool on, size_t n, const char *const *c) {ON}"),
        ("return make();\n}\nvoid fmi3Free",
         "Model *m = make(); m->log = (Logger)log; m->environment = e; return m;\n}\nvoid fmi3Free"),
    ),
}  # fmt: skip
"""What is replaced in an FMI version's part of the source: SetDebugLogging, and how it is instantiated."""

CATEGORIES = "".join(f'<Category name="{name}"/>' for name in ("logAll", "logEvents", "logStatusWarning"))


def talking(folder, version, step=STEP):
    """The FMU of a version in a folder; `step`: how its function that takes a step begins."""
    text = (native.HERE / "fmus" / "linear.c").read_text()
    begin = "static int take(Model *m, double t, double h) {\n"
    for old, new in (("\n#define N 6\n", STRUCT), ("} Model;\n", SAY), (begin, step), *PLACES[version]):
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "talking.c").write_text(text)
    fmu = native.packed(folder / "T.fmu", version, native.compiled(folder / "talking.c", version, folder / "L.so"))
    if version == 1:  # which declares no categories
        return fmu
    listed = f"<LogCategories>{CATEGORIES}</LogCategories><ModelVariables>"
    return redescribed(fmu, folder / "Talking.fmu", ("<ModelVariables>", listed))
