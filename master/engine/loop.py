"""The compiled loop that runs a program step by step.

All values of a system lie on a buffer of 8-byte slots: real numbers as doubles, integers, enumerations and booleans as
64-bit integers. What FMI wants in other widths passes through a staging area. An operation is a row of integers; what
they mean stands beside its code.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.jit import free_kernel, inlined, kernel
from . import native

SET, GET, SET_3, GET_3 = range(4)
"""address, component, references, count, buffer, values (FMI 3.0 only)."""
STEP_1, STEP_2, STEP_3 = range(4, 7)
"""address, component, instance, substeps, place of the out parameters among the bytes of the staging area (FMI 2.0,
3.0), address of fmi2GetBooleanStatus (FMI 2.0), whether a state before the step may be set again."""
PYTHON = 7
"""address of a callback (t, h) -> status."""
COPY, LINEAR, INTEGER_TO_REAL = range(8, 11)
"""target, source, count, constant: for LINEAR and INTEGER_TO_REAL target = constants[c] * source + constants[c + 1]."""
TABLE = 11
"""target, source, first, entries, strict: target = tables[k, 1] where tables[k, 0] = source, which is one if strict."""
MIX = 12
"""target, constant, first, terms: the sum of constants[c + k] * the real in slot tables[first + k, 0]."""
DRIVE, DRIVE_INTEGER = 13, 14
"""target, column of the driven values, START or END of the step."""
START, END = range(2)
STAGE, UNSTAGE = 15, 16
"""width, slot, place in the staging area of that width, count: from the buffer to it, and back."""
INPUT_DERIVATIVES = 17
"""address, component, references, count, orders, slot: the inputs' changes over a step, which lie from the slot on, go
to the FMU as slopes (fmi2SetRealInputDerivatives)."""
LINE = 19
"""target, newest, before, constant: the real newest + constants[c] * (newest - before), for a step of full length; a
shorter one goes as much less far."""
WITHIN = 18
"""slot, count, least, greatest: integers on their way to a type that does not have all values of theirs."""

FORK = 20
"""count: the next operations are so many steps that do not depend on each other; threads take them if that gains."""

OPERANDS = 8

I8, U8, I16, U16, I32, U32, F32 = range(7)
"""Widths of the staging area; booleans are U8 or I32."""

DONE, FAILED, NOT_FINITE, TIME_IS_UP, ENDED = range(5)
"""Why the loop came back; ENDED: an FMU has asked to end the run with the step it has taken."""

WARNING, DISCARD, TERMINATED = 1, 2, 3
"""fmi2Warning, fmi2Discard; fmi2Terminated, the kind of status that tells whether the FMU wants to end the run."""

RETURNED_EARLY, TOO_LARGE, ENDS, UNDERWAY = 1001, 1002, 1003, 1004
"""Further statuses: an FMU of FMI 3.0 came back early; a value does not fit into its target's type; an FMU asks to end
the run with its step; a thread has not come back from a step yet."""

THREADS, NEXT, UNTIL, STOP, POST, WAIT, TRY, WORK, WORKED, STATUS = range(10)
"""What threads have in common (`threads`): how many there are beside the loop; the next operation and the end of those
to be taken; whether to stop; addresses of sem_post, sem_wait and sem_trywait, and of the semaphores of work to do and
of work done; and from STATUS on the status of each operation."""

GAIN = 5e-5
"""Time that threads have to save in a macro step to be woken for it [s]."""

SPIN = 1e-4
"""Time that a thread stays awake for what it waits for [s]: to be woken takes about as long."""

LAST = 0.2
"""Share of the last step in the mean time that an FMU takes for one."""


@free_kernel
def run(
    program: np.ndarray, constants: np.ndarray, tables: np.ndarray, reals: np.ndarray, integers: np.ndarray,
    i8: np.ndarray, u8: np.ndarray, i16: np.ndarray, u16: np.ndarray, i32: np.ndarray, u32: np.ndarray,
    f32: np.ndarray, driven: np.ndarray, rows: np.ndarray, outputs: np.ndarray, inputs: np.ndarray,
    finite: np.ndarray, seconds: np.ndarray, start: float, h: float, first: int, count: int, total: int, last: float,
    clock: int, budget: float, ended: np.ndarray, report: np.ndarray, threads: np.ndarray, spans: np.ndarray,
) -> None:  # fmt: skip
    """Take the steps first, ..., first + count - 1 of h [s] from `start`; step total - 1 takes `last` [s].

    program (operations, OPERANDS); driven (count + 1, columns) has reals, and whole numbers as their 64 bits; rows
    (count, outputs + inputs) gets the slots `outputs` at the start of each step and `inputs` as they are at its end;
    `finite` are the slots that have to be; seconds (instances,) adds up time in doStep; clock is the address of
    clock_gettime or 0. Comes back early when more than `budget` seconds have passed, or after a step in which `ended`
    got the number + 1 of an instance, and its instance, which is given nothing any more. report: why it came back,
    steps done, operation, status, and number + 1 and step of the first operation that ended with a warning, or 0; while
    it runs, steps done and operation are already there. threads, spans: see `THREADS` and `_gains`.
    """
    # One long function: split by kinds of operations (calls, values on the buffer, steps), with all of it inlined, the
    # loop took 1.25 us a step of two native FMUs instead of 1.06.
    spec = np.zeros(2, np.int64)
    where, u8_address = spec.ctypes.data, u8.ctypes.data
    whole = driven.view(np.int64)
    begin = _now(clock, where, spec)
    for k in range(count):
        t = start + (first + k) * h
        step = h if first + k + 1 < total else last
        status, operation = 0, 0
        report[1] = k
        for j in range(len(outputs)):
            rows[k, j] = reals[outputs[j]]
        i = -1
        while i + 1 < len(program):
            i += 1
            o = program[i]
            code = o[0]
            report[2] = i
            if code in (SET, GET):
                if code == SET and o[2] == ended[1]:
                    continue
                status = native.exchange(o[1], o[2], o[3], o[4], o[5])
            elif code == COPY:
                for j in range(o[3]):
                    integers[o[1] + j] = integers[o[2] + j]
            elif code == LINEAR:
                for j in range(o[3]):
                    reals[o[1] + j] = constants[o[4]] * reals[o[2] + j] + constants[o[4] + 1]
            elif code in (STEP_2, STEP_1, STEP_3):
                before = _now(clock, where, spec)
                status = _step(o, t, step, u8, u8_address)
                if status == ENDS:
                    ended[0], ended[1], status = o[3] + 1, o[2], 0
                seconds[o[3]] += _now(clock, where, spec) - before
            elif code == FORK:
                if _gains(program, i, seconds, threads, spans, clock):
                    after = i + 1 + o[1]
                    _fork(program, i + 1, after, t, step, u8, seconds, threads, spans, clock, where, spec)
                    while i + 1 < after and 0 <= status <= 1:
                        i += 1
                        status = threads[STATUS + i]
                        if status == ENDS:
                            ended[0], ended[1], status = program[i, 3] + 1, program[i, 2], 0
                        if status == WARNING and report[4] == 0:
                            report[4], report[5] = i + 1, k
            elif code in (SET_3, GET_3):
                if code == SET_3 and o[2] == ended[1]:
                    continue
                status = native.exchange_3(o[1], o[2], o[3], o[4], o[5], o[6])
            elif code == INTEGER_TO_REAL:
                for j in range(o[3]):
                    reals[o[1] + j] = constants[o[4]] * integers[o[2] + j] + constants[o[4] + 1]
            elif code == DRIVE:
                reals[o[1]] = driven[k + o[3], o[2]]
            elif code == DRIVE_INTEGER:
                integers[o[1]] = whole[k + o[3], o[2]]
            elif code == INPUT_DERIVATIVES:
                if o[2] == ended[1]:
                    continue
                for j in range(o[4]):
                    reals[o[6] + j] /= h  # the last step had that length, if this one is shorter
                status = native.input_derivatives(o[1], o[2], o[3], o[4], o[5], reals.ctypes.data + 8 * o[6])
            elif code == MIX:
                mixed = 0.0
                for j in range(o[4]):
                    mixed += constants[o[2] + j] * reals[tables[o[3] + j, 0]]
                reals[o[1]] = mixed
            elif code == STAGE:
                if not _stage(o, integers, reals, i8, u8, i16, u16, i32, u32, f32):
                    status = TOO_LARGE
            elif code == UNSTAGE:
                _unstage(o, integers, reals, i8, u8, i16, u16, i32, u32, f32)
            elif code == TABLE:
                value = integers[o[2]]
                integers[o[1]] = value  # what is not mapped is kept
                missing = o[5] != 0
                for j in range(o[3], o[3] + o[4]):
                    if tables[j, 0] == value:
                        integers[o[1]] = tables[j, 1]
                        missing = False
                        break
                if missing:
                    status = TOO_LARGE
            elif code == LINE:
                reals[o[1]] = reals[o[2]] + constants[o[4]] * (step / h) * (reals[o[2]] - reals[o[3]])
            elif code == WITHIN:
                for j in range(o[1], o[1] + o[2]):
                    if integers[j] < o[3] or integers[j] > o[4]:
                        status = TOO_LARGE
            elif code == PYTHON:
                status = native.python(o[1], t, step)
            if status == WARNING and report[4] == 0:
                report[4], report[5] = i + 1, k
            if not 0 <= status <= 1:
                operation = i
                break
        for j in range(len(inputs)):
            rows[k, len(outputs) + j] = reals[inputs[j]]
        if not 0 <= status <= 1:
            report[0], report[1], report[2], report[3] = FAILED, k, operation, status
            return
        for j in range(len(finite)):
            if not np.isfinite(reals[finite[j]]):
                report[0], report[1], report[2], report[3] = NOT_FINITE, k + 1, finite[j], 0
                return
        if ended[0] != 0:
            report[0], report[1], report[2], report[3] = ENDED, k + 1, 0, 0
            return
        if budget > 0.0 and _now(clock, where, spec) - begin > budget:
            report[0], report[1], report[2], report[3] = TIME_IS_UP, k + 1, 0, 0
            return
    report[0], report[1], report[2], report[3] = DONE, count, 0, 0


@inlined
def _step(o: np.ndarray, t: float, step: float, u8: np.ndarray, u8_address: int) -> Any:
    """An FMU's steps in a macro step from t on; the status, or `ENDS`."""
    part, status = step / o[4], 0
    for j in range(o[4]):
        now = t + j * part
        if j > 0 and j == o[4] - 1:  # ends with the macro step, and not a rounding error later
            part = t + step - now
            if now + part > t + step:
                part = np.nextafter(part, 0.0)
        no_return = 1 if j == 0 and o[7] == 0 else 0  # the state at t may be set again
        if o[0] == STEP_2:
            status = native.step_2(o[1], o[2], now, part, no_return)
            if status == DISCARD and o[6] != 0:
                native.boolean_status(o[6], o[2], TERMINATED, u8_address + o[5])
                if u8[o[5]] != 0:
                    return ENDS
        elif o[0] == STEP_1:
            status = native.step_1(o[1], o[2], now, part, 1)
        else:
            status = native.step_3(
                o[1], o[2], now, part, no_return, u8_address + o[5], u8_address + o[5] + 1, u8_address + o[5] + 2,
                u8_address + o[5] + 8,
            )  # fmt: skip
            if 0 <= status <= DISCARD and u8[o[5] + 1] != 0:
                return ENDS
            if 0 <= status <= 1 and u8[o[5] + 2] != 0:
                status = RETURNED_EARLY
        if not 0 <= status <= 1:
            break
    return status


