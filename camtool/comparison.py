"""A Comparison: one program, run as several variants: other interpolators, other backlash, or
without a part of the mechanics.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING

from camtool.errors import OptionError
from camtool.patterns import guess
from camtool.pipeline import Judging, verify_program
from camtool.run import Run, Shown
from camtool.units import UM_PER_MM

if TYPE_CHECKING:
    from camtool.arrays import Floats
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.pictures.overlay import Overlay
    from camtool.planning.job import Job
    from camtool.simulation.motion import Effects
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.moves import Toolpath
    from camtool.verification.contrast import ContrastRow
    from camtool.verification.verify import Verification

WINDOW_STEPS = 30.0
"""The picture shows this many steps of the coarser axis to each side of the worst place ..."""

WINDOW_ERRORS = 1.5
"""... or this many times the largest error, if that is more ..."""

WHOLE = 2.0
"""... or the whole path, unless it is this many times larger than that."""


ROOM = 0.25
"""Paths are taken from a window that is larger by this share to each side, because the page may
show more."""

EFFECTS = ("play", "compensation", "scale", "squareness", "repeatability")
"""The parts of the mechanics that can be left out."""

AXES_OF = {"backlash": "backlash_mm", "compensation": "compensation_mm", "step": "real_step_mm"}
"""Short names for a key of both X and Y."""

Load = Callable[[Sequence[str]], "LoadedTarget"]
"""The target, with more settings such as "axes.x.backlash_mm=0.2" over it."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to run a program: its name, the target with its settings, how it is judged."""

    name: str
    target: LoadedTarget
    judging: Judging


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """One program, run several ways: `ways` says which, `runs` what came of each, in the same
    order. Its picture shows the paths about the place of the largest error."""

    source: str
    ways: tuple[Way, ...]
    runs: tuple[Run, ...]

    @property
    def verdicts(self) -> Mapping[str, Verification]:
        """The verdict on each way, by its name."""
        judged = zip(self.ways, self.runs, strict=True)
        return {way.name: run.verification for way, run in judged if run.verification is not None}

    @property
    def rows(self) -> tuple[ContrastRow, ...]:
        """A line for each way: errors µm, time s, counts."""
        from camtool.verification.contrast import row_of

        return tuple(row_of(name, each.report) for name, each in self.verdicts.items())

    def scene(self) -> Overlay:
        """The paths laid over each other about the place of the largest error: slides, or
        commanded positions where only the interpolator differs."""
        import numpy as np

        from camtool.pictures.overlay import Overlay
        from camtool.simulation.motion import ALL, Options
        from camtool.verification.contrast import strokes_within, worst_place
        from camtool.verification.cuts import cut_moves

        commanded = all(way.judging.interpolator is not None for way in self.ways)
        first, decoded = self.ways[0].target, self.runs[0].decoded
        assert decoded is not None
        wanted = first.model.quantised(decoded, first.machine)
        place = worst_place(self.verdicts.values())
        window = self._window(wanted, place)
        room = ROOM * (window[:, 1] - window[:, 0]).max()
        around = window + np.array([-room, room])
        lines = []
        for way, run in zip(self.ways, self.runs, strict=True):
            moves = run.decoded
            assert moves is not None
            options = Options(way.judging.interpolator, way.judging.effects or ALL)
            cutting = cut_moves(moves, flat_cuts=True).is_cut
            chunks = way.target.simulate(moves, options)
            lines.append((way.name, strokes_within(chunks, cutting, around, commanded=commanded)))
        what = "commanded positions" if commanded else "paths of the slides"
        x, y = place
        note = f"{what}; the largest error of all is near ({x:.3f}, {y:.3f}) mm"
        return Overlay(PurePath(self.source).name, window, wanted, lines, (note,))

    def _window(self, wanted: Toolpath, place: tuple[float, float]) -> Floats:
        """[[xmin, xmax], [ymin, ymax]] mm: what the picture shows."""
        import numpy as np

        from camtool.toolpath.moves import toolpath_extents

        machines = [way.target.machine for way in self.ways]
        step = max(max(each.axes.x.coded_step_mm, each.axes.y.coded_step_mm) for each in machines)
        error_um = max(row.total_max_um or 0.0 for row in self.rows)
        half = max(WINDOW_STEPS * step, WINDOW_ERRORS * error_um / UM_PER_MM)
        whole = toolpath_extents(wanted)[:2]
        size = float((whole[:, 1] - whole[:, 0]).max())
        if size <= 2.0 * half * WHOLE:
            pad = max(0.05 * size, error_um / UM_PER_MM, step)
            return np.asarray(whole + np.array([-pad, pad]))
        x, y = place
        return np.array([[x - half, x + half], [y - half, y + half]])

    def __str__(self) -> str:
        from camtool.verification.contrast import table

        return table(self.rows)

    def __repr__(self) -> str:
        return f"<Comparison of {self.source}: {', '.join(way.name for way in self.ways)}>"


def compare_program(
    data: bytes,
    ways: Sequence[Way],
    *,
    source: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
) -> Comparison:
    """The program read and judged each way; raises as `verify_program` does."""
    runs = [
        verify_program(
            data, way.target, source=source, drawing=drawing, job=job, judging=way.judging
        )
        for way in ways
    ]
    return Comparison(source, tuple(ways), tuple(runs))


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
    names = target.interpolators
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
