"""The journal of a program that is sent: its progress as JSON lines that survive a crash.

The first line names the program, the machine and the first block. Each further line has the number
of packets sent, acknowledged and done, the last block that is done for certain and the last one
that was sent, and the place of the tool (work frame, mm): as the machine reports it, or else the
end of the last block that is done. A line is written before its bytes are sent, and again before
the next ones are. After a crash, the last complete line is valid. `still` in the last line: true
if the machine is known to stand at its place. The journal of an earlier program is kept until
something of the new one is sent.

    {"journal": 1, "program": "logo.nc", "sha256": "…", "machine": "…", "first": 0, "at": "…"}
    {"s": 1.25, "sent": 12, "acknowledged": 9, "done": 0, "block": -1, "last": 11, …}
    {"s": 9.1, "end": "stopped", "why": "", "sent": 34, …, "place": [1, 2, 0.5], "still": true}"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from camtool.errors import InputError, OutputError

VERSION = 1
"""Version of the format; a journal of another version is refused."""
SUFFIX = ".journal"
SYNC_S = 1.0
"""Interval of fsync, which also runs at the end."""


Point = tuple[float, float, float]


class JournalState(Struct, frozen=True):
    """The state in a journal: digests of the program and of the machine; the target; the first
    block (from 0) that is not surely done; True if the program is finished; the last block that
    was sent (−1: none); the place of the tool (mm, None if unknown), and True if it is known to
    stand there."""

    sha256: str
    machine: str
    target: str
    block: int
    finished: bool
    last: int = -1
    tool_mm: Point | None = None
    is_still: bool = False


class Journal:
    """A journal that is being written. Raises OutputError when it cannot be written, since the
    progress of the program would be lost."""

    def __init__(self, file: Path, head: Mapping[str, Any], *, appends: bool = False) -> None:
        """Begin a journal, which replaces an earlier one as soon as something has been sent; with
        `appends`, append to the earlier one."""
        self.file = file
        self._replaces = not appends
        self._begun = self._synced = time.monotonic()
        self._last: dict[str, Any] = {}
        try:
            self._handle = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
            self._end_line()
        except OSError as error:
            raise self._refused(error) from error
        started = time.strftime("%Y-%m-%dT%H:%M:%S%z")
        self._head = {"journal": VERSION, **head, "at": started}
        self._add(self._head, sync=True)

    def note(self, place: Point | None = None, **counts: Any) -> None:
        """Write these counts and the place of the tool as a line, if they differ from the last
        ones. Nothing is written before something is sent."""
        if counts == self._last or not counts.get("sent"):
            return
        self._last = counts
        time_s = time.monotonic()
        line = {"s": round(time_s - self._begun, 3), **counts, "place": place}
        if self._replaces:
            self._replaces = False
            self._begin_anew()
        self._add(line, sync=time_s - self._synced >= SYNC_S)

    def _begin_anew(self) -> None:
        """Remove the lines of an earlier program from the file."""
        with suppress(OSError):  # a pipe or device cannot be truncated
            os.lseek(self._handle, 0, os.SEEK_SET)
            os.ftruncate(self._handle, 0)
        self._add(self._head, sync=False)

    def close(self, end: str, reason: str, *, is_still: bool = False, **counts: Any) -> None:
        """Write the last line: how sending ended, and the counts. `is_still`: the machine is known
        to stand at the place in them."""
        seconds = round(time.monotonic() - self._begun, 3)
        try:
            line = {"s": seconds, "end": end, "why": reason, **counts, "still": is_still}
            self._add(line, sync=True)
        finally:
            os.close(self._handle)

    def _end_line(self) -> None:
        """Go to the end of the file, and complete a line that a crash cut short."""
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
                self._synced = time.monotonic()
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
    sent: int = 0
    block: int = -1
    last: int = -1
    end: str = ""
    place: Point | None = None
    still: bool = False


def read_journal(file: Path) -> JournalState:
    """Return the state in a journal; InputError for a file that is no journal."""
    if file.exists() and not file.is_file():
        raise InputError("is no file that could hold a journal", file=str(file))
    try:
        rows = file.read_bytes().split(b"\n")
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})", file=str(file), mend="nothing was sent from here"
        ) from error
    head = _head(rows[0])
    if head is None:
        raise InputError("is no journal of camtool send", file=str(file))
    place, new = JournalState(head.sha256, head.machine, head.target, head.first, False), head
    for row in rows:
        head_again = _head(row)
        if head_again is not None:
            new = head_again
            continue
        try:
            line = msgspec.json.decode(row, type=_Line)
        except msgspec.DecodeError:
            continue  # cut short by a crash
        if not line.sent and line.end != "finished":
            continue  # nothing was sent: the earlier state is still valid
        block = max(line.block + 1, new.first)
        if new is head:
            block = max(block, place.block)
        head = new
        last, tool = max(line.last, new.first - 1), line.place
        place = JournalState(
            head.sha256,
            head.machine,
            head.target,
            block,
            line.end == "finished",
            last,
            tool,
            line.still,
        )
    return place


def _head(row: bytes) -> _Head | None:
    """Parse the first line of a journal; None if it is another kind of line, InputError if it is
    from another version of camtool."""
    try:
        head = msgspec.json.decode(row, type=_Head)
    except msgspec.DecodeError:
        return None
    if head.journal != VERSION:
        raise InputError("is a journal of another camtool")
    return head


def digest(data: bytes) -> str:
    """Return the SHA-256 of the data, hexadecimal."""
    return hashlib.sha256(data).hexdigest()
