"""The flags that say how a program is judged: limits, parts of the mechanics, comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import click

from camtool.cli.gather import Command, with_flags
from camtool.cli.options import MachineFlags
from camtool.cli.sections import option
from camtool.cli.types import duration, length

if TYPE_CHECKING:
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Judging, Way
    from camtool.simulation.motion import Effects
    from camtool.verify.gates import Gates

_LIMITS = "Limits (exit code 1 beyond them)"


@dataclass(frozen=True)
class GateFlags:
    """`--max-error` (mm), `--max-reversals`, `--max-time` (s)."""

    max_error: float | None
    max_reversals: int | None
    max_time: float | None

    @property
    def given(self) -> bool:
        """Whether there is any limit."""
        return (self.max_error, self.max_reversals, self.max_time) != (None, None, None)

    def gates(self) -> Gates | None:
        """The limits; None when there are none."""
        if not self.given:
            return None
        from camtool.verify.gates import Gates

        return Gates(self.max_error, self.max_reversals, self.max_time)


def gate_options(command: Command) -> Command:
    """Adds `gates: GateFlags`."""
    return with_flags(
        command,
        "gates",
        GateFlags,
        [
            option(
                _LIMITS,
                "--max-error",
                callback=length,
                metavar="LENGTH",
                help="Largest predicted error, such as 20um.",
            ),
            option(
                _LIMITS,
                "--max-reversals",
                type=click.IntRange(min=0),
                metavar="COUNT",
                help="Reversals of X and Y while cutting.",
            ),
            option(
                _LIMITS,
                "--max-time",
                callback=duration,
                metavar="TIME",
                help="Time of the whole program, such as 90min or 1h.",
            ),
        ],
    )


def ways_to_compare(spec: str, machine: MachineFlags, judging: Judging) -> list[Way]:
    """What `--compare SPEC` stands for; OptionError when it is nothing."""
    from camtool.pipeline.ways import ways_of

    def load(more: Sequence[str]) -> LoadedTarget:
        return replace(machine, settings=(*machine.settings, *more)).load()

    return ways_of(spec, load, judging)


def left_out(names: Sequence[str]) -> Effects:
    """The mechanics without these effects; OptionError for others."""
    from camtool.pipeline.ways import left_out as without

    return without(names)
