"""What `camtool.api` gives back: the house's own records, with what they were made from.

Each is its record and nothing else to whoever takes one; besides, it prints as a few lines
(`print(posted)`) and shows itself in a notebook (`_repr_svg_`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, TypeVar

from camtool.errors import PostError
from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.pipeline.judge import Posted as PostedRecord
from camtool.toolpath.moves import Kind
from camtool.toolpath.moves import Toolpath as ToolpathRecord
from camtool.verify.verify import Verification as VerificationRecord

if TYPE_CHECKING:
    from camtool.machine.registry import LoadedTarget
    from camtool.planning.job import Job
    from camtool.preview.options import Options
    from camtool.preview.scene import Scene

Made = TypeVar("Made")


def extended(kind: type[Made], record: Any, **more: Any) -> Made:
    """The record as one of its extended `kind`, with `more` fields."""
    values = {each.name: getattr(record, each.name) for each in fields(record)}
    return kind(**(values | more))


@dataclass(frozen=True, eq=False, repr=False)
class Picture:
    """A picture of `scene`, looking as `options` say; the same bytes for the same values."""

    scene: Scene
    options: Options

    @property
    def svg(self) -> str:
        """The picture as SVG text; OptionError for options that make no picture."""
        from camtool.preview.draw import draw

        return draw(self.scene, options=self.options)

    def render(self, name: str) -> bytes:
        """The bytes of a file of this name: .svg, .png, or .html, which is the viewer (it has no
        options). OutputError for any other."""
        from camtool.preview.render import render

        return render(self.scene, name, self.options)

    def save(self, file: str | Path) -> None:
        """Write the file, by its extension; raises as `render` does."""
        Path(file).write_bytes(self.render(str(file)))

    def __repr__(self) -> str:
        return f"<Picture of {self.scene.title}>" if self.scene.title else "<Picture>"

    def _repr_svg_(self) -> str:
        return self.svg


class _Shown:
    """A value that has a picture."""

    def _scene(self) -> Scene:
        raise NotImplementedError

    def _repr_svg_(self) -> str:
        from camtool.preview.draw import draw

        return draw(self._scene())


@dataclass(frozen=True, eq=False, repr=False)
class Drawing(_Shown, DrawingRecord):
    """A drawing: exact lines and arcs, mm, Y up (`camtool.geometry.drawing.Drawing`)."""

    def __repr__(self) -> str:
        return f"<Drawing {self.file}: {_size(self)}, {_counted(self)}>"

    def _scene(self) -> Scene:
        from camtool.pipeline import picture

        return picture(title=PurePath(self.file).name, drawing=self)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Toolpath(_Shown, ToolpathRecord):
    """Moves in the work frame, mm and mm/min (`camtool.toolpath.moves.Toolpath`); `drawing`,
    `job` and `target` are what it was planned from."""

    drawing: DrawingRecord | None = None
    job: Job | None = None
    target: LoadedTarget | None = None

    def __repr__(self) -> str:
        moves = int((self.kind <= int(Kind.ARC_CCW)).sum())
        name = f" of {self.made_from}" if self.made_from else ""
        return f"<Toolpath{name}: {moves} moves, {_noticed(len(self.findings))}>"

    def _scene(self) -> Scene:
        from camtool.pipeline import picture

        return picture(
            title=self.made_from,
            drawing=self.drawing,
            job=self.job,
            toolpath=self,
            machine=None if self.target is None else self.target.machine,
        )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Verification(_Shown, VerificationRecord):
    """The verdict on a program (`camtool.verify.verify.Verification`): `report` holds the
    figures, `findings` what is to be said. `decoded` is the toolpath that the controller makes of
    the program `data`; it was held against `drawing`, planned with `job`, where there is one."""

    data: bytes
    decoded: ToolpathRecord
    target: LoadedTarget
    drawing: DrawingRecord | None = None
    job: Job | None = None

    def __str__(self) -> str:
        return self.report.to_text()

    def __repr__(self) -> str:
        report = self.report
        error = report.error_um.total.max
        said = "no error known" if error is None else f"error {error:.2f} µm at most"
        noticed = _noticed(len(self.findings))
        return f"<Verification of {report.source} on {report.target}: {said}, {noticed}>"

    def _scene(self) -> Scene:
        from camtool.pipeline import listing_of, picture

        return picture(
            title=PurePath(self.report.source).name,
            drawing=self.drawing,
            job=self.job,
            toolpath=self.decoded,
            verification=self,
            machine=self.target.machine,
            listing=listing_of(self.data, self.target, self.decoded),
        )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Posted(_Shown, PostedRecord):
    """A drawing as a program (`camtool.pipeline.Posted`), with what it was made from."""

    drawing: DrawingRecord
    job: Job
    target: LoadedTarget

    @property
    def data(self) -> bytes:
        """The program's bytes; PostError when a finding is an error: it must not be run."""
        if self.program is None or self.failed:
            raise PostError(
                "the program has errors and must not be run",
                file=self.drawing.file,
                mend="see findings",
            )
        return self.program.data

    def __str__(self) -> str:
        return repr(self) if self.verification is None else self.verification.report.to_text()

    def __repr__(self) -> str:
        name, target = PurePath(self.drawing.file).name, self.target.machine.target.name
        made = "no program" if self.program is None else f"{len(self.program.data)} bytes"
        return f"<Posted {name} for {target}: {made}, {_noticed(len(self.findings))}>"

    def _scene(self) -> Scene:
        from camtool.pipeline import posted_scene

        return posted_scene(self, self.target, drawing=self.drawing, job=self.job)


def _noticed(count: int) -> str:
    return "no findings" if not count else f"{count} finding{'s' * (count > 1)}"


def _size(drawing: DrawingRecord) -> str:
    from camtool.geometry.measure import extents

    if not len(drawing.paths):
        return "no lines"
    (left, right), (low, high) = extents(drawing.paths).tolist()
    return f"{right - left:.3f} × {high - low:.3f} mm"


def _counted(drawing: DrawingRecord) -> str:
    closed = int(drawing.paths.closed.sum())
    return f"{closed} closed and {len(drawing.paths) - closed} open contours"