@kernel
def _gains(
    program: np.ndarray, fork: int, seconds: np.ndarray, threads: np.ndarray, spans: np.ndarray, clock: int
) -> Any:  # fmt: skip
    """Whether threads save time with the steps behind a fork.

    spans (3, instances): the seconds of each instance when that was asked last, the mean time that it takes for a step,
    and what threads are told, time and step.
    """
    if threads[THREADS] == 0 or clock == 0:
        return threads[THREADS] > 0
    whole, longest = 0.0, 0.0
    for j in range(fork + 1, fork + 1 + program[fork, 1]):
        instance = program[j, 3]
        spans[1, instance] += LAST * (seconds[instance] - spans[0, instance] - spans[1, instance])
        spans[0, instance] = seconds[instance]
        whole += spans[1, instance]
        longest = max(longest, spans[1, instance])
    return whole - max(longest, whole / (threads[THREADS] + 1)) > GAIN


@kernel
def _fork(
    program: np.ndarray, first: int, end: int, t: float, step: float, u8: np.ndarray, seconds: np.ndarray,
    threads: np.ndarray, spans: np.ndarray, clock: int, where: int, spec: np.ndarray,
) -> None:  # fmt: skip
    """Take steps side by side, and wait for all of them."""
    spans[2, 0], spans[2, 1] = t, step
    threads[NEXT], threads[UNTIL] = first, end
    for j in range(first, end):
        threads[STATUS + j] = UNDERWAY
    helpers = min(threads[THREADS], end - first - 1)
    for _ in range(helpers):
        native.semaphore(threads[POST], threads[WORK])
    _take(program, u8, seconds, threads, spans, clock, where, spec)
    for _ in range(helpers):
        _wait(threads, WORKED, clock, where, spec)


