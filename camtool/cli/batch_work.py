"""The work of `camtool batch` on one drawing: as `post` does, with its files as bytes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from camtool.batches.manifest import code_digest, content_digest, digest_of, packages_digest
from camtool.batches.run import DrawingTask, Outputs
from camtool.cli.files import seal
from camtool.cli.options import DrawingFlags, JobFlags
from camtool.cli.picture_options import PictureFlags
from camtool.errors import CamtoolError
from camtool.findings import Finding, Severity
from camtool.importers.read import file_bytes, read_bytes
from camtool.plain import one_line
from camtool.planning.job import job_of
from camtool.records import replace
from camtool.version import __version__

if TYPE_CHECKING:
    from camtool.inspection.tolerances import Asked
    from camtool.inspection.verdicts import Required
    from camtool.planning.job import Job
    from camtool.run import Run
    from camtool.target.registry import LoadedTarget
    from camtool.verification.report import Gates

REMARKS = 20
"""Largest number of findings of a drawing that its worker returns; there may be a hundred
thousand."""

SMALL_JOB = b"""<svg xmlns="http://www.w3.org/2000/svg" width="2mm" height="2mm" viewBox="0 0 2 2">
<circle cx="1" cy="1" r="0.2"/></svg>"""
"""A drawing of a single contour, with which a worker loads its modules."""

SVG = ".svg"
"""The extension of pictures that a drawing may have too."""


@dataclass(frozen=True)
class JobOrder:
    """The job of one drawing; `file`: the name of its file. `asked`: the dimensions of its file of
    tolerances, None for only those in the drawing; `inspects`: dimensions are inspected at all."""

    job: Job
    file: str | None
    asked: Asked | None = None
    inspects: bool = False


@dataclass(frozen=True)
class PostWork:
    """The work of a batch: post each drawing as `camtool post` does. `preview`: extension of the
    picture, None for none; `looks`: options of pictures; `require`: the verdict that inspected
    dimensions must have."""

    target: LoadedTarget
    drawing: DrawingFlags
    gates: Gates | None = None
    preview: str | None = None
    reports: bool = False
    check: bool = True
    looks: PictureFlags = field(default_factory=PictureFlags)
    require: Required | None = None

    @property
    def extensions(self) -> tuple[str, ...]:
        """Extensions of its outputs."""
        extensions = (self.target.machine.target.extension, self.preview, ".json" * self.reports)
        return tuple(each for each in extensions if each)

    def warm(self) -> None:
        """Load the modules that every drawing needs."""
        from camtool.pipeline import post_drawing

        drawing = read_bytes(SMALL_JOB, "small.svg")
        post_drawing(drawing, job_of(), self.target, check=self.check)

    def make(self, task: DrawingTask, data: bytes | None) -> Outputs:
        """Make program, picture and report of a drawing; none of them if it has an error."""
        data = file_bytes(task.path) if data is None else data
        try:
            outputs = self._outputs(task, data)
        except CamtoolError as error:
            outputs = Outputs(error=str(error))
        return replace(outputs, content=content_digest(data))

    def _outputs(self, task: DrawingTask, data: bytes) -> Outputs:
        """Return the outputs of a drawing of these bytes, without their digest."""
        from camtool.pipeline import post_drawing

        order: JobOrder = task.order
        # Reports and pictures are UTF-8, which names of files need not be.
        name = task.source.encode("utf-8", "backslashreplace").decode()
        drawing = self.drawing.read(name, self.target.machine, order.job, data)
        with JobFlags(order.file).name_job_file():
            run = post_drawing(
                drawing,
                order.job,
                self.target,
                check=self.check,
                gates=self.gates,
                trace_points=None if self.preview else 0,
            )
            run = self._inspected(run, order)
        outputs = _result_of(task, run, self._program(task, run))
        if outputs.error is not None:
            return outputs
        return replace(outputs, files=dict(self._files(task, run)), figures=_figures(run))

    def digest(self) -> str:
        """Return the digest of everything that outputs depend on except drawing and job."""
        import msgspec

        target = self.target
        options = (
            self.preview, self.reports, self.check, self.gates, self.looks, self.require,
        )  # fmt: skip
        return digest_of(
            __version__,
            packages_digest("camtool"),
            code_digest(Path(__file__).parents[1].rglob("*.py")),
            code_digest(each for each in target.folder.iterdir() if _is_code(each)),
            target.file.name,
            msgspec.json.encode(target.machine, order="deterministic"),
            repr(self.drawing),
            repr(options),
        )

    def _inspected(self, run: Run, order: JobOrder) -> Run:
        if not order.inspects or run.drawing is None:
            return run
        from camtool.inspection.tolerances import dimensions_of
        from camtool.inspection.verdicts import Tolerances, inspect

        return inspect(run, Tolerances(*dimensions_of(run.drawing, order.asked), self.require))

    def _program(self, task: DrawingTask, run: Run) -> str | None:
        """Return the name of the program's file in the output folder, None if it is not
        written."""
        if run.failed or run.program is None:
            return None
        return f"{task.stem}{run.program.extension}"

    def _files(self, task: DrawingTask, run: Run) -> Iterator[tuple[str, bytes]]:
        if run.program is not None:
            yield run.program.extension, run.program.data
        if self.preview is not None:
            paint = self.looks.painter(lambda: [run.scene()], quiet=True)
            picture = paint(f"picture{self.preview}")
            yield self.preview, seal(picture, task.stem) if self.preview == SVG else picture
        if self.reports and run.report is not None:
            yield ".json", run.report.to_json().encode()


def _is_code(path: Path) -> bool:
    return path.suffix in (".py", ".toml") and path.is_file()


def _result_of(task: DrawingTask, run: Run, program: str | None) -> Outputs:
    """Return the outputs of a posted drawing for the summary: its error if it must not be written,
    its figures, and its worst findings. `program`: name of the program's file."""
    from camtool.cli.check_formats import found_in

    def lines(severity: Severity) -> list[Finding]:
        return [each for each in run.findings if each.severity == severity]

    errors, warnings = lines(Severity.ERROR), lines(Severity.WARNING)
    worst = replace(run, findings=(*errors, *warnings)[:REMARKS])
    remarks = tuple(f"{task.source}: {one_line(str(finding))}" for finding in worst.findings)
    report = run.report
    verdicts = Counter(each.verdict for each in report.inspection) if report else {}
    outputs = Outputs(
        remarks=remarks,
        warnings=len(warnings),
        verdicts=dict(verdicts),
        findings=found_in(worst, program),
    )
    if not run.failed and run.program is not None:
        return outputs
    suffix = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    if not errors:
        return replace(outputs, error=f"{task.source}: no program")
    return replace(outputs, error=f"{remarks[0]}{suffix}", code=errors[0].code.name)


def _figures(run: Run) -> dict[str, float]:
    """Return the figures of a drawing that the summary lists."""
    program, report = run.program, run.report
    figures: dict[str, float] = {"bytes": len(program.data) if program else 0}
    if report is not None:
        figures["time_s"] = report.time_s
        if report.error_um.total.max is not None:
            figures["error_um"] = report.error_um.total.max
    return figures
