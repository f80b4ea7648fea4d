"""The Run: one program, its source, its motion, and its verification.

`camtool.pipeline` makes Runs; commands, batches and `import camtool` pass them on. The drawings
and toolpaths that `import camtool` returns are here too: they show a picture in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, TypeVar

from camtool.errors import OptionError, PostError
from camtool.findings import Finding, Severity, worst
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents
from camtool.libraries.exports import (
    CHORD_MM,
    ezdxf_of,
    shapely_of,
    shapely_of_moves,
    shapely_of_trace,
    svgpathtools_of,
)
from camtool.plain import embedded_address, one_line
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.report import ChangedValue, ReportPage, Setup, finding_reports, page_html

if TYPE_CHECKING:
    from camtool.pictures.options import PictureOptions
    from camtool.pictures.overlay import Overlay
    from camtool.pictures.scene import Scene
    from camtool.planning.job import Job
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.program import Listing, Program
    from camtool.verification.report import Report
    from camtool.verification.verify import Verification
    from camtool.waveforms.plot import PlotKind


_CAPTION = "The predicted result"


class Shown(ABC):
    """A value with a picture, which a notebook shows."""

    @abstractmethod
    def scene(self) -> Scene | Overlay:
        """Return the content of the picture."""

    def _repr_svg_(self) -> str:
        from camtool.pictures.picture import Picture

        return Picture(self.scene()).svg


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Run(Shown):
    """A program of `target` with its source and its verification; None for what there is not.

    `source` names the drawing, or the file of the program where there is no drawing. `wanted` are
    the moves that `drawing` and `job` ask for, `program` holds the bytes, `decoded` the moves that
    the controller reads from them, `verification` the figures of the slides' path. `program` is
    None when planning found an error; `verification` is None then, and when none was asked for.
    `findings` are those of all stages. `before` is the run of the same job without its measures
    against reversals and backlash, if it takes any; `part` says which of several programs of a
    drawing it is."""

    source: str
    target: LoadedTarget
    drawing: Drawing | None = None
    job: Job | None = None
    wanted: Toolpath | None = None
    program: Program | None = None
    decoded: Toolpath | None = None
    verification: Verification | None = None
    findings: tuple[Finding, ...] = ()
    before: Run | None = None
    part: str = ""

    @property
    def title(self) -> str:
        """The name of the source, and which of its programs this is."""
        name = PurePath(self.source).name
        return f"{name}, {self.part}" if self.part else name

    @property
    def failed(self) -> bool:
        """True when a finding is an error: such a program must not be written."""
        return worst(self.findings) >= Severity.ERROR

    @property
    def data(self) -> bytes:
        """The program's bytes; PostError when a finding is an error: it must not be run."""
        if self.program is None or self.failed:
            raise PostError(
                "the program has errors and must not be run", file=self.source, mend="see findings"
            )
        return self.program.data

    @property
    def report(self) -> Report | None:
        """The figures of the verification: errors in µm, sizes in mm, times in s."""
        return None if self.verification is None else self.verification.report

    @property
    def listing(self) -> Callable[[], Listing | None] | None:
        """A function that returns the program block by block, or None where its dialect has no
        listing; None without a program."""
        program, decoded, target = self.program, self.decoded, self.target
        if program is None or decoded is None:
            return None

        def listing() -> Listing | None:
            text = target.target.listing(program.data, target.machine)
            last = int(decoded.block.max(initial=-1))
            return text if text is not None and last < len(text.blocks) else None

        return listing

    def scene(self, title: str | None = None) -> Scene:
        """Return the picture's content: the moves of the program (without one, the planned moves)
        over the drawing, with the slides' path if it was judged. The default title is the name of
        the source."""
        from camtool.pictures.scene import scene_of

        return scene_of(
            title=self.title if title is None else title,
            drawing=self.drawing,
            job=self.job,
            toolpath=self.wanted if self.decoded is None else self.decoded,
            verification=self.verification,
            machine=self.target.machine,
            listing=self.listing,
            tabs=() if self.wanted is None else self.wanted.tabs_mm,
            wanted_path=self.wanted,
            target=self.target,
        )

    def plot(
        self,
        kind: PlotKind,
        file: str | Path,
        from_s: float = 0.0,
        span_s: float | None = None,
        options: PictureOptions | None = None,
    ) -> bytes:
        """Return a picture over time as bytes, .svg or .png by the name of `file`: "speed",
        "position" or "error", from `from_s` on for `span_s` seconds (None: to the end).
        OptionError without a verification, and for a stretch outside the program."""
        from camtool.waveforms.plot import TimeSpan, plot_file

        if self.verification is None:
            raise OptionError(
                f"{self.source} is not simulated, so there is nothing to plot",
                mend="see findings, and verify it",
            )
        stretch = TimeSpan(from_s, span_s)
        return plot_file(kind, self.verification, str(file), self.title, stretch, options)

    def report_page(
        self,
        pictures: tuple[tuple[str, str], ...] = (),
        stock: str = "",
        flags: tuple[tuple[str, str], ...] = (),
    ) -> ReportPage:
        """Return the report page of the run. `pictures`: (caption, address) of each; `stock`:
        address of the picture of the stock; `flags`: the command-line flags that made the run."""
        import hashlib

        machine, program = self.target.machine, self.program
        setup = Setup(
            machine=f"{machine.target.name}: {machine.target.title}",
            machine_sha256=machine.digest,
            program_sha256=None if program is None else hashlib.sha256(program.data).hexdigest(),
            changed=tuple(ChangedValue(*change) for change in self.target.changed_values()),
            flags=flags,
        )
        title, findings = one_line(self.title), finding_reports(self.findings)
        return ReportPage(title, self.report, findings, setup, pictures, stock)

    def to_shapely(self, tolerance_mm: float = CHORD_MM) -> dict[str, Any]:
        """Return shapely lines with heights, mm in the work frame: "cuts" and "rapids" of the
        program (of the plan if there is no program), and as "predicted" what the slides cut,
        without heights, if it was verified."""
        toolpath = self.wanted if self.decoded is None else self.decoded
        lines = {} if toolpath is None else shapely_of_moves(toolpath, tolerance_mm)
        if self.verification is not None:
            trace = self.verification.trace
            lines["predicted"] = shapely_of_trace(trace.points, trace.cutting)
        return lines

    def _repr_html_(self) -> str:
        """Return the report page in a frame that runs no scripts, for notebooks."""
        import html

        picture = embedded_address(self._repr_svg_().encode())
        page = page_html(self.report_page(((_CAPTION, picture),)))
        return (
            f'<iframe sandbox title="{html.escape(self.title)}" srcdoc="{html.escape(page)}" '
            'style="width:100%;height:45em;border:0"></iframe>'
        )

    def __str__(self) -> str:
        return repr(self) if self.report is None else self.report.to_text()

    def __repr__(self) -> str:
        name, target = PurePath(self.source).name, self.target.machine.target.name
        written = "no program" if self.program is None else f"{len(self.program.data)} bytes"
        error = None if self.report is None else self.report.error_um.total.max
        errors = "" if error is None else f", error {error:.2f} µm at most"
        return f"<Run of {name} on {target}: {written}{errors}, {_count_findings(self.findings)}>"


