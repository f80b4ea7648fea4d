"""A Comparison: one program run as several variants, such as with other interpolators, with other
backlash, or without a part of the mechanics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from camtool.errors import OptionError
from camtool.patterns import guess
from camtool.pipeline import Judging, verify_program
from camtool.records import replace
from camtool.run import Run, Shown
from camtool.simulation.motion import ALL, IDEAL, Options
from camtool.toolpath.moves import toolpath_extents
from camtool.units import UM_PER_MM
from camtool.verification.contrast import contrast_row, contrast_table, paths_within, worst_place
from camtool.verification.cuts import cut_moves

if TYPE_CHECKING:
    from camtool.arrays import Floats
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.pictures.overlay import Overlay
    from camtool.planning.job import Job
    from camtool.progress import Progress
    from camtool.simulation.motion import Effects
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.moves import Toolpath
    from camtool.verification.contrast import ContrastRow
    from camtool.verification.verify import Verification

WINDOW_STEPS = 30.0
"""The picture shows this many steps of the coarser axis on each side of the largest error ..."""

WINDOW_ERRORS = 1.5
"""... or this many times that error, whichever is more ..."""

MAX_WHOLE_RATIO = 2.0
"""... or the whole path, unless it is this many times larger than that."""

MARGIN_SHARE = 0.25
"""Paths are drawn in a window wider by this share on each side: the page may show more."""

EFFECTS = ("play", "compensation", "scale", "squareness", "repeatability")
"""The parts of the mechanics that can be left out."""

AXES_OF = {"backlash": "backlash_mm", "compensation": "compensation_mm", "step": "real_step_mm"}
"""Short names of keys, each for the key of both X and Y."""

Load = Callable[[Sequence[str]], "LoadedTarget"]
"""The function that loads the target with more settings, such as "axes.x.backlash_mm=0.2"."""


@dataclass(frozen=True, eq=False)
class ProgramVariant:
    """A variant of a program's run: its name, the target with its settings, how it is judged."""

    name: str
    target: LoadedTarget
    judging: Judging


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """A program run as several variants: `ways` are the variants, `runs` their results, in the
    same order. The picture shows the paths around the largest error."""

    source: str
    ways: tuple[ProgramVariant, ...]
    runs: tuple[Run, ...]

    @property
    def verdicts(self) -> Mapping[str, Verification]:
        """The verification of each variant, by its name."""
        judged_runs = zip(self.ways, self.runs, strict=True)
        return {each.name: run.verification for each, run in judged_runs if run.verification}

    @property
    def rows(self) -> tuple[ContrastRow, ...]:
        """A row for each variant: errors µm, time s, counts."""
        return tuple(contrast_row(name, each.report) for name, each in self.verdicts.items())

    def scene(self) -> Overlay:
        """Return the picture's content: the paths of all variants around the largest error, those
        of the slides, or the commanded ones if only the interpolator differs."""
        import numpy as np

        from camtool.pictures.overlay import Overlay

        commanded = all(each.judging.interpolator is not None for each in self.ways)
        first, decoded = self.ways[0].target, self.runs[0].decoded
        assert decoded is not None
        wanted_path = first.model.quantised(decoded, first.machine)
        place = worst_place(self.verdicts.values())
        window = self._window(wanted_path, place)
        room = MARGIN_SHARE * (window[:, 1] - window[:, 0]).max()
        surroundings = window + np.array([-room, room])
        lines = []
        for variant, run in zip(self.ways, self.runs, strict=True):
            moves, options = run.decoded, variant.judging
            assert moves is not None
            cutting = cut_moves(moves, flat_cuts=True).is_cut
            chunks = variant.target.simulate(
                moves, Options(options.interpolator, options.effects or ALL)
            )
            paths = paths_within(chunks, cutting, surroundings, commanded=commanded)
            lines.append((variant.name, paths))
        subject = "commanded positions" if commanded else "paths of the slides"
        x, y = place
        note = f"{subject}; the largest error of all is near ({x:.3f}, {y:.3f}) mm"
        return Overlay(PurePath(self.source).name, window, wanted_path, lines, (note,))

    def _window(self, wanted_path: Toolpath, place: tuple[float, float]) -> Floats:
        """Return the rectangle that the picture shows: [[xmin, xmax], [ymin, ymax]], mm."""
        import numpy as np

        machines = [each.target.machine for each in self.ways]
        step = max(max(each.axes.x.coded_step_mm, each.axes.y.coded_step_mm) for each in machines)
        error_um = max(row.total_max_um or 0.0 for row in self.rows)
        half = max(WINDOW_STEPS * step, WINDOW_ERRORS * error_um / UM_PER_MM)
        extents = toolpath_extents(wanted_path)[:2]
        size = float((extents[:, 1] - extents[:, 0]).max())
        if size <= 2.0 * half * MAX_WHOLE_RATIO:
            pad = max(0.05 * size, error_um / UM_PER_MM, step)
            return np.asarray(extents + np.array([-pad, pad]))
        x, y = place
        return np.array([[x - half, x + half], [y - half, y + half]])

    def __str__(self) -> str:
        return contrast_table(self.rows)

    def __repr__(self) -> str:
        return f"<Comparison of {self.source}: {', '.join(each.name for each in self.ways)}>"


