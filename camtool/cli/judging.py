"""The flags that say how a program is judged: limits, parts of the mechanics, comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import click

from camtool.cli.gather import Command, with_flags
from camtool.cli.options import INTERPOLATORS, MachineFlags
from camtool.cli.sections import option
from camtool.cli.types import duration, length
from camtool.errors import OptionError
from camtool.patterns import guess

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.pipeline import Judging, Way
    from camtool.simulation.options import Effects
    from camtool.verify.gates import Gates

_LIMITS = "Limits (exit code 1 beyond them)"
EFFECTS = ("play", "compensation", "scale", "squareness", "repeatability")
AXES_OF = {"backlash": "backlash_mm", "compensation": "compensation_mm", "step": "real_step_mm"}
"""Short names in --compare for a key of both X and Y."""


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
    """What `--compare SPEC` stands for: `interpolators`, `mechanics`, or KEY=VALUE,VALUE,...

    OptionError for anything else.
    """
    from camtool.pipeline import Way

    target = machine.load()
    key, equals, values = spec.partition("=")
    if spec == "interpolators":
        return [
            Way(name, target, replace(judging, interpolator=name))  # type: ignore[arg-type]
            for name in INTERPOLATORS
        ]
    if spec == "mechanics":
        from camtool.simulation.options import IDEAL

        return [
            Way("as it is", target, judging),
            *(
                Way(f"without {name}", target, replace(judging, effects=left_out((name,))))
                for name in EFFECTS
                if _matters(name, target.machine)
            ),
            Way("ideal", target, replace(judging, effects=IDEAL)),
        ]
    if not equals or not values.strip():
        raise OptionError(
            f"{spec!r} is nothing to compare",
            where="--compare",
            mend="write interpolators, mechanics, backlash=0,0.1,0.2 or KEY=VALUE,VALUE,...",
        )
    ways = []
    for value in values.split(","):
        settings = (*machine.settings, *_settings(key.strip(), value.strip()))
        ways.append(
            Way(f"{key}={value.strip()}", replace(machine, settings=settings).load(), judging)
        )
    return ways


def left_out(names: Sequence[str]) -> Effects:
    """The mechanics without these effects; OptionError for others."""
    from camtool.simulation.options import ALL

    unknown = [name for name in names if name not in EFFECTS]
    if unknown:
        raise OptionError(
            f"{unknown[0]!r} is no part of the mechanics",
            where="--without",
            mend=f"{guess(unknown[0], EFFECTS)}one of {', '.join(EFFECTS)}",
        )
    return replace(ALL, **dict.fromkeys(names, False))


def _matters(effect: str, machine: Machine) -> bool:
    """Whether leaving out this part of the mechanics can change anything."""
    axes = list(machine.axes)
    return {
        "play": any(axis.backlash_mm for axis in axes) or any(machine.play_map.used),
        "compensation": any(axis.compensation_mm for axis in axes),
        "scale": any(axis.real_step_mm != axis.coded_step_mm for axis in axes),
        "squareness": machine.mechanics.squareness_rad != 0.0,
        "repeatability": any(axis.repeatability_mm for axis in axes),
    }[effect]


def _settings(key: str, value: str) -> tuple[str, ...]:
    """`--set` for a key of the machine, or for a short name of both X and Y."""
    if key in AXES_OF:
        return tuple(f"axes.{axis}.{AXES_OF[key]}={value}" for axis in "xy")
    return (f"{key}={value}",)
