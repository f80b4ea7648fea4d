"""Which ways to run a program are held against each other: interpolators, mechanics, values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, get_args

from camtool.errors import OptionError
from camtool.patterns import guess
from camtool.pipeline.compare import Way

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline.judge import Judging
    from camtool.simulation.motion import Effects

EFFECTS = ("play", "compensation", "scale", "squareness", "repeatability")
"""The parts of the mechanics that can be left out."""

AXES_OF = {"backlash": "backlash_mm", "compensation": "compensation_mm", "step": "real_step_mm"}
"""Short names for a key of both X and Y."""

Load = Callable[[Sequence[str]], "LoadedTarget"]
"""The target, with more settings such as "axes.x.backlash_mm=0.2" over it."""


def ways_of(what: str, load: Load, judging: Judging) -> list[Way]:
    """What `what` stands for: `interpolators`, `mechanics`, or KEY=VALUE,VALUE,...

    OptionError for anything else, and MachineError for values that the machine cannot have.
    """
    if what == "interpolators":
        return _interpolators(load(()), judging)
    if what == "mechanics":
        return _mechanics(load(()), judging)
    key, equals, values = what.partition("=")
    if not equals or not values.strip():
        raise OptionError(
            f"{what!r} is nothing to compare",
            where="--compare",
            mend="write interpolators, mechanics, backlash=0,0.1,0.2 or KEY=VALUE,VALUE,...",
        )
    return [
        Way(f"{key}={value.strip()}", load(_settings(key.strip(), value.strip())), judging)
        for value in values.split(",")
    ]


def altered(target: LoadedTarget, settings: Sequence[str]) -> LoadedTarget:
    """The target with settings over its machine; MachineError names the wrong one."""
    from msgspec import to_builtins

    from camtool.machine.loader import build_machine

    if not settings:
        return target
    machine = build_machine(to_builtins(target.machine), str(target.file), None, settings)
    target.post.check(machine)
    return replace(target, machine=machine)


def left_out(names: Sequence[str]) -> Effects:
    """The mechanics without these effects; OptionError for others."""
    from camtool.simulation.motion import ALL

    unknown = [name for name in names if name not in EFFECTS]
    if unknown:
        raise OptionError(
            f"{unknown[0]!r} is no part of the mechanics",
            where="--without",
            mend=f"{guess(unknown[0], EFFECTS)}one of {', '.join(EFFECTS)}",
        )
    return replace(ALL, **dict.fromkeys(names, False))


def _interpolators(target: LoadedTarget, judging: Judging) -> list[Way]:
    from camtool.machine.controllers import Interpolator

    names = get_args(Interpolator)
    return [Way(name, target, replace(judging, interpolator=name)) for name in names]


def _mechanics(target: LoadedTarget, judging: Judging) -> list[Way]:
    """With all of it, without each part that acts, and without any."""
    from camtool.simulation.motion import IDEAL

    return [
        Way("as it is", target, judging),
        *(
            Way(f"without {name}", target, replace(judging, effects=left_out((name,))))
            for name in EFFECTS
            if _matters(name, target.machine)
        ),
        Way("ideal", target, replace(judging, effects=IDEAL)),
    ]


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
    """The setting of a key of the machine, or of a short name of both X and Y."""
    if key in AXES_OF:
        return tuple(f"axes.{axis}.{AXES_OF[key]}={value}" for axis in "xy")
    return (f"{key}={value}",)
