"""`camtool preview`: picture of a drawing, a toolpath or a program."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.files import check_places, part_name, read_bytes, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, say_findings
from camtool.cli.options import (
    DrawingFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    job_options,
    machine_options,
    talk_options,
)
from camtool.cli.picture_options import (
    DRAWING,
    RESULT,
    Canvas,
    PictureFlags,
    check_beside,
    is_viewer,
    picture_name,
    picture_options,
)
from camtool.errors import CamtoolError
from camtool.findings import Finding
from camtool.pictures.options import points_for
from camtool.records import replace
from camtool.target.registry import each_target, list_target

if TYPE_CHECKING:
    from camtool.pictures.scene import Scene
    from camtool.target.registry import LoadedTarget

    Findings = tuple[Finding, ...]


@click.command(cls=SectionedCommand, short_help="Picture of a drawing, toolpath or program.")
@click.argument("source", metavar="FILE")
@click.option(
    "-o",
    "--output",
    metavar="PICTURE",
    callback=picture_name,
    required=True,
    help="A .svg or .png file; .html to pan, zoom and play.",
)
@machine_options
@click.option("--simulate", is_flag=True, help="Show the predicted path and its error too.")
@click.option(
    "--beside",
    "second_source",
    metavar="FILE",
    help="Another file of the same flags, beside the first: one scale, one map of errors.",
)
@picture_options
@job_options
@drawing_options
@talk_options
def preview(
    source: str,
    output: str,
    machine: MachineFlags,
    simulate: bool,
    second_source: str | None,
    picture: PictureFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Draw FILE: a drawing; with --target its toolpath; or a program of that target.

    With --target, a file with the target's own extension (such as .pic), or whose content is no
    drawing, is taken for its program. With --compensate, a toolpath is shown as it is written. Of
    a job with set-ups there is a picture of each, PICTURE-1-NAME, unless --setup names one."""
    if simulate and machine.name() is None:
        raise click.UsageError("--simulate needs --target")
    picture.check([output], _canvas(machine, simulate=simulate))
    sources = [source] if second_source is None else [source, second_source]
    if second_source is not None:
        check_beside("--beside", [output])
    check_places([*sources, *machine.files(), *job.files()], [output])
    asks_for_path = simulate or not machine.by_default or bool(machine.settings) or job.is_given
    # A viewer plays the program, which needs the times of the machine's model.
    simulate = simulate or (is_viewer(output) and machine.name() is not None)

    files: dict[str, bytes] = {}
    found_findings: dict[Finding, None] = {}
    for name, of_setup in _each_setup(sources, output, machine, job, drawing, asks_for_path):
        scene_source = SceneSource(machine, simulate, asks_for_path, of_setup, drawing, name)
        scenes = [scene_source.scene(each) for each in sources]
        shown = [scene for scene, _ in scenes]
        painted = picture.painter(partial(list, shown), quiet=quiet)
        files[name] = painted(name)
        found_findings |= dict.fromkeys(finding for _, findings in scenes for finding in findings)
    write_all(files)
    say_findings(tuple(found_findings), quiet=quiet, verbose=verbose)
    for name in files:
        say(f"written: {name}", quiet=quiet)
    return 0


def _each_setup(
    sources: list[str],
    output: str,
    machine: MachineFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    asks_for_path: bool,
) -> list[tuple[str, JobFlags]]:
    """Return (picture name, job flags) for each picture: one for each set-up of the job, unless
    `--setup` names one."""
    is_planned = asks_for_path and machine.name() is not None and job.setup is None
    if is_planned and not drawing.is_program(sources[0], machine.load()):
        names = [each.name for each in job.job(drawing).setups]
        return [
            (part_name(output, number, len(names), name), replace(job, setup=name))
            for number, name in enumerate(names, 1)
        ] or [(output, job)]
    return [(output, job)]


def _canvas(machine: MachineFlags, *, simulate: bool) -> Canvas:
    """Return what the picture can show: moves of a machine, or only a drawing; with or without the
    simulated path."""
    if machine.name() is None:
        return DRAWING
    return RESULT if simulate else Canvas("add --simulate")


@dataclass(frozen=True)
class SceneSource:
    """The function from file names to scenes, each with the findings of its drawing, or of the
    program if there is no drawing. `asks_for_path`: a drawing is shown with its toolpath because a
    flag is about it; with a default machine alone a drawing is shown without."""

    machine: MachineFlags
    simulate: bool
    asks_for_path: bool
    job: JobFlags
    drawing: DrawingFlags
    output: str

    def scene(self, source: str) -> tuple[Scene, Findings]:
        """Return the scene and the findings of a drawing, of a program, or of the toolpath planned
        from a drawing."""
        if self.machine.name() is None:
            return self._drawing_scene(source)
        target = self.machine.load()
        if self.drawing.is_program(source, target):
            return self._program_scene(source, target), ()
        return (
            self._job_scene(source, target) if self.asks_for_path else self._drawing_scene(source)
        )

    def _drawing_scene(self, source: str) -> tuple[Scene, Findings]:
        from camtool.pictures.scene import scene_of_drawing

        _refuse_program(source)
        read = self.drawing.read(source)
        return scene_of_drawing(read, Path(read.file).name), read.findings

    def _program_scene(self, source: str, target: LoadedTarget) -> Scene:
        from camtool.pipeline import Judging, read_program, verify_program

        progress().begin(f"reading {Path(source).name}")
        data = read_bytes(source)
        job = self.job.job(self.drawing) if self.job.is_given else None
        if not self.simulate:
            run = read_program(data, target, source=source)
        else:
            judging = Judging(trace_points=points_for([self.output]))
            run = verify_program(data, target, source=source, judging=judging, progress=progress())
        return replace(run, job=job).scene()

    def _job_scene(self, source: str, target: LoadedTarget) -> tuple[Scene, Findings]:
        from camtool.pipeline import post_drawing
        from camtool.planning.compensating import compensate
        from camtool.planning.plan import plan
        from camtool.run import Run

        title, job = Path(source).name, self.job.job(self.drawing)
        read = self.drawing.read(source, target.machine, job)
        with self.job.name_job_file():
            if self.simulate:
                run = post_drawing(
                    read, job, target, trace_points=points_for([self.output]), progress=progress()
                )
                return run.scene(title), run.findings if run.failed else read.findings
            progress().begin("planning")
            moves = plan(read, job, target.machine)
        run = Run(source=read.file, target=target, drawing=read, job=job, wanted=moves)
        if job.compensate:
            run = replace(run, decoded=compensate(moves, target.machine).toolpath)
        return run.scene(title), read.findings


def _refuse_program(source: str) -> None:
    """Raise CamtoolError if the file has the extension of a program and no target is given."""
    for name, listed in each_target(list_target):
        if Path(source).suffix.lower() == listed.target.extension:
            raise CamtoolError(
                "is a program", file=source, mend=f"name its machine, such as --target {name}"
            )
