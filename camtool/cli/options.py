"""The flags that several commands share, and what they stand for.

Each is a decorator that gives the command one record: `machine_options` (which machine) and
`job_options` (what is cut, and how) here, `drawing_options` (how a drawing is read) in `drawing`.
A job file says the same as the job flags; flags override it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.drawing import Command, DrawingFlags
from camtool.cli.gather import decorate, gather
from camtool.cli.types import feed, length

if TYPE_CHECKING:
    from camtool.machine.registry import LoadedTarget
    from camtool.planning.job import job_of

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

        name = self.name()
        if name is None:
            raise click.UsageError("--target is missing; `camtool targets` lists the machines")
        file = Path(self.machine) if self.machine else None
        return load_target(name, machine_file=file, settings=self.settings)

    def name(self) -> str | None:
        """The target's name: as given, or as the machine file says; None when nobody does."""
        if self.target is not None or self.machine is None:
            return self.target
        from camtool.machine.loader import extended_by

        return extended_by(Path(self.machine))


@dataclass(frozen=True)
class JobFlags:
    """`--job` and the flags that say the same; None and () mean: not given."""

    file: str | None
    given: dict[str, Any]

    def job(self, drawing: DrawingFlags) -> Job:
        """The job of the file, with the given flags and layers over it."""
        from camtool.planning.job import job_of

        settings: dict[str, Any] = {}
        if self.file is not None:
            from camtool.cli.jobfile import read_job_file

            settings = read_job_file(Path(self.file))
        settings.update(
            {key: value for key, value in self.given.items() if value is not None and value != ()}
        )
        if drawing.layers:
            settings["layers"] = drawing.layers
        return job_of(**settings)


def machine_options(command: Command) -> Command:
    """Adds `machine: MachineFlags`."""
    wrapped = gather("machine", MachineFlags, ("target", "machine", "settings"))(command)
    return decorate(  # type: ignore[no-any-return]
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


def _make_job(job: str | None, **given: Any) -> JobFlags:
    return JobFlags(job, given)


def job_options(command: Command) -> Command:
    """Adds `job: JobFlags`."""
    names = ("job", *_JOB_FIELDS)
    wrapped = gather("job", _make_job, names)(command)
    return decorate(  # type: ignore[no-any-return]
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
    return decorate(  # type: ignore[no-any-return]
        command,
        [
            click.option("-q", "--quiet", is_flag=True, help="Only errors."),
            click.option("-v", "--verbose", is_flag=True, help="Remarks too."),
            click.option(
                "--debug", is_flag=True, expose_value=False, help="Traceback on an error."
            ),
        ],
    )
