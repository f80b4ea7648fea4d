"""The Program: the bytes for one machine, and the contract of whatever writes and reads them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from camtool.arrays import Ints
from camtool.findings import Finding
from camtool.machine.model import Machine
from camtool.toolpath.moves import Toolpath


@dataclass(frozen=True, eq=False)
class Program:
    """`data` for the machine `target`, to be stored with `extension` (".pic").

    `row_of_block` (B,) gives for each block the row of the toolpath that it came from, −1 for
    blocks of the dialect's own (header, footer).
    """

    data: bytes
    extension: str
    target: str
    row_of_block: Ints
    findings: tuple[Finding, ...] = ()

    @classmethod
    def of_lines(
        cls,
        lines: Iterable[str],
        machine: Machine,
        row_of_block: Sequence[int] | Ints,
        findings: Iterable[Finding],
    ) -> Program:
        """A program of lines of ASCII text, for a machine that calls its programs so."""
        return cls(
            data="".join(f"{line}\n" for line in lines).encode("ascii"),
            extension=machine.target.extension,
            target=machine.target.name,
            row_of_block=np.array(row_of_block, dtype=np.int64),
            findings=tuple(findings),
        )


@dataclass(frozen=True)
class Listing:
    """A program for people: `blocks` (B,) are its lines, numbered as in `Toolpath.block`;
    `binary` where they are bytes in hex."""

    blocks: tuple[str, ...]
    binary: bool = False


class PostProcessor(Protocol):
    """One dialect. `read` shares no code with `write`, so a fault in one shows in the other.

    Where a program's file is not what goes over the line to the machine (a listing, a dump), a
    post has besides `line_bytes(data, machine) -> int`: how many bytes do. One whose moves may
    leave the wanted path on purpose has `stray_mm(machine) -> float`: how far at most. One whose
    coordinates are finer or coarser than the machine's steps has `unit_mm(machine) -> float`:
    their finest difference. One whose programs start the spindle, at the speed that they say, has
    `starts_spindle = True`; one whose machine file stands for any machine, with travel and rates
    of none in particular, `any_machine = True`. One that can show which part of a program each
    block is has `listing(data, machine) -> Listing`, of a program that `read` takes.
    """

    name: str

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit this dialect."""

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError when the machine or the dialect cannot do it."""

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as this machine's controller decodes them; ProgramError with block, column."""
