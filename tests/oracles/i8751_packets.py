"""i8751 packets read record by record, each by one pattern, and byte by byte where it fails."""

from __future__ import annotations

import re

from camtool_postprocessors.i8751.dialect import RECORDS_PER_PACKET, I8751Dialect
from camtool_postprocessors.i8751.read import ACCESS, DATA_END, PACKET_END, ByteFault

_MOTOR = rb"(?:\x05|([\x03\x04])(.)(.))"


class PacketReader:
    """Bytes in, records out; ByteFault at the first byte that does not fit."""

    def __init__(self, data: bytes, dialect: I8751Dialect) -> None:
        self._data = data
        self._dialect = dialect
        mark = re.escape(bytes([dialect.dwell_mark_byte]))
        pair = mark + rb"(.)"
        self._pattern = re.compile(
            rb"\x01" + _MOTOR + rb"\x02" + _MOTOR + pair + rb"\x03" + _MOTOR + pair, re.DOTALL
        )
        self._steps: list[tuple[int, int, int]] = []
        self._waits: list[tuple[int, int]] = []
        self._at = 0

    def read(self) -> list[tuple[int, ...]]:
        """All records of the stream."""
        self._take_key()
        while True:
            self._packet()
            if self._peek("45H before it ended a packet: now 54H or another packet") == DATA_END:
                break
            if self._dialect.key == "each-packet":
                self._take_key()
        if self._at + 1 != len(self._data):
            raise self._fault(self._at + 1, "a byte after 54H, the end of data", "remove it")
        return [(*steps, *waits) for steps, waits in zip(self._steps, self._waits, strict=True)]

    def _peek(self, wanted: str) -> int:
        """The byte here; a fault when there is none."""
        if self._at >= len(self._data):
            raise self._fault(self._at, f"the program breaks off: wanted {wanted}")
        return self._data[self._at]

    def _take_key(self) -> None:
        if self._peek("the access key 13H") != ACCESS:
            mend = "see dialect.key" if self._at else "give a file of i8751 packets"
            byte = self._data[self._at]
            raise self._fault(self._at, f"{byte:02X}H is not the access key 13H", mend)
        self._at += 1

    def _packet(self) -> None:
        """Records up to and with the 45H behind the last one."""
        for record in range(RECORDS_PER_PACKET + 1):
            byte = self._peek("motor 01H of a record" + (", or 45H" if record else ""))
            if record and byte == PACKET_END:
                self._at += 1
                return
            if record == RECORDS_PER_PACKET:
                raise self._fault(
                    self._at,
                    f"{byte:02X}H where the packet must end: it has {RECORDS_PER_PACKET} records",
                    "end it with 45H",
                )
            self._record()

    def _record(self) -> None:
        match = self._pattern.match(self._data, self._at)
        if match is None:
            self._walk()
            raise self._fault(self._at, "bytes that are not a record")
        sense1, high1, low1, sense2, high2, low2, wait1, sense3, high3, low3, wait2 = (
            match.groups()
        )
        x, y, z = self._dialect.signs
        self._steps.append(
            (
                x * self._moved(sense1, high1, low1, match.start(2)),
                y * self._moved(sense2, high2, low2, match.start(5)),
                z * self._moved(sense3, high3, low3, match.start(9)),
            )
        )
        self._waits.append((wait1[0], wait2[0]))
        self._at = match.end()

    def _moved(self, sense: bytes | None, high: bytes, low: bytes, offset: int) -> int:
        """Steps of a motor, forward positive; a motor that turns for 0 steps is a fault."""
        if sense is None:
            return 0
        pulses = high[0] * self._dialect.high_byte_steps + low[0]
        if not pulses:
            raise self._fault(
                offset, "a motor turns, but for 0 steps", "write 05H for a motor that stands"
            )
        steps = pulses - self._dialect.lost_pulses
        return steps if sense == b"\x03" else -steps

    def _walk(self) -> None:
        """ByteFault at the first byte that keeps the record from being one."""
        at = self._motor(self._at, 1)
        at = self._wait(self._motor(at, 2), "T1")
        self._wait(self._motor(at, 3), "T2")

    def _motor(self, at: int, number: int) -> int:
        self._want(at, (number,), f"motor {number:02d}H")
        self._want(at + 1, (3, 4, 5), f"the sense of motor {number}: 03H, 04H or 05H")
        if self._data[at + 1] == 5:
            return at + 2
        self._want(at + 2, None, f"PH of motor {number}")
        self._want(at + 3, None, f"PL of motor {number}")
        return at + 4

    def _wait(self, at: int, name: str) -> int:
        mark = self._dialect.dwell_mark_byte
        self._want(at, (mark,), f"{mark:02X}H before {name}")
        self._want(at + 1, None, f"the seconds of {name}")
        return at + 2

    def _want(self, at: int, allowed: tuple[int, ...] | None, what: str) -> None:
        if at >= len(self._data):
            raise self._fault(at, f"the program breaks off: wanted {what}")
        byte = self._data[at]
        if allowed is not None and byte not in allowed:
            mend = ""
            if {byte, *allowed} == {0x00, 0x30}:
                mend = f"use --set dialect.dwell_mark={byte:02X}H"
            raise self._fault(at, f"{byte:02X}H: wanted {what}", mend)

    def _fault(self, at: int, message: str, mend: str = "") -> ByteFault:
        return ByteFault(at, len(self._steps), message, mend)
