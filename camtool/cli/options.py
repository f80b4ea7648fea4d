"""The flags that several commands share, and what they stand for.

Three groups, each a decorator that gives the command one record: `machine_options` (which
machine), `drawing_options` (how a drawing is read) and `job_options` (what is cut, and how). A job
file says the same as the job flags; flags override it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from camtool.cli.types import feed, length

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.planning.job import Job

Command = TypeVar("Command", bound=Callable[..., Any])
SIDES = ("auto", "on", "outside", "inside")
ORIGINS = ("drawing", "lower-left", "centre")
INTERPOLATORS = ("dsm", "dda", "stairs")


@dataclass(frozen=True)
class MachineFlags:
    """`--target`, `--machine`, `--set`."""

    target: str | None
    machine: str | None
    settings: tuple[str, ...]

    def load(self) -> LoadedTarget:
        """The target with the user's file and settings over it."""
        from camtool.machine.registry import load_target

        if self.target is None:
            raise click.UsageError("--target is missing; `camtool targets` lists the machines")
        file = Path(self.machine) if self.machine else None
        return load_target(self.target, machine_file=file, settings=self.settings)


@dataclass(frozen=True)
class DrawingFlags:
    """`--units`, `--tolerance`, `--gap`, `--dpi`, `--format`."""

    units: str | None
    tolerance: float | None
    gap: float | None
    dpi: float
    format: str | None

    def read(self, name: str, machine: Machine | None = None) -> Drawing:
        """The drawing; tolerances that no flag gives are the machine's, or else the importer's."""
        from camtool.importers.options import ReadOptions
        from camtool.importers.read import read_drawing

        given: dict[str, Any] = {"units": self.units, "dpi": self.dpi, "format": self.format}
        if machine is not None:
            given["tolerance_mm"] = machine.defaults.fit_tolerance_mm
            given["gap_mm"] = machine.defaults.gap_mm
        if self.tolerance is not None:
            given["tolerance_mm"] = self.tolerance
        if self.gap is not None:
            given["gap_mm"] = self.gap
        return read_drawing(Path(name), options=ReadOptions(**given))


@dataclass(frozen=True)
class JobFlags:
    """`--job` and the flags that say the same; None and () mean: not given."""

    file: str | None
    given: dict[str, Any]

    def job(self) -> Job:
        """The job of the file, with the given flags over it."""
        from camtool.planning.job import Job

        settings: dict[str, Any] = {}
        if self.file is not None:
            from camtool.cli.jobfile import read_job_file

            settings = read_job_file(Path(self.file))
        settings.update(
            {key: value for key, value in self.given.items() if value is not None and value != ()}
        )
        return Job(**settings)


def _gather(record: str, make: Callable[..., Any], names: tuple[str, ...]) -> Callable[..., Any]:
    """A wrapper that takes `names` out of a command's arguments and gives it one record."""

    def wrap(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def called(**arguments: Any) -> Any:
            picked = {name: arguments.pop(name) for name in names}
            return command(**{record: make(**picked)}, **arguments)

        return called

    return wrap


def _decorate(command: Any, options: list[Callable[..., Any]]) -> Any:
    for option in reversed(options):
        command = option(command)
    return command


def machine_options(command: Command) -> Command:
    """Adds `machine: MachineFlags`."""
    wrapped = _gather("machine", MachineFlags, ("target", "machine", "settings"))(command)
    return _decorate(  # type: ignore[no-any-return]
        wrapped,
        [
            click.option(
                "--target", "-t", metavar="NAME", help="The machine; see camtool targets."
            ),
            click.option(
                "--machine", metavar="FILE", help="A TOML file that extends the target's machine."
            ),
            click.option(
                "--set",
                "settings",
                multiple=True,
                metavar="KEY=VALUE",
                help="Change one value of the machine, such as axes.x.backlash_mm=0.2.",
            ),
        ],
    )


def drawing_options(command: Command) -> Command:
    """Adds `drawing: DrawingFlags`."""
    names = ("units", "tolerance", "gap", "dpi", "format")
    wrapped = _gather("drawing", DrawingFlags, names)(command)
    return _decorate(  # type: ignore[no-any-return]
        wrapped,
        [
            click.option(
                "--units", metavar="UNIT", help="Unit of the drawing: mm, in, um, px ..."
            ),
            click.option(
                "--tolerance",
                callback=length,
                metavar="LENGTH",
                help="How near arcs come to fitted curves.",
            ),
            click.option(
                "--gap",
                callback=length,
                metavar="LENGTH",
                help="Ends nearer than this are joined.",
            ),
            click.option(
                "--dpi", type=float, default=96.0, show_default=True, help="Pixels of an SVG."
            ),
            click.option(
                "--format", type=click.Choice(["dxf", "svg", "points"]), help="Do not guess it."
            ),
        ],
    )


def _make_job(job: str | None, layer: tuple[str, ...], **given: Any) -> JobFlags:
    return JobFlags(job, {**given, "layers": layer})


def job_options(command: Command) -> Command:
    """Adds `job: JobFlags`."""
    names = ("job", "layer", *_JOB_FIELDS)
    wrapped = _gather("job", _make_job, names)(command)
    return _decorate(  # type: ignore[no-any-return]
        wrapped,
        [
            click.option(
                "--job", metavar="FILE", help="A TOML file that says what these flags say."
            ),
            click.option(
                "--tool-diameter",
                "tool_diameter_mm",
                callback=length,
                metavar="LENGTH",
                help="0 for a point (default).",
            ),
            click.option(
                "--side",
                type=click.Choice(SIDES),
                help="Where the tool runs; auto: outside of parts, inside of holes.",
            ),
            click.option(
                "--feed", "feed_mm_min", callback=feed, metavar="FEED", help="In mm/min."
            ),
            click.option(
                "--plunge-feed",
                "plunge_feed_mm_min",
                callback=feed,
                metavar="FEED",
                help="In mm/min.",
            ),
            click.option(
                "--depth",
                "depth_mm",
                callback=length,
                metavar="LENGTH",
                help="Depth of cut below Z0.",
            ),
            click.option(
                "--safe-z",
                "safe_z_mm",
                callback=length,
                metavar="LENGTH",
                help="Height of rapids above Z0.",
            ),
            click.option("--spindle", "spindle_rpm", type=float, help="In rev/min; none: off."),
            click.option(
                "--origin", type=click.Choice(ORIGINS), help="Part zero; drawing: as drawn."
            ),
            click.option(
                "--layer", multiple=True, metavar="PATTERN", help="Only these layers (CUT, ENG*)."
            ),
        ],
    )


_JOB_FIELDS = (
    "tool_diameter_mm",
    "side",
    "feed_mm_min",
    "plunge_feed_mm_min",
    "depth_mm",
    "safe_z_mm",
    "spindle_rpm",
    "origin",
)


def talk_options(command: Command) -> Command:
    """Adds `quiet: bool` and `verbose: bool`, and `--debug`, which main() looks for itself."""
    return _decorate(  # type: ignore[no-any-return]
        command,
        [
            click.option("-q", "--quiet", is_flag=True, help="Only errors."),
            click.option("-v", "--verbose", is_flag=True, help="Remarks too."),
            click.option(
                "--debug", is_flag=True, expose_value=False, help="Traceback on an error."
            ),
        ],
    )
