"""What `camtool.api` gives back: the house's own records, with what they were made from.

Each is its record and nothing else to whoever takes one; besides, it prints as a few lines
(`print(posted)`), and what has a picture shows it in a notebook (`_repr_svg_`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, TypeVar

from camtool.calibration.calibrate import Calibration as CalibrationRecord
from camtool.errors import PostError
from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.pictures.picture import Picture, Shown
from camtool.pipeline import Posted as PostedRecord
from camtool.toolpath.moves import Kind
from camtool.toolpath.moves import Toolpath as ToolpathRecord
from camtool.verification.contrast import ContrastRow, row_of, table
from camtool.verification.verify import Verification as VerificationRecord

if TYPE_CHECKING:
    from collections.abc import Mapping

    from camtool.calibration.measurements import Measurements
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.pictures.overlay import Overlay
    from camtool.pictures.scene import Scene
    from camtool.pipeline import Way
    from camtool.planning.job import Job
    from camtool.verification.contrast import Variant


__all__ = [
    "Calibration",
    "Comparison",
    "Converted",
    "Drawing",
    "Picture",
    "Posted",
    "Shown",
    "Toolpath",
    "Verification",
    "extended",
]


# Drawings, toolpaths, verdicts and programs, with what they were made from.

Made = TypeVar("Made")


def extended(kind: type[Made], record: Any, **more: Any) -> Made:
    """The record as one of its extended `kind`, with `more` fields."""
    values = {each.name: getattr(record, each.name) for each in fields(record)}
    return kind(**(values | more))


@dataclass(frozen=True, eq=False, repr=False)
class Drawing(Shown, DrawingRecord):
    """A drawing: exact lines and arcs, mm, Y up (`camtool.geometry.drawing.Drawing`)."""

    def __repr__(self) -> str:
        return f"<Drawing {self.file}: {_size(self)}, {_counted(self)}>"

    def _scene(self) -> Scene:
        from camtool.pipeline import picture

        return picture(title=PurePath(self.file).name, drawing=self)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Toolpath(Shown, ToolpathRecord):
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
class Verification(Shown, VerificationRecord):
    """The verdict on a program (`camtool.verification.verify.Verification`): `report` holds the
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
class Written(Shown, PostedRecord):
    """A program for `target`, written, read back and judged (`camtool.pipeline.Posted`)."""

    verification: Verification | None
    target: LoadedTarget

    @property
    def source(self) -> str:
        """What it was made of, as messages name it."""
        return self.wanted.made_from

    @property
    def data(self) -> bytes:
        """The program's bytes; PostError when a finding is an error: it must not be run."""
        if self.program is None or self.failed:
            raise PostError(
                "the program has errors and must not be run",
                file=self.source,
                mend="see findings",
            )
        return self.program.data

    def __str__(self) -> str:
        return repr(self) if self.verification is None else self.verification.report.to_text()

    def __repr__(self) -> str:
        name, target = PurePath(self.source).name, self.target.machine.target.name
        made = "no program" if self.program is None else f"{len(self.program.data)} bytes"
        noticed = _noticed(len(self.findings))
        return f"<{type(self).__name__} {name} for {target}: {made}, {noticed}>"

    def _scene(self) -> Scene:
        from camtool.pipeline import posted_scene

        return posted_scene(self, self.target, title=PurePath(self.source).name)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Posted(Written):
    """A drawing as a program, with what it was made from."""

    drawing: DrawingRecord
    job: Job

    @property
    def source(self) -> str:
        """The drawing's file."""
        return self.drawing.file

    def _scene(self) -> Scene:
        from camtool.pipeline import posted_scene

        return posted_scene(self, self.target, drawing=self.drawing, job=self.job)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Converted(Written):
    """A program of one machine as that of another; `file` names the first one's."""

    file: str

    @property
    def source(self) -> str:
        """The first program's file."""
        return self.file


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


# What was found out by comparing, and by measuring.


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """One program, run several ways: `ways` says which, `variants` what came of each, in the
    same order. Its picture shows the paths about the place of the largest error."""

    data: bytes
    source: str
    ways: tuple[Way, ...]
    variants: tuple[Variant, ...]

    @property
    def rows(self) -> tuple[ContrastRow, ...]:
        """A line for each way: errors µm, time s, counts."""
        return tuple(row_of(each.name, each.verification.report) for each in self.variants)

    @property
    def verdicts(self) -> Mapping[str, VerificationRecord]:
        """The verdict on each way, by its name."""
        return {each.name: each.verification for each in self.variants}

    def __str__(self) -> str:
        return table(self.rows)

    def __repr__(self) -> str:
        names = ", ".join(each.name for each in self.variants)
        return f"<Comparison of {self.source}: {names}>"

    def _scene(self) -> Overlay:
        from camtool.pipeline import compare_picture

        title = PurePath(self.source).name
        return compare_picture(self.data, self.ways, self.variants, title=title)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Calibration(CalibrationRecord):
    """The numbers of `machine` that `measurements` say
    (`camtool.calibration.calibrate.Calibration`): estimates with uncertainties, mm and rad.
    `extends` is the user's machine file, as a table, that `machine_file` carries on."""

    measurements: Measurements
    machine: Machine
    extends: Mapping[str, object]

    @property
    def machine_file(self) -> str:
        """TOML text that `load_target(..., machine=FILE)` reads: the numbers that were found over
        what was known, each with its uncertainty and its source behind it."""
        from camtool.calibration.machine_file import machine_file

        return machine_file(self, self.measurements, self.machine, dict(self.extends))

    def __str__(self) -> str:
        from camtool.calibration.calibrate import to_text

        return to_text(self, self.machine)

    def __repr__(self) -> str:
        found = ", ".join(each.name for each in self.estimates if not each.region)
        return f"<Calibration of {self.target} from {self.file}: {found or 'nothing'}>"
