"""Formulas over a run: signals, parameters, numbers and the measures of `results.measures`, e.g.
`mean(hydraulics.Pa - hydraulics.P1, 2, took + 2)`.

They may stand in anybody's package, so they are no Python: what is not in this file is refused. A name is an address;
one that is no Python name stands in `signal('b.D[1,1]')`. Where a number does not exist, None, what is computed with it
does not exist either; `missing(x)` asks for that.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from ...core.errors import CosimError, did_you_mean
from ..results.measures import FUNCTIONS

Number = float | np.ndarray | None

OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}  # fmt: skip
WINDOWED = ("min", "max", "mean", "rms", "range", "integral")
"""Measures that may be followed by a beginning and an end [s]."""

LONGEST, DEEPEST = 1000, 50
"""Letters of a formula, and parts in parts of it."""


class FormulaError(CosimError):
    """A formula that cannot be computed."""


class Formula:
    """A formula, parsed once; raises `FormulaError` for what is none."""

    def __init__(self, text: str):
        self.text = text
        if len(text) > LONGEST:
            raise FormulaError(f"a formula of {len(text)} letters is too long")
        try:
            self._tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise FormulaError(f"'{text}' is no formula") from None
        self.names = tuple(dict.fromkeys(_names(self._tree, 0)))
        """The addresses in it."""

    def of(self, times: np.ndarray, values: Mapping[str, Number]) -> Number:
        """Its value, from the signals (n,) at the times (n,) [s] and the numbers that its names stand for."""
        with np.errstate(all="ignore"):
            try:
                return _value(self._tree, times, values)
            except (ArithmeticError, ValueError, TypeError):
                raise FormulaError(f"'{self.text}' cannot be computed") from None


def _names(node: ast.AST, depth: int) -> list[str]:
    """The addresses in a formula, all of whose parts are allowed."""
    if depth > DEEPEST:
        raise FormulaError(f"its parts are nested more than {DEEPEST} deep")
    inner: Sequence[ast.AST]
    match node:
        case ast.Constant(value=bool() | int() | float()):
            return []
        case ast.Name() | ast.Attribute():
            return [_address(node)]
        case ast.Call(func=ast.Name(id="signal"), args=[ast.Constant(value=str() as address)], keywords=[]):
            return [address]
        case ast.Call(func=ast.Name(id=function), args=inner, keywords=[]):
            _check_call(function, len(inner))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            inner = [left, right]
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            inner = [operand]
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in OPERATORS:
            inner = [left, right]
        case ast.BoolOp(values=inner):
            pass
        case _:
            raise FormulaError(f"'{ast.unparse(node)}' is not allowed in a formula")
    return [name for part in inner for name in _names(part, depth + 1)]


def _address(node: ast.AST) -> str:
    if isinstance(node, ast.Attribute):
        return f"{_address(node.value)}.{node.attr}"
    if not isinstance(node, ast.Name):
        raise FormulaError(f"'{ast.unparse(node)}' is no address")
    return node.id


def _check_call(function: str, count: int) -> None:
    known = {name: (1 + least, 1 + most + 2 * (name in WINDOWED)) for name, (_, least, most) in FUNCTIONS.items()}
    known |= {"missing": (1, 1), "abs": (1, 1)}
    if function not in known:
        raise FormulaError(f"there is no function '{function}'{did_you_mean(function, list(known))}")
    least, most = known[function]
    if not least <= count <= most:
        wanted = f"{least}" if least == most else f"{least} to {most}"
        raise FormulaError(f"{function} takes {wanted} values, not {count}")


def _value(node: ast.AST, times: np.ndarray, values: Mapping[str, Number]) -> Number:
    def of(part: ast.AST) -> Number:
        return _value(part, times, values)

    match node:
        case ast.Constant(value=bool() | int() | float() as value):
            return float(value)
        case ast.Name() | ast.Attribute():
            return _known(_address(node), values)
        case ast.Call(func=ast.Name(id="signal"), args=[ast.Constant(value=str() as address)]):
            return _known(address, values)
        case ast.Call(func=ast.Name(id="missing"), args=[part]):
            return float(of(part) is None)
        case ast.Call(func=ast.Name(id=function), args=parts):
            return _measured(function, times, [of(part) for part in parts])
        case ast.BoolOp(op=op, values=parts):
            return _both_or_either(isinstance(op, ast.And), [of(part) for part in parts])
        case ast.UnaryOp(op=op, operand=operand):
            return _applied(op, [of(operand)])
        case ast.BinOp(left=left, op=op, right=right) | ast.Compare(left=left, ops=[op], comparators=[right]):
            return _applied(op, [of(left), of(right)])
    raise FormulaError(f"'{ast.unparse(node)}' is not allowed in a formula")


def _known(address: str, values: Mapping[str, Number]) -> Number:
    if address not in values:
        raise FormulaError(f"there is no signal or parameter '{address}'{did_you_mean(address, list(values))}")
    return values[address]


def _applied(op: ast.AST, operands: list[Number]) -> Number:
    if any(x is None for x in operands):
        return None
    found = OPERATORS[type(op)](*operands)
    return found if isinstance(found, np.ndarray) else float(found)


def _both_or_either(both: bool, operands: list[Number]) -> Number:
    if any(x is None for x in operands):
        return None
    return float((all if both else any)(bool(x) for x in operands))


def _measured(function: str, times: np.ndarray, operands: list[Number]) -> Number:
    """A measure of a signal; a parameter is one that does not change."""
    if any(x is None for x in operands):
        return None
    signal, numbers = operands[0], [_single(x) for x in operands[1:]]
    if function == "abs":
        return np.abs(signal) if isinstance(signal, np.ndarray) else abs(_single(signal))
    x = np.broadcast_to(np.asarray(signal, dtype=float), times.shape)
    if function in WINDOWED and numbers:
        begin, end = (*numbers, float(times[-1]))[:2]
        if not times[0] <= begin < end <= times[-1]:
            return None
        inside = np.concatenate([[begin], times[(times > begin) & (times < end)], [end]])
        times, x, numbers = inside, np.interp(inside, times, x), []
    return FUNCTIONS[function][0](times, x, *numbers)


def _single(x: Number) -> float:
    if isinstance(x, np.ndarray):
        raise FormulaError("a signal stands where a number should: take mean(...), at(..., t) or another measure of it")
    assert x is not None
    return x


def number(found: Number) -> float | None:
    """A formula's value as a number; None where there is none, or it is not finite."""
    if isinstance(found, np.ndarray):
        raise FormulaError("it is a signal, no number: take mean(...), at(..., t) or another measure of it")
    return found if found is not None and isfinite(found) else None


