"""The journal of a program that is sent: how far it has come, as JSON lines that survive a crash.

The first line says what is sent, by what and where to; each further line how many packets were
sent, acknowledged and done, and the last block that is done for certain, with the seconds since
the beginning. A line is written before the bytes that it speaks of go out, and before the next
ones do. After a crash, the last whole line holds.

    {"journal": 1, "program": "logo.nc", "sha256": "…", "machine": "…", "first": 0, "at": "…"}
    {"s": 1.25, "sent": 12, "acknowledged": 9, "done": 0, "block": -1}
    {"s": 60.1, "end": "finished", "why": "", "sent": 340, …}
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from camtool.errors import InputError, OutputError

VERSION = 1
"""The form of journals: one of another form is refused."""
SUFFIX = ".journal"
SYNC_S = 1.0
"""What it says is brought to the disk itself once in so many seconds, and at the end."""


class Place(Struct, frozen=True):
    """Where a journal stands: the digest of the program, that of the machine, the target, the
    first block that is not done for certain (from 0), and whether the program is finished."""

    sha256: str
    machine: str
    target: str
    block: int
    finished: bool


class Journal:
    """A journal that is being written. OutputError when it cannot be: nobody would know any more
    how far the program has come."""

    def __init__(
        self,
        file: Path,
        head: Mapping[str, Any],
        *,
        more: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """A new one; with `more`, behind what an earlier one says."""
        self.file, self._clock = file, clock
        self._begun = self._synced = clock()
        self._last: dict[str, Any] = {}
        try:
            flags = os.O_RDWR | os.O_CREAT | (0 if more else os.O_TRUNC)
            self._handle = os.open(file, flags, 0o666)
            self._end_line()
        except OSError as error:
            raise self._refused(error) from error
        at = time.strftime("%Y-%m-%dT%H:%M:%S%z")
        self._add({"journal": VERSION, **head, "at": at}, sync=True)

    def note(self, **counts: Any) -> None:
        """These counts, unless they are what was said last."""
        if counts != self._last:
            self._last = counts
            now = self._clock()
            self._add(
                {"s": round(now - self._begun, 3), **counts}, sync=now - self._synced >= SYNC_S
            )

    def close(self, end: str, why: str, **counts: Any) -> None:
        """The end, and what was reached."""
        seconds = round(self._clock() - self._begun, 3)
        try:
            self._add({"s": seconds, "end": end, "why": why, **counts}, sync=True)
        finally:
            os.close(self._handle)

    def _end_line(self) -> None:
        """Go to the end; a line that was being written when all ended is given its end."""
        if os.lseek(self._handle, 0, os.SEEK_END):
            os.lseek(self._handle, -1, os.SEEK_END)
            if os.read(self._handle, 1) != b"\n":
                os.write(self._handle, b"\n")

    def _add(self, line: Mapping[str, Any], *, sync: bool) -> None:
        data = json.dumps(line, ensure_ascii=False).encode("utf-8", "backslashreplace") + b"\n"
        try:
            while data:
                data = data[os.write(self._handle, data) :]
            if sync:
                os.fsync(self._handle)
                self._synced = self._clock()
        except OSError as error:
            raise self._refused(error) from error

    def _refused(self, error: OSError) -> OutputError:
        return OutputError(
            f"the journal cannot be written ({error.strerror})",
            file=str(self.file),
            mend="make room, or choose another place with --journal",
        )


class _Head(msgspec.Struct):
    journal: int
    sha256: str
    machine: str
    target: str
    first: int = 0


class _Line(msgspec.Struct):
    block: int = -1
    end: str = ""


def read_journal(file: Path) -> Place:
    """Where a journal stands; InputError for a file that is none."""
    try:
        rows = file.read_bytes().split(b"\n")
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})", file=str(file), mend="nothing was sent from here"
        ) from error
    head, block, finished = _head(rows[0]), -1, False
    if head is None:
        raise InputError("is no journal of camtool send", file=str(file))
    for row in rows:
        again = _head(row)
        if again is not None:
            head, block, finished = again, max(block, again.first - 1), False
            continue
        try:
            line = msgspec.json.decode(row, type=_Line)
        except msgspec.DecodeError:
            continue  # was being written when all ended
        block, finished = max(block, line.block), line.end == "finished"
    return Place(head.sha256, head.machine, head.target, block + 1, finished)


def _head(row: bytes) -> _Head | None:
    """The first line of a journal, None for another; InputError for one of another camtool."""
    try:
        head = msgspec.json.decode(row, type=_Head)
    except msgspec.DecodeError:
        return None
    if head.journal != VERSION:
        raise InputError("is a journal of another camtool")
    return head
