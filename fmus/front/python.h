/* Makes sure that a Python interpreter with the packages that the FMU needs runs in this process. */
#ifndef DEEPSEA_COSIM_PYTHON_H
#define DEEPSEA_COSIM_PYTHON_H
#include <stddef.h>

/* 1, with `told` (size bytes) empty or a warning, or 0 with `told` saying what is missing and how to get it;
   resources: the FMU's folder. */
int python_ready(const char *resources, char *told, size_t size);

/* Let other threads run Python if this one holds it up; what it gets back from `python_hold`. */
void *python_let_go(void);
void python_hold(void *state);

#endif
