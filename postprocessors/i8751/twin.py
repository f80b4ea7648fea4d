"""The Intel 8751 at the other end of its serial line, as docs/wires/i8751.md describes it.

Nothing is taken before the key 13H (L4397-4426). Then each byte of a record is stored and answered
(L4428-4463), and nothing moves until 45H ends the packet; when its records have been executed the
controller says F, and takes the next packet or 54H, which it answers by A (L4343-4383)."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Final, Literal

import msgspec
import numpy as np

from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.target.twin import COMMANDED, Slides, Travel, Twin, travel_of

from .controller import I8751Model
from .dialect import RECORDS_PER_PACKET, I8751Controller, I8751Dialect
from .read import ACCESS, DATA_END, PACKET_END, STANDS, read_packet

if TYPE_CHECKING:
    from camtool.toolpath.moves import Toolpath

STORED: Final = b"M"
"""A datum has been stored (L4443-4463)."""

EXECUTED: Final = ord("F")
"""The packet has been executed (L4343-4357)."""

DONE: Final = ord("A")
"""The end of the data has been taken (L4372-4383)."""

SENSES: Final = (3, 4, STANDS)
"""Forward, backward, standing (L4106-4119)."""

HOMING_HZ: Final = 8.0
"""Rate of a motor that seeks its origin, which the thesis does not give: that at the begin of a
ramp (L3150-3183)."""

LINE_ENDS: Final = {"none": b"", "cr": b"\r", "lf": b"\n", "crlf": b"\r\n"}
"""Possible line ends behind LISTO and OTRO."""


class I8751TwinSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open.

    `key`: 13H opens the acquisition "once", or stands before "each-packet". `line_end`: behind
    LISTO and OTRO. `motor_reply`: to the number of a motor, printed as B and as 8. `dwell_reply`:
    to the two bytes of a wait, B being the reply to a motor. `packet_end`: to 45H. `opening` of
    the line by somebody does "nothing", or a "reset". `homing`: at the "start" of its program, to
    optos that stand at `origin_mm` on each axis, from where the power came on; or "none"."""

    key: Literal["once", "each-packet"] = "once"
    line_end: Literal["crlf", "cr", "lf", "none"] = "crlf"
    motor_reply: Literal["B", "8"] = "B"
    dwell_reply: Literal["B M", "M", "none"] = "B M"
    packet_end: Literal["F", "M F"] = "F"
    opening: Literal["nothing", "reset"] = "nothing"
    homing: Literal["none", "start"] = "none"
    origin_mm: Annotated[float, msgspec.Meta(ge=-1000.0, le=1000.0)] = -2.0