def compare_program(
    data: bytes,
    variants: Sequence[ProgramVariant],
    *,
    source: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Judge the program once for each variant and return the comparison; raises as
    `verify_program` does."""
    runs = [
        verify_program(
            data,
            each.target,
            source=source,
            drawing=drawing,
            job=job,
            judging=each.judging,
            progress=progress,
        )
        for each in variants
    ]
    return Comparison(source, tuple(variants), tuple(runs))


def variants_of(variants_text: str, load: Load, judging: Judging) -> list[ProgramVariant]:
    """Return the variants that `variants_text` names: `interpolators`, `mechanics`, or
    KEY=VALUE,VALUE,...

    OptionError for anything else, and MachineError for values that the machine cannot have."""
    if variants_text == "interpolators":
        return _interpolators(load(()), judging)
    if variants_text == "mechanics":
        return _mechanics(load(()), judging)
    key, equals, values = variants_text.partition("=")
    if not equals or not values.strip():
        raise OptionError(
            f"{variants_text!r} is nothing to compare",
            where="--compare",
            mend="write interpolators, mechanics, backlash=0,0.1,0.2 or KEY=VALUE,VALUE,...",
        )
    return [
        ProgramVariant(
            f"{key}={value.strip()}", load(_settings(key.strip(), value.strip())), judging
        )
        for value in values.split(",")
    ]


def effects_without(names: Sequence[str]) -> Effects:
    """Return all effects of the mechanics except these; OptionError for an unknown name."""
    unknown = [name for name in names if name not in EFFECTS]
    if unknown:
        raise OptionError(
            f"{unknown[0]!r} is no part of the mechanics",
            where="--without",
            mend=f"{guess(unknown[0], EFFECTS)}one of {', '.join(EFFECTS)}",
        )
    return replace(ALL, **dict.fromkeys(names, False))


def _interpolators(target: LoadedTarget, judging: Judging) -> list[ProgramVariant]:
    names = target.interpolators
    return [ProgramVariant(name, target, replace(judging, interpolator=name)) for name in names]


def _mechanics(target: LoadedTarget, judging: Judging) -> list[ProgramVariant]:
    """Return variants with all effects of the mechanics, without each effect that acts on this
    machine, and without any."""
    return [
        ProgramVariant("as it is", target, judging),
        *(
            ProgramVariant(
                f"without {name}", target, replace(judging, effects=effects_without((name,)))
            )
            for name in EFFECTS
            if _acts_on(name, target.machine)
        ),
        ProgramVariant("ideal", target, replace(judging, effects=IDEAL)),
    ]


def _acts_on(effect: str, machine: Machine) -> bool:
    """Return True if this part of the mechanics acts on the machine."""
    axes = list(machine.axes)
    return {
        "play": any(axis.backlash_mm for axis in axes) or any(machine.play_map.used),
        "compensation": any(axis.compensation_mm for axis in axes),
        "scale": any(axis.real_step_mm != axis.coded_step_mm for axis in axes),
        "squareness": machine.mechanics.squareness_rad != 0.0,
        "repeatability": any(axis.repeatability_mm for axis in axes),
    }[effect]


def _settings(key: str, value: str) -> tuple[str, ...]:
    """Return the settings `KEY=value` of a machine key; a short name such as "backlash" sets X and
    Y."""
    if key in AXES_OF:
        return tuple(f"axes.{axis}.{AXES_OF[key]}={value}" for axis in "xy")
    return (f"{key}={value}",)
