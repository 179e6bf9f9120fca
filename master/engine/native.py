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

_POINTER, _SIZE, _INT, _DOUBLE, _BOOL = "pointer", "size", "int", "double", "bool"

_LL = {
    _POINTER: ir.IntType(8).as_pointer(),
    _SIZE: ir.IntType(64),
    _INT: ir.IntType(32),
    _DOUBLE: ir.DoubleType(),
    _BOOL: ir.IntType(8),
}


def _call(*parameters: str) -> Callable[..., Any]:
    """Code generator of a call fn(parameters) -> int, all arguments but doubles given as 64-bit integers."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_LL[_INT], [_LL[p] for p in parameters])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        cast = []
        for value, p in zip(arguments[1:], parameters, strict=True):
            if p == _POINTER:
                cast.append(builder.inttoptr(value, _LL[_POINTER]))
            elif p in (_INT, _BOOL):
                cast.append(builder.trunc(value, _LL[p]))
            else:
                cast.append(value)
        return builder.call(function, cast)

    return generate


def _signature(*parameters: str) -> Any:
    return types.int32(types.int64, *(types.float64 if p == _DOUBLE else types.int64 for p in parameters))


_EXCHANGE = (_POINTER, _POINTER, _SIZE, _POINTER)
_EXCHANGE_3 = (*_EXCHANGE, _SIZE)
_STEP_1 = (_POINTER, _DOUBLE, _DOUBLE, _BOOL)
_STEP_2 = (_POINTER, _DOUBLE, _DOUBLE, _INT)
_STEP_3 = (_POINTER, _DOUBLE, _DOUBLE, _BOOL, _POINTER, _POINTER, _POINTER, _POINTER)
_STATUS = (_POINTER, _INT, _POINTER)
_DERIVATIVES = (_POINTER, _POINTER, _SIZE, _POINTER, _POINTER)
_CLOCK = (_INT, _POINTER)
_PYTHON = (_DOUBLE, _DOUBLE)


@intrinsic
def exchange(_typing: Any, fn: Any, c: Any, references: Any, n: Any, values: Any) -> Any:
    """fmiGet/SetXXX(c, references, n, values) of FMI 1.0 and 2.0."""
    return _signature(*_EXCHANGE), _call(*_EXCHANGE)


@intrinsic
def exchange_3(_typing: Any, fn: Any, c: Any, references: Any, n: Any, values: Any, count: Any) -> Any:
    """fmi3Get/SetXXX(instance, references, n, values, count)."""
    return _signature(*_EXCHANGE_3), _call(*_EXCHANGE_3)


@intrinsic
def step_1(_typing: Any, fn: Any, c: Any, t: Any, h: Any, new: Any) -> Any:
    """fmiDoStep of FMI 1.0."""
    return _signature(*_STEP_1), _call(*_STEP_1)


@intrinsic
def step_2(_typing: Any, fn: Any, c: Any, t: Any, h: Any, no_set_state: Any) -> Any:
    """fmi2DoStep."""
    return _signature(*_STEP_2), _call(*_STEP_2)


@intrinsic
def boolean_status(_typing: Any, fn: Any, c: Any, kind: Any, value: Any) -> Any:
    """fmi2GetBooleanStatus(c, kind, value)."""
    return _signature(*_STATUS), _call(*_STATUS)


@intrinsic
def step_3(
    _typing: Any, fn: Any, c: Any, t: Any, h: Any, no_set_state: Any, event: Any, terminate: Any, early: Any, last: Any
) -> Any:
    """fmi3DoStep."""
    return _signature(*_STEP_3), _call(*_STEP_3)


@intrinsic
def derivatives(_typing: Any, fn: Any, c: Any, references: Any, n: Any, orders: Any, values: Any) -> Any:
    """fmi2SetRealInputDerivatives(c, references, n, orders, values)."""
    return _signature(*_DERIVATIVES), _call(*_DERIVATIVES)


@intrinsic
def clock_gettime(_typing: Any, fn: Any, clock: Any, where: Any) -> Any:
    """clock_gettime(clock, where) of the C library."""
    return _signature(*_CLOCK), _call(*_CLOCK)


@intrinsic
def python(_typing: Any, fn: Any, t: Any, h: Any) -> Any:
    """A Python function (t, h) -> status behind a ctypes callback."""
    return _signature(*_PYTHON), _call(*_PYTHON)
