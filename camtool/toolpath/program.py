"""The Program: the bytes for one machine, and their listing for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import Struct

from camtool.arrays import Indices, Ints
from camtool.findings import Finding
from camtool.machine.model import Machine


@dataclass(frozen=True, eq=False)
class Program:
    """A program for one machine: its bytes `data`, the name of the machine's target, and the file
    `extension` (".pic").

    `row_of_block` (B,) gives for each block the row of the toolpath that it came from, −1 for
    blocks of the dialect's own (header, footer)."""

    data: bytes
    extension: str
    target: str
    row_of_block: Indices
    findings: tuple[Finding, ...] = ()

    @classmethod
    def of_text(
        cls,
        data: bytes,
        machine: Machine,
        row_of_block: Sequence[int] | Indices | Ints,
        findings: Iterable[Finding],
    ) -> Program:
        """Return a program of this text with the extension and the name of the machine's
        target."""
        return cls(
            data=data,
            extension=machine.target.extension,
            target=machine.target.name,
            row_of_block=np.asarray(row_of_block, dtype=np.int32),
            findings=tuple(findings),
        )


class Listing(Struct, frozen=True):
    """A printable program: its lines `blocks` (B,), numbered as in `Toolpath.block`; `binary` if
    they are bytes in hexadecimal; `lines` (B,): the line of the file, from 1, on which each
    begins, () where they are no part of a text."""

    blocks: tuple[str, ...]
    binary: bool = False
    lines: tuple[int, ...] = ()