@kernel
def _wait(threads: np.ndarray, which: int, clock: int, where: int, spec: np.ndarray) -> None:
    """Wait for a semaphore, awake for a while."""
    begin = _now(clock, where, spec)
    while clock != 0 and _now(clock, where, spec) - begin < SPIN:
        for _ in range(16):
            if native.semaphore(threads[TRY], threads[which]) == 0:
                return
    while native.semaphore(threads[WAIT], threads[which]) != 0:
        pass  # a signal came in between


@kernel
def _take(
    program: np.ndarray, u8: np.ndarray, seconds: np.ndarray, threads: np.ndarray, spans: np.ndarray, clock: int,
    where: int, spec: np.ndarray,
) -> None:  # fmt: skip
    """Take one step after the other of those that no other thread has taken."""
    while True:
        i = native.take_next(threads.ctypes.data + 8 * NEXT)
        if i >= threads[UNTIL]:
            return
        before = _now(clock, where, spec)
        threads[STATUS + i] = _step(program[i], spans[2, 0], spans[2, 1], u8, u8.ctypes.data)
        seconds[program[i, 3]] += _now(clock, where, spec) - before


@free_kernel
def worker_thread(
    program: np.ndarray, u8: np.ndarray, seconds: np.ndarray, threads: np.ndarray, spans: np.ndarray, clock: int
) -> None:  # fmt: skip
    """What a thread beside the loop does: wait for work, until it is to stop."""
    spec = np.zeros(2, np.int64)
    while True:
        _wait(threads, WORK, clock, spec.ctypes.data, spec)
        if threads[STOP] != 0:
            return
        _take(program, u8, seconds, threads, spans, clock, spec.ctypes.data, spec)
        native.semaphore(threads[POST], threads[WORKED])


