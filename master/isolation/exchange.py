"""What goes between master and worker in a step, as bytes: the operations, their time, and the values of signals.

A whole step is one message there and one back, copied from and to the slots of the buffer, for pickling arrays took
longer than sending them. Messages of every other kind are pickled, and begin with another byte.
"""

from __future__ import annotations

import pickle
import struct
from collections.abc import Sequence

from ..engine.program import ValueBuffer
from ..engine.values import TEXT, ExchangeGroup
from . import plain_pickle

SET, STEP, GET = b"s", b"d", b"g"
"""Operations: give the inputs, do a step, read the outputs."""

MARK = b"\x01"
"""First byte of a step's messages; a pickle begins with another one."""

REQUEST = struct.Struct("<c3s4xdd")
"""Mark, operations in their order, start and length of the step [s]."""

REPLY = struct.Struct("<c?6xd")
"""Mark, whether the FMU has asked to end the run, time spent in doStep [s]."""


class SignalBytes:
    """The values of some groups of signals in a buffer, as bytes: slots first, then texts."""

    def __init__(self, groups: Sequence[ExchangeGroup]):
        self._slots = [slice(8 * g.place, 8 * (g.place + g.count)) for g in groups if g.fmi_type.family != TEXT]
        self._texts = [slice(g.place, g.place + g.count) for g in groups if g.fmi_type.family == TEXT]

    def pack(self, buffer: ValueBuffer) -> bytes:
        """The values as they are now."""
        slots = buffer.reals.data.cast("B")
        content = b"".join([slots[place] for place in self._slots])
        return content + pickle.dumps([buffer.texts[place] for place in self._texts]) if self._texts else content

    def unpack(self, content: memoryview, buffer: ValueBuffer) -> None:
        """Put values into a buffer."""
        slots, start = buffer.reals.data.cast("B"), 0
        for place in self._slots:
            end = start + place.stop - place.start
            slots[place] = content[start:end]
            start = end
        if self._texts:
            for place, texts in zip(self._texts, plain_pickle.loads(content[start:]), strict=True):
                buffer.texts[place] = texts


def is_step(message: bytes) -> bool:
    """Whether a message belongs to a step."""
    return message[:1] == MARK


def request(operations: bytes, t: float, h: float, inputs: bytes) -> bytes:
    """What the worker is to do: operations, each at most once; inputs: packed, where they are to be given."""
    return REQUEST.pack(MARK, operations, t, h) + inputs


def read_request(message: bytes) -> tuple[bytes, float, float, memoryview]:
    """Operations, start and length of the step [s], packed inputs."""
    _, operations, t, h = REQUEST.unpack_from(message)
    return operations.rstrip(b"\0"), t, h, memoryview(message)[REQUEST.size :]


def reply(ended: bool, seconds: float, outputs: bytes) -> bytes:
    """What the worker answers to `GET`."""
    return REPLY.pack(MARK, ended, seconds) + outputs


def read_reply(message: bytes) -> tuple[bool, float, memoryview]:
    """Whether the FMU has asked to end the run, time spent in doStep [s], packed outputs."""
    _, ended, seconds = REPLY.unpack_from(message)
    return ended, seconds, memoryview(message)[REPLY.size :]
