"""A toolpath that was bent beforehand, so that a machine's slides come out on another one."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.toolpath.moves import Ints, Toolpath


@dataclass(frozen=True, eq=False)
class Bent:
    """`toolpath` is what the controller is told; `row` (N,) of each of its rows the row of the
    wanted toolpath that it is there for."""

    toolpath: Toolpath
    row: Ints