class ShownDrawing(Shown, Drawing):
    """A drawing: exact lines and arcs, mm, Y up (`camtool.geometry.drawing.Drawing`)."""

    @classmethod
    def of(cls, drawing: Drawing) -> ShownDrawing:
        """Return the drawing as a ShownDrawing."""
        return _as_shown(cls, drawing)

    def scene(self) -> Scene:
        """Return the picture's content: the drawing, with its file name as title."""
        from camtool.pictures.scene import scene_of_drawing

        return scene_of_drawing(self, PurePath(self.file).name)

    def to_shapely(self, tolerance_mm: float = CHORD_MM) -> dict[str, Any]:
        """Return the drawing as {layer: geometry of shapely}: closed paths as polygons with
        their holes, open ones as lines, marks as points; mm, arcs as chords within the
        tolerance."""
        return shapely_of(self, tolerance_mm)

    def to_ezdxf(self) -> Any:
        """Return the drawing as a document of ezdxf in mm, with its layers and colours; arcs stay
        arcs."""
        return ezdxf_of(self)

    def to_svgpathtools(self) -> dict[str, list[Any]]:
        """Return the drawing as {layer: Paths of svgpathtools}, mm, Y down; arcs stay arcs,
        marks are left out."""
        return svgpathtools_of(self)

    def __repr__(self) -> str:
        closed = int(self.paths.closed.sum())
        contours = f"{closed} closed and {len(self.paths) - closed} open contours"
        return f"<Drawing {self.file}: {_size(self)}, {contours}>"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ShownToolpath(Shown, Toolpath):
    """Moves in the work frame, mm and mm/min (`camtool.toolpath.moves.Toolpath`); `drawing`,
    `job` and `target` are those from which it was planned."""

    drawing: Drawing | None = None
    job: Job | None = None
    target: LoadedTarget | None = None

    @classmethod
    def of(
        cls,
        toolpath: Toolpath,
        drawing: Drawing | None = None,
        job: Job | None = None,
        target: LoadedTarget | None = None,
    ) -> ShownToolpath:
        """Return the toolpath as a ShownToolpath, with the drawing, job and target from which it
        was planned."""
        return _as_shown(cls, toolpath, drawing=drawing, job=job, target=target)

    def scene(self) -> Scene:
        """Return the picture's content: the moves over the drawing."""
        from camtool.pictures.scene import scene_of

        return scene_of(
            title=self.made_from,
            drawing=self.drawing,
            job=self.job,
            toolpath=self,
            machine=None if self.target is None else self.target.machine,
            tabs=self.tabs_mm,
        )

    def to_shapely(self, tolerance_mm: float = CHORD_MM) -> dict[str, Any]:
        """Return the "cuts" and the "rapids" as lines of shapely with heights, mm in the work
        frame; arcs as chords within the tolerance."""
        return shapely_of_moves(self, tolerance_mm)

    def __repr__(self) -> str:
        moves = int((self.kind <= int(Kind.ARC_CCW)).sum())
        name = f" of {self.made_from}" if self.made_from else ""
        return f"<Toolpath{name}: {moves} moves, {_count_findings(self.findings)}>"


_Kind = TypeVar("_Kind", ShownDrawing, ShownToolpath)


def _as_shown(kind: type[_Kind], record: Drawing | Toolpath, **extra_fields: object) -> _Kind:
    """Return a copy of the record as its subclass `kind`, with `extra_fields` set."""
    values = {each.name: getattr(record, each.name) for each in fields(record)}
    return kind(**(values | extra_fields))


def _count_findings(findings: tuple[Finding, ...]) -> str:
    count = len(findings)
    return "no findings" if not count else f"{count} finding{'s' * (count > 1)}"


def _size(drawing: Drawing) -> str:
    if not len(drawing.paths):
        return "no lines"
    (left_x, right), (low, high) = extents(drawing.paths).tolist()
    return f"{right - left_x:.3f} × {high - low:.3f} mm"
