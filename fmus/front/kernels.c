/* What object code made by numba may call of numba's runtime. The kernels allocate nothing and raise nothing. */
#include <stdlib.h>

void NRT_Free(void *p) { free(p); }
void NRT_MemInfo_call_dtor(void *info) { (void)info; }
void NRT_incref(void *info) { (void)info; }
void NRT_decref(void *info) { (void)info; }
int numba_gil_ensure(int *state) { return *state = 0; }
void numba_gil_release(int *state) { (void)state; }
void *numba_unpickle(const char *data, int n, const char *hash) { (void)data, (void)n, (void)hash; abort(); }
int numba_do_raise(void *what) { (void)what; abort(); }
void *numba_runtime_build_excinfo_struct(void *a, void *b) { (void)a, (void)b; abort(); }

/* new strides for a contiguous array that gets another shape */
int numba_attempt_nocopy_reshape(long nd, const long *dims, const long *strides, long new_nd, const long *new_dims,
                                 long *new_strides, long item, int fortran)
{
    long k, stride = item;
    (void)nd, (void)dims, (void)strides;
    if (fortran) return 0;
    for (k = new_nd - 1; k >= 0; k--) {
        new_strides[k] = stride;
        stride *= new_dims[k];
    }
    return 1;
}