class I8751Twin(Twin):
    """The controller after a reset, at rest."""

    settings = I8751TwinSettings
    wire = "2400 8N1"
    byte_s = 10.0 / 2400.0

    def __init__(
        self, machine: Machine[I8751Controller, I8751Dialect], choices: I8751TwinSettings
    ) -> None:
        super().__init__(Slides(machine))
        self._machine, self._choices = machine, choices
        self._model = I8751Model()
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._executing: Iterator[tuple[Travel, int]] | None = None
        self._reset()

    def connect(self, now: float) -> bytes:
        """Open the line, which a controller at rest does not notice."""
        output = super().connect(now)
        if self._choices.opening == "reset" and self._executing is None:
            self._reset()
        return output

    def _reset(self) -> None:
        self._dialogue = self._program()
        next(self._dialogue)
        self._is_homing = self._choices.homing == "start"
        if self._is_homing:
            self._executing = self._to_origin()
            self._next_record()

    def _to_origin(self) -> Iterator[tuple[Travel, int]]:
        """Yield the motion of each motor to its opto switch, one motor after the other; a motor
        that already covers its switch stands still."""
        for axis, step_mm in enumerate(self._step_mm):
            place = self.slides.commanded_mm
            count = max(math.ceil((place[axis] - self._choices.origin_mm) / step_mm - 1e-9), 0)
            commanded = np.tile(place, (count, 1))
            commanded[:, axis] -= step_mm * np.arange(1, count + 1)
            seconds = np.arange(1, count + 1) / HOMING_HZ
            yield Travel(commanded, seconds, np.zeros(count), count / HOMING_HZ), -1

    def _receive_byte(self, octet: int) -> None:
        if self._executing is None:
            self._dialogue.send(octet)

    def _wake(self) -> None:
        if self._executing is not None and not self.is_moving:
            self._next_record()

    # The dialogue. Bytes that it does not wait for are neither stored nor answered (our choice).

    def _program(self) -> Generator[None, int, None]:
        """Receive one program after the other, byte by byte, as a coroutine."""
        while True:
            yield from self._key((yield))
            yield from self._receive_one_of(1)
            yield from self._packet()
            expected_octet = ACCESS if self._choices.key == "each-packet" else 1
            while (octet := (yield)) != DATA_END:
                if expected_octet == ACCESS:
                    yield from self._key(octet)
                    octet = yield from self._receive_one_of(1)
                if octet == 1:
                    yield from self._packet()
            self._out.append(DONE)

    def _key(self, octet: int) -> Generator[None, int, None]:
        """Answer OTRO to each byte until the key comes, then LISTO."""
        end = LINE_ENDS[self._choices.line_end]
        while octet != ACCESS:
            self._out += b"OTRO" + end
            octet = yield
        self._out += b"LISTO" + end
        self.commands.append(bytes([ACCESS]))

    def _packet(self) -> Generator[None, int, None]:
        """Receive records, the first of which has begun, up to the end of the packet, and execute
        them."""
        records: list[bytes] = []
        octet = 1
        while octet != PACKET_END:
            records.append((yield from self._record()))
            is_full = len(records) == RECORDS_PER_PACKET
            octet = yield from self._receive_one_of(PACKET_END, *(() if is_full else (1,)))
        if self._choices.packet_end == "M F":
            self._out += STORED
        self._execute(records)

    def _record(self) -> Generator[None, int, bytes]:
        """Receive a record whose first byte has come; return its bytes."""
        record = bytearray()
        for motor in (1, 2, 3):
            if motor > 1:
                yield from self._receive_one_of(motor)
            self._out += self._choices.motor_reply.encode()
            sense = yield from self._receive_one_of(*SENSES)
            self._out += STORED
            record += bytes([motor, sense])
            for _ in range(0 if sense == STANDS else 2):
                record.append((yield))
                self._out += STORED
            if motor > 1:
                first, second = self._dwell_replies
                record.append(
                    (yield from self._receive_one_of(self._machine.dialect.dwell_mark_byte))
                )
                self._out += first
                record.append((yield))
                self._out += second
        return bytes(record)

    @property
    def _dwell_replies(self) -> tuple[bytes, bytes]:
        """Replies to the mark of a wait, which stands where a motor's number could, and to its
        seconds."""
        if self._choices.dwell_reply == "none":
            return b"", b""
        mark = STORED if self._choices.dwell_reply == "M" else self._choices.motor_reply.encode()
        return mark, STORED

    @staticmethod
    def _receive_one_of(*octets: int) -> Generator[None, int, int]:
        """Receive bytes until one of `octets` comes, and return it."""
        while (octet := (yield)) not in octets:
            pass
        return octet

    # What is executed.

    def _execute(self, records: list[bytes]) -> None:
        """Begin with the first of these records. Records that cannot be decoded, as those of a
        motor that turns for 0 steps, do nothing: the controller does not even answer F."""
        start_steps = np.rint(self.slides.commanded_mm / self._step_mm).astype(np.int64)
        try:
            path = read_packet(b"".join(records), self._machine, start_steps)
        except ProgramError:
            return
        block = len(self.decoded)
        records[-1] += bytes([PACKET_END])
        self.decoded += records
        self._executing = self._travels(path, block, len(records))
        self._next_record()

    def _travels(self, path: Toolpath, block: int, count: int) -> Iterator[tuple[Travel, int]]:
        """Yield the motion of each record, and the record's index."""
        edges = np.searchsorted(path.block, np.arange(count + 1))
        for index, (low, high) in enumerate(pairwise(edges.tolist())):
            rows = path.part(low, high)
            chunks = self._model.run(rows, self._machine, COMMANDED) if high > low else ()
            yield travel_of(chunks), block + index

    def _next_record(self) -> None:
        assert self._executing is not None
        for travel, block in self._executing:
            self.slides.begin(travel, self.now, block)
            return
        self._executing = None
        if not self._is_homing:
            self._out.append(EXECUTED)
        self._is_homing = False
