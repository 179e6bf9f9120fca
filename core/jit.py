"""One decorator for compiled kernels, so that every kernel is compiled the same way and cached on disk; and what it
takes that C code calls a kernel (`STEP`, `address_of`, `array_at`) and a kernel C code (`call_2` to `call_5i`).

Numba's cache of a function looks only at that function's own file. A change in another file that the
function was inlined from would go unnoticed. So each FMU unpacks its code into a folder named after the content
of all sources, and the tests drop every compiled kernel when a source has changed; whoever runs kernels
from a folder that is being edited without the tests should delete its *.nbi and *.nbc files.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from typing import Any, cast

import numba
import numpy as np
from llvmlite import ir
from numba import njit
from numba.extending import intrinsic, overload

nb: Any = numba  # numba's types are not complete
types, COMPILED = nb.types, not nb.config.DISABLE_JIT


def kernel(function: Callable[..., Any], nogil: bool = False, inline: bool = False) -> Callable[..., Any]:
    """Compile with IEEE arithmetic (no fast-math), division by zero giving inf, cached on disk.

    Where nothing can be written, neither beside the code nor in the user's cache folder, each process compiles anew.
    """
    made = njit(error_model="numpy", nogil=nogil, forceinline=inline)(function)
    if hasattr(made, "enable_caching"):
        with suppress(RuntimeError):  # "no locator available"
            made.enable_caching()
    if not hasattr(made, "py_func"):  # with NUMBA_DISABLE_JIT it is the function itself
        made.py_func = function
    return made


def free_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel that lets other threads run meanwhile."""
    return kernel(function, nogil=True)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel whose code stands where it is called: a call would show in a loop of a microsecond."""
    return kernel(function, inline=True)


STEP = types.int64(types.int64, types.int64, types.int64, types.int64, types.float64, types.float64)
"""Signature of a kernel that C code calls: two arrays of float64, each by address and length, and two numbers."""


@cache
def address_of(step: Any) -> int:
    """Where the code of a kernel with the signature `STEP` stands, for C; 0 where kernels are not compiled."""
    if not COMPILED:
        return 0
    return int(_compiled(step.py_func).address)


@cache
def called(step: Any) -> Callable[..., int]:
    """The same code for Python, for a kernel that is called itself is compiled once more."""
    if not COMPILED:
        return cast(Callable[..., int], step)
    return ctypes.PYFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 4, *[ctypes.c_double] * 2)(address_of(step))


@cache
def _compiled(function: Callable[..., Any]) -> Any:
    try:
        return nb.cfunc(STEP, cache=True, error_model="numpy")(function)
    except RuntimeError:  # "no locator available"
        return nb.cfunc(STEP, error_model="numpy")(function)


def _typed_pointer(_context: Any, address: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.float64)(types.int64), generate


POINTER, SIZE, INT, DOUBLE, BOOL = "pointer", "size", "int", "double", "bool"
_LL = {
    POINTER: ir.IntType(8).as_pointer(),
    SIZE: ir.IntType(64),
    INT: ir.IntType(32),
    DOUBLE: ir.DoubleType(),
    BOOL: ir.IntType(8),
    None: ir.VoidType(),
}


def c_call(*parameters: str, result: str | None = INT) -> Callable[..., Any]:
    """Code generator of a call fn(parameters) by the function's address, all arguments but doubles given as 64-bit
    integers."""

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_LL[result], [_LL[p] for p in parameters])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        given = []
        for value, p in zip(arguments[1:], parameters, strict=True):
            if p == POINTER:
                given.append(builder.inttoptr(value, _LL[POINTER]))
            elif p in (INT, BOOL):
                given.append(builder.trunc(value, _LL[p]))
            else:
                given.append(value)
        made = builder.call(function, given)
        return context.get_dummy_value() if result is None else made

    return generate


def record_in(row: np.ndarray, first: int, kind: np.dtype) -> Any:
    """The record of that kind (see `records`) in a row of float64 from the number `first` on.

    In kernels it costs nothing, where slicing the row and viewing it takes two calls each time.
    """
    return row[first : first + kind.itemsize // row.itemsize].view(kind)[0]


def _record_at(_context: Any, address: Any, kind: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return kind.dtype(types.uintp, kind), generate


def _of_two(_context: Any, address: Any, a: Any, b: Any) -> Any:
    return types.void(*[types.int64] * 3), c_call(POINTER, POINTER, result=None)


def _of_three(_context: Any, address: Any, a: Any, b: Any, c: Any) -> Any:
    return types.void(*[types.int64] * 4), c_call(POINTER, POINTER, POINTER, result=None)


def _of_three_and_number(_context: Any, address: Any, a: Any, b: Any, c: Any, x: Any) -> Any:
    return types.void(*[types.int64] * 4, types.float64), c_call(POINTER, POINTER, POINTER, DOUBLE, result=None)


def _of_five_and_int(_context: Any, address: Any, a: Any, b: Any, c: Any, d: Any, e: Any, i: Any) -> Any:
    return types.void(*[types.int64] * 7), c_call(*[POINTER] * 5, INT, result=None)


_record: Any = intrinsic(_record_at)


@overload(record_in)
def _record_in(row: Any, first: Any, kind: Any) -> Any:
    def made(row: Any, first: Any, kind: Any) -> Any:
        return _record(row.ctypes.data + 8 * first, kind)

    return made


carray: Any = nb.carray
_pointer, _call_2, _call_3, _call_3d, _call_5i = (
    cast(Any, intrinsic(made))
    for made in (_typed_pointer, _of_two, _of_three, _of_three_and_number, _of_five_and_int)
)

if not COMPILED:

    def array_at(address: int, n: int) -> np.ndarray:
        """The float64 array (n,) at an address."""
        return np.ctypeslib.as_array((ctypes.c_double * n).from_address(address))

    def call_2(address: int, a: int, b: int) -> None:
        """Call the C function of two pointers, and without a result, that stands at an address."""
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2)(address)(a, b)

    def call_3(address: int, a: int, b: int, c: int) -> None:
        """The same of three pointers."""
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(address)(a, b, c)

    def call_3d(address: int, a: int, b: int, c: int, x: float) -> None:
        """The same of three pointers and a number."""
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3, ctypes.c_double)(address)(a, b, c, x)

    def call_5i(address: int, a: int, b: int, c: int, d: int, e: int, i: int) -> None:
        """The same of five pointers and an int."""
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5, ctypes.c_int)(address)(a, b, c, d, e, i)

else:

    @njit
    def array_at(address: int, n: int) -> np.ndarray:
        """The float64 array (n,) at an address."""
        found: np.ndarray = carray(_pointer(address), (n,))
        return found

    @njit
    def call_2(address: int, a: int, b: int) -> None:
        """Call the C function of two pointers, and without a result, that stands at an address."""
        _call_2(address, a, b)

    @njit
    def call_3(address: int, a: int, b: int, c: int) -> None:
        """The same of three pointers."""
        _call_3(address, a, b, c)

    @njit
    def call_3d(address: int, a: int, b: int, c: int, x: float) -> None:
        """The same of three pointers and a number."""
        _call_3d(address, a, b, c, x)

    @njit
    def call_5i(address: int, a: int, b: int, c: int, d: int, e: int, i: int) -> None:
        """The same of five pointers and an int."""
        _call_5i(address, a, b, c, d, e, i)