@kernel
def _now(clock: int, where: int, spec: np.ndarray) -> Any:
    if clock == 0:
        return 0.0
    native.clock_gettime(clock, 1, where)
    return spec[0] + 1e-9 * spec[1]


@kernel
def _stage(
    o: np.ndarray, integers: np.ndarray, reals: np.ndarray, i8: np.ndarray, u8: np.ndarray, i16: np.ndarray,
    u16: np.ndarray, i32: np.ndarray, u32: np.ndarray, f32: np.ndarray,
) -> Any:  # fmt: skip
    """Whether all values fit into the width."""
    fits = True
    for j in range(o[4]):
        slot, place = o[2] + j, o[3] + j
        if o[1] == F32:
            f32[place] = reals[slot]
            fits &= np.isfinite(f32[place]) or not np.isfinite(reals[slot])
            continue
        value = integers[slot]
        if o[1] == I32:
            i32[place] = value
            fits &= i32[place] == value
        elif o[1] == U8:
            u8[place] = value
            fits &= u8[place] == value
        elif o[1] == I8:
            i8[place] = value
            fits &= i8[place] == value
        elif o[1] == I16:
            i16[place] = value
            fits &= i16[place] == value
        elif o[1] == U16:
            u16[place] = value
            fits &= u16[place] == value
        else:
            u32[place] = value
            fits &= u32[place] == value
    return fits


@kernel
def _unstage(
    o: np.ndarray, integers: np.ndarray, reals: np.ndarray, i8: np.ndarray, u8: np.ndarray, i16: np.ndarray,
    u16: np.ndarray, i32: np.ndarray, u32: np.ndarray, f32: np.ndarray,
) -> None:  # fmt: skip
    for j in range(o[4]):
        slot, place = o[2] + j, o[3] + j
        if o[1] == I32:
            integers[slot] = i32[place]
        elif o[1] == U8:
            integers[slot] = u8[place]
        elif o[1] == F32:
            reals[slot] = f32[place]
        elif o[1] == I8:
            integers[slot] = i8[place]
        elif o[1] == I16:
            integers[slot] = i16[place]
        elif o[1] == U16:
            integers[slot] = u16[place]
        else:
            integers[slot] = u32[place]
