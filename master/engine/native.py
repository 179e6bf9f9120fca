"""Calls of C functions by address from compiled code: what the inner loop does with FMUs.

Each intrinsic casts an address to a function pointer of one FMI signature. Addresses are integers, so one compiled loop
serves every library.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ...core.jit import BOOL, DOUBLE, INT, POINTER, SIZE, c_call


def _intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's decorator; by its types those who call the function would have to give the typing context, too."""
    return intrinsic(function)


def _signature(*parameters: str) -> Any:
    return types.int32(types.int64, *(types.float64 if p == DOUBLE else types.int64 for p in parameters))


_EXCHANGE = (POINTER, POINTER, SIZE, POINTER)
_EXCHANGE_3 = (*_EXCHANGE, SIZE)
_STEP_1 = (POINTER, DOUBLE, DOUBLE, BOOL)
_STEP_2 = (POINTER, DOUBLE, DOUBLE, INT)
_STEP_3 = (POINTER, DOUBLE, DOUBLE, BOOL, POINTER, POINTER, POINTER, POINTER)
_STATUS = (POINTER, INT, POINTER)
_DERIVATIVES = (POINTER, POINTER, SIZE, POINTER, POINTER)
_CLOCK = (INT, POINTER)
_PYTHON = (DOUBLE, DOUBLE)
_SEMAPHORE = (POINTER,)


@_intrinsic
def exchange(_typing: Any, fn: Any, c: Any, references: Any, n: Any, values: Any) -> Any:
    """fmiGet/SetXXX(c, references, n, values) of FMI 1.0 and 2.0."""
    return _signature(*_EXCHANGE), c_call(*_EXCHANGE)


@_intrinsic
def exchange_3(_typing: Any, fn: Any, c: Any, references: Any, n: Any, values: Any, count: Any) -> Any:
    """fmi3Get/SetXXX(instance, references, n, values, count)."""
    return _signature(*_EXCHANGE_3), c_call(*_EXCHANGE_3)


@_intrinsic
def step_1(_typing: Any, fn: Any, c: Any, t: Any, h: Any, new: Any) -> Any:
    """fmiDoStep of FMI 1.0."""
    return _signature(*_STEP_1), c_call(*_STEP_1)


@_intrinsic
def step_2(_typing: Any, fn: Any, c: Any, t: Any, h: Any, no_set_state: Any) -> Any:
    """fmi2DoStep."""
    return _signature(*_STEP_2), c_call(*_STEP_2)


@_intrinsic
def boolean_status(_typing: Any, fn: Any, c: Any, kind: Any, value: Any) -> Any:
    """fmi2GetBooleanStatus(c, kind, value)."""
    return _signature(*_STATUS), c_call(*_STATUS)


@_intrinsic
def step_3(
    _typing: Any, fn: Any, c: Any, t: Any, h: Any, no_set_state: Any, event: Any, terminate: Any, early: Any, last: Any
) -> Any:
    """fmi3DoStep."""
    return _signature(*_STEP_3), c_call(*_STEP_3)


@_intrinsic
def input_derivatives(_typing: Any, fn: Any, c: Any, references: Any, n: Any, orders: Any, values: Any) -> Any:
    """fmi2SetRealInputDerivatives(c, references, n, orders, values)."""
    return _signature(*_DERIVATIVES), c_call(*_DERIVATIVES)


@_intrinsic
def clock_gettime(_typing: Any, fn: Any, clock: Any, where: Any) -> Any:
    """clock_gettime(clock, where) of the C library."""
    return _signature(*_CLOCK), c_call(*_CLOCK)


@_intrinsic
def python(_typing: Any, fn: Any, t: Any, h: Any) -> Any:
    """A Python function (t, h) -> status behind a ctypes callback."""
    return _signature(*_PYTHON), c_call(*_PYTHON)


@_intrinsic
def semaphore(_typing: Any, fn: Any, address: Any) -> Any:
    """sem_wait or sem_post(address) of the C library."""
    return _signature(*_SEMAPHORE), c_call(*_SEMAPHORE)


@_intrinsic
def take_next(_typing: Any, address: Any) -> Any:
    """The integer at an address, which is one more from then on; no two threads get the same."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        place = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.atomic_rmw("add", place, ir.Constant(ir.IntType(64), 1), "seq_cst")

    return types.int64(types.int64), generate
