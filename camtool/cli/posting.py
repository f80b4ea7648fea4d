"""The flags with which a drawing becomes a program, as one record: for `post` and its like."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.ahead import compiled_beside
from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.gather import Command, decorate, gather
from camtool.cli.jobflags import JobFlags, job_options
from camtool.cli.judging import GateFlags, gate_options
from camtool.cli.options import MachineFlags, machine_options
from camtool.errors import OptionError

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Posted
    from camtool.planning.job import Job
    from camtool.preview.scene import Scene

JOB_ENDING = ".toml"


@dataclass(frozen=True, eq=False)
class Made:
    """A drawing and what was made of it."""

    drawing: Drawing
    job: Job
    posted: Posted
    target: LoadedTarget

    def scenes(self, *, before: bool = False) -> list[Scene]:
        """The predicted result; `before` it that of the job without what it does against reversals
        and play. OptionError where it does nothing of that kind."""
        if not before or self.posted.failed:
            return [self._scene(self.posted)]
        if self.posted.before is None:
            raise OptionError(
                "the job does nothing against reversals or play",
                where="--before-after",
                mend="add --compensate, --minimise reversals or --approach, or drop it",
            )
        return [self._scene(self.posted.before, ", before"), self._scene(self.posted, ", after")]

    def _scene(self, posted: Posted, when: str = "") -> Scene:
        from camtool.pipeline import posted_scene

        title = f"{Path(self.drawing.file).name}{when}"
        return posted_scene(posted, self.target, title=title, drawing=self.drawing, job=self.job)


@dataclass(frozen=True)
class Posting:
    """How drawings are posted."""

    machine: MachineFlags
    gates: GateFlags
    job: JobFlags
    drawing: DrawingFlags
    no_verify: bool
    compensate: bool

    def load(self) -> LoadedTarget:
        """The target; a usage error when the flags contradict each other."""
        if self.no_verify and self.gates.given:
            raise click.UsageError("--no-verify leaves nothing to hold against limits")
        return self.machine.load()

    def make(
        self,
        source: str,
        target: LoadedTarget,
        *,
        quiet: bool,
        on_read: Callable[[], None] | None = None,
        preview: str | None = None,
    ) -> Made:
        """The drawing posted, for a picture of this name; `on_read` is called when it has been
        read."""
        from camtool.pipeline import points_for, post_drawing

        name, judging = target.machine.target.name, not self.no_verify
        with compiled_beside(name, quiet=quiet, judging=judging):
            wanted = self.job.job(self.drawing)
            read = self.drawing.read(source, target.machine, wanted)
            if on_read is not None:
                on_read()
            with self.job.blamed():
                posted = post_drawing(
                    read,
                    wanted,
                    target,
                    check=not self.no_verify,
                    compensate=self.compensate,
                    gates=self.gates.gates(),
                    trace_points=points_for(preview),
                )
        return Made(read, wanted, posted, target)

    def files(self, source: str) -> list[str]:
        """The files that a program is made of: drawing, job, its tool table, and machine."""
        return [source, *self.job.files(), *self.machine.files()]

    def of(self, source: str) -> Posting:
        """The same with the drawing's own job file, `part.toml` beside `part.dxf`, if it has one.

        Its own job takes the place of `--job`; flags are laid over either.
        """
        if not Path(source).name:  # the folder ., which is an error later
            return self
        own = Path(source).with_suffix(JOB_ENDING)
        if not own.is_file():
            return self
        return replace(self, job=replace(self.job, file=str(own)))


def posting_options(command: Command) -> Command:
    """Adds `posting: Posting`."""
    names = ("machine", "gates", "job", "drawing", "no_verify", "compensate")
    inner = drawing_options(gather("posting", Posting, names)(command))
    verify, bend = (
        click.option("--no-verify", is_flag=True, help="Write without simulating the machine."),
        click.option(
            "--compensate",
            is_flag=True,
            help="Bend the path against the machine's play, scale and squareness.",
        ),
    )
    return decorate(machine_options(gate_options(job_options(inner))), [verify, bend])
