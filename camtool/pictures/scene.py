"""The Scene: all that one picture shows, in the work frame, mm.

`scene_of` makes it of what is known of a part: its drawing, its toolpath, the verification of its
program. The viewer also asks for its `Playback`: seconds, errors, the program's lines, tables."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments
from camtool.records import replace
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath, toolpath_extents

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.planning.job import Job, Tool
    from camtool.stock.before import StockBefore
    from camtool.stock.engagement import Engagement
    from camtool.stock.moves import StockMoves
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.program import Listing
    from camtool.verification.report import InspectedReport, Report
    from camtool.verification.verify import Verification


LINES_SHOWN = 200

_WHERE = re.compile(r"X ?(-?\d+\.?\d*) Y ?(-?\d+\.?\d*)")
"""A place in the words of a finding, mm."""

NAME_WIDTH = 11
"""Width of the names at the left of the report's text, in characters."""


@dataclass(frozen=True, eq=False)
class Scene:
    """The content of a picture. Fields that are None or empty are left out.

    The drawing is in the work frame. trace_points (T, 2) mm is the predicted path of the slides,
    trace_error_mm (T,) its distance from the wanted path, trace_cutting (T,) whether the tool cuts
    between the point before and this one (None: always); errors count only there. travel_mm is the
    size of the table's travel from (0, 0), stock_mm the stock's left, lower, right and upper edge,
    swept_mm those of what tools and holders pass over; thickness_mm the stock's thickness; `pins`
    are places of alignment pins, mm, `flips` the ends of lines about which a part is turned over.
    `tools` are the tools with the first row of the turn of each, () where they are not known.
    `wanted` are the lines and arcs with which the trace was compared, `worst` the places of its
    largest errors, mm, the largest first; `tool_mm` is the diameter of the tool, if there is only
    one, and `nose` a tool that is as wide as it is deep, where that changes along the path;
    `faults` are the places of findings of the stock, mm;
    `turns` are the tools of several, each with the row of the
    toolpath from which on it cuts; `rounds` are full circles with their errors.
    `tabs` are the places of tabs, mm; `inspected` the dimensions with their verdicts. `playback`
    gives how the toolpath runs; only the viewer calls it. `cut` gives the moves that cut the
    stock, and those that should; only views of the stock and the viewer call it. `is_turned`: it
    is cut on a lathe, and seen in its half section.

    With a trace the picture leaves out rapids and plunges, and feeds are pale. ValueError when the
    trace is incomplete or not finite."""

    title: str = ""
    drawing: Drawing | None = None
    toolpath: Toolpath | None = None
    trace_points: Floats | None = None
    trace_error_mm: Floats | None = None
    trace_cutting: Bools | None = None
    travel_mm: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    wanted: Segments | None = None
    worst: tuple[tuple[float, float], ...] = ()
    faults: tuple[tuple[float, float], ...] = ()
    tool_mm: float | None = None
    nose: Tool | None = None
    turns: tuple[tuple[int, Tool], ...] = ()
    rounds: tuple[Round, ...] = ()
    playback: Callable[[], Playback] | None = None
    stock_mm: tuple[float, float, float, float] | None = None
    swept_mm: tuple[float, float, float, float] | None = None
    thickness_mm: float | None = None
    pins: tuple[tuple[float, float], ...] = ()
    flips: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = ()
    tools: tuple[tuple[int, Tool], ...] = ()
    tabs: tuple[tuple[float, float], ...] = ()
    inspected: tuple[InspectedReport, ...] = ()
    cut: Callable[[], StockPair] | None = None
    is_turned: bool = False

    @cached_property
    def engagement(self) -> Engagement | None:
        """The engagement of the tools along the moves that cut the stock, computed once; None
        without moves, and where the tools are not known."""
        if self.cut is None or self.toolpath is None:
            return None
        with suppress(OptionError):
            return self.cut().engagement(self.toolpath)
        return None

    def __post_init__(self) -> None:
        points, error = self.trace_points, self.trace_error_mm
        if points is None and error is None and self.trace_cutting is None:
            return
        if points is None or error is None:
            raise ValueError("a trace needs both its points and their errors")
        cutting = self.trace_cutting
        if cutting is None:
            cutting = np.ones(len(points), dtype=np.bool_)
            object.__setattr__(self, "trace_cutting", cutting)
        count = (len(points),)
        if points.shape != (*count, 2) or error.shape != count or cutting.shape != count:
            raise ValueError("the columns of the trace have different lengths")
        if not (np.isfinite(points).all() and np.isfinite(error[cutting]).all()):
            raise ValueError("a number of the trace is not finite")


class Round(Struct, frozen=True, eq=False):
    """A circle (x, y) mm of this radius mm and direction, with its bins (B, 9) as
    `camtool.kernels.judging` fills them; circular error G, radial errors F max, F min and
    their mean D, and the reversal values B of X and Y, mm, NaN where unknown. `partner` is the
    number, from 1, of the same circle in the other direction, `both_circular_mm` the
    bi-directional circular error G(b) of the two."""

    centre_mm: tuple[float, float]
    radius_mm: float
    ccw: bool
    bins: Floats
    circular_mm: float
    radial_mm: tuple[float, float, float]
    reversal_mm: tuple[float, float]
    partner: int | None = None
    both_circular_mm: float = math.nan

    def errors(self) -> Floats:
        """Return the least, mean and largest radial error (B, 3), mm, of each bin; NaN where the
        slides never were."""
        has_samples = self.bins[:, 0] > 0.0
        errors = np.full((len(self.bins), 3), np.nan)
        bins = self.bins[has_samples]
        mean = bins[:, 1:3] / bins[:, :1]
        # The mean of points along an arc of angle w lies at sin(w/2)/(w/2) of the radius.
        half = np.pi / len(self.bins)
        errors[has_samples, 0] = np.sqrt(bins[:, 3])
        errors[has_samples, 1] = np.hypot(mean[:, 0], mean[:, 1]) * (half / np.sin(half))
        errors[has_samples, 2] = np.sqrt(bins[:, 6])
        return errors - self.radius_mm


class StockPair(Struct, frozen=True, eq=False):
    """The moves that cut the stock, and those that should, None where these are not known; the
    left, lower, right and upper edge of the stock and its thickness, mm. `known`: the job gives
    this block; otherwise it is as large as the cuts need. `against`: a word for what should be.
    `bands` makes, of a distance from walls, mm, in which nothing is judged, the function that
    gives the least and the greatest height (N, 2) mm that drawing and job allow at points (N, 2);
    None without a drawing. `before`: what set-ups before have cut, None where nothing has."""

    moves: StockMoves
    wanted: StockMoves | None
    box_mm: tuple[float, float, float, float]
    thickness_mm: float
    known: bool
    against: str = "wanted"
    bands: Callable[[float], Callable[[Floats], Floats]] | None = None
    before: StockBefore | None = None

    def engagement(self, toolpath: Toolpath) -> Engagement:
        """Return the engagement of the tools along the moves, which are those of this toolpath."""
        from camtool.stock.engagement import engagement_of

        return engagement_of(self.moves, toolpath, self.box_mm if self.known else None)

    def engagement_by_row(self, toolpath: Toolpath, coarse_rad: float) -> Engagement:
        """Return the same, but only the greatest bound of each row of the toolpath is within an
        angle; all others are merely bounds."""
        from camtool.stock.engagement import engagement_of

        box_mm = self.box_mm if self.known else None
        rows = self.moves.row, np.full(len(toolpath), math.pi)
        return engagement_of(self.moves, toolpath, box_mm, rows, coarse_rad)


class TableLine(Struct, frozen=True):
    """A line of a table: its cells, and the row of the toolpath or the place (x, y) mm to which it
    refers."""

    cells: tuple[str, ...]
    move: int | None = None
    at_mm: tuple[float, float] | None = None


class ReportTable(Struct, frozen=True):
    """A table of the report; `columns` are its headings, which may be missing."""

    title: str
    columns: tuple[str, ...]
    lines: tuple[TableLine, ...]


class Playback(Struct, frozen=True, eq=False):
    """Times of a toolpath of N rows, for the viewer.

    `seconds` (N,); `error_mm` (N,), NaN where unknown; `trace_row` (T,) the row of each point of
    the scene's trace.

    `blocks` are the program's lines, one per block, None without a program; `binary`: they are
    bytes in hex. ValueError when the lengths of the columns differ, and for impossible seconds."""

    seconds: Floats
    error_mm: Floats
    trace_row: Ints
    blocks: tuple[str, ...] | None = None
    binary: bool = False
    tables: tuple[ReportTable, ...] = ()

    def __post_init__(self) -> None:
        if self.seconds.shape != self.error_mm.shape or self.seconds.ndim != 1:
            raise ValueError("the columns of the run have different lengths")
        if not (np.isfinite(self.seconds).all() and (self.seconds >= 0.0).all()):
            raise ValueError("a duration is not finite, or below 0")


def by_feed(toolpath: Toolpath, rapid_mm_min: float) -> Playback:
    """Return the times of a toolpath without a simulation.

    Each move runs at its feed, rapids at `rapid_mm_min` (inf: in no time), and dwells last their
    seconds."""
    seconds = np.zeros(len(toolpath))
    if len(toolpath):
        travel = toolpath.end - toolpath.starts
        flat = np.hypot(travel[:, 0], travel[:, 1])
        spoke = toolpath.starts[:, :2] - toolpath.centre
        along = np.abs(toolpath.sweeps()) * np.hypot(spoke[:, 0], spoke[:, 1])
        length = np.hypot(np.where(toolpath.is_arc, along, flat), travel[:, 2])
        feed = np.where(toolpath.kind == Kind.RAPID, rapid_mm_min, toolpath.feed)
        has_time = toolpath.is_motion & np.isfinite(feed) & (feed > 0.0)
        seconds[has_time] = length[has_time] / feed[has_time] * 60.0
        dwell = toolpath.kind == Kind.DWELL
        seconds[dwell] = np.nan_to_num(toolpath.value[dwell])
    return Playback(seconds, np.full(len(toolpath), np.nan), np.empty(0, dtype=np.int64))


def scene_of_drawing(drawing: Drawing, title: str = "") -> Scene:
    """Return the scene of a drawing alone, with a note of its size; the title is its file unless
    one is given."""
    note = f"{len(drawing.marks)} points" if drawing.marks else "nothing drawn"
    if len(drawing.paths):
        (left, right), (bottom, top) = extents(drawing.paths).tolist()
        note = f"{right - left:.4g} × {top - bottom:.4g} mm"
    return Scene(title=title or drawing.file, drawing=drawing, notes=(note,))


def scene_of(
    *,
    title: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
    toolpath: Toolpath | None = None,
    verification: Verification | None = None,
    machine: Machine | None = None,
    listing: Callable[[], Listing | None] | None = None,
    tabs: tuple[tuple[float, float], ...] = (),
    wanted_path: Toolpath | None = None,
    target: LoadedTarget | None = None,
) -> Scene:
    """Return the scene of what is known of a part: drawing, toolpath, verification; with a
    verification, the predicted path as well.

    `job` places the drawing in the work frame; `listing` gives the program's lines to the viewer;
    `tabs` are the places (x, y) mm of tabs. `wanted_path` are the moves that the program should
    make. With a verification and a `target` the simulated slides cut the stock."""
    if drawing is not None and toolpath is None:
        return scene_of_drawing(drawing, title)
    drawn = drawing
    if drawing is not None and job is not None:
        from camtool.planning.place import place

        drawing = place(drawing, job)
    from camtool.planning.naming import pins_of
    from camtool.verification.case import nose_of

    trace = verification.trace if verification is not None else None
    width = None if job is None else _width_mm(job, toolpath)
    nose = None if job is None or width is not None else nose_of(job)
    several = job is not None and toolpath is not None and width is None and nose is None
    worst = () if verification is None else verification.report.worst
    turns_work = machine is not None and machine.spindle.turns == "work"
    return Scene(
        title=title,
        is_turned=turns_work,
        drawing=_with_other_half(drawing) if drawing and turns_work else drawing,
        toolpath=toolpath,
        trace_points=trace.points if trace is not None else None,
        trace_error_mm=trace.error_mm if trace is not None else None,
        trace_cutting=trace.cutting if trace is not None else None,
        travel_mm=_travel(toolpath, machine),
        stock_mm=None if job is None or job.stock is None else job.stock.box_mm,
        thickness_mm=None if job is None or job.stock is None else job.stock.thickness_mm,
        pins=() if job is None else pins_of(job),
        flips=() if job is None else _flips(job),
        tools=_turns(job, toolpath) if job and toolpath else (),
        notes=verification.report.notes() if verification is not None else (),
        wanted=verification.wanted.segments if verification is not None else None,
        worst=tuple(one.at_mm for one in worst),
        faults=() if verification is None else _faults(verification.report),
        tool_mm=width,
        nose=nose,
        turns=_turns(job, toolpath) if several and job and toolpath else (),
        rounds=() if verification is None else rounds_of(verification),
        tabs=tabs,
        inspected=() if verification is None else verification.report.inspection,
        playback=_playback(
            toolpath, verification, machine, listing, _bounds(drawing, job, toolpath)
        ),
        cut=_stock_pair(
            toolpath,
            job,
            wanted_path,
            target if verification is not None else None,
            _bands(drawn, job, wanted_path, machine),
            _before(drawn, job, machine),
        ),
    )


def _with_other_half(section: Drawing) -> Drawing:
    """Return a half section with its mirror image on the other side of the axis, Y = 0."""
    paths = section.paths
    other = Polylines(paths.vertices * [1.0, -1.0, -1.0], paths.offsets, paths.closed)
    return replace(
        section,
        paths=Polylines.joined([paths, other]),
        layers=section.layers * 2,
        colours=section.colours * 2,
        sources=section.sources * 2,
        line_types=section.line_types * 2,
        off_mm=np.concatenate([section.off_mm, section.off_mm]),
    )


def _before(
    drawing: Drawing | None, job: Job | None, machine: Machine | None
) -> Callable[[], StockBefore] | None:
    """Return a function that computes what earlier set-ups of the part have cut; None if the job
    is not one of several set-ups."""
    if drawing is None or job is None or machine is None or job.setup_of is None:
        return None
    from camtool.stock.before import planned_before

    return partial(planned_before, drawing, job, machine)


FLIP_SHARE = 0.04
"""Lines about which a part is turned over reach this far beyond the stock, as a share of its
size."""


def _flips(job: Job) -> tuple[tuple[tuple[float, float], tuple[float, float]], ...]:
    """Return the ends of each line about which the part is turned over; they reach a little beyond
    the stock."""
    from camtool.planning.naming import flip_lines_of

    box = None if job.stock is None else job.stock.box_mm
    if box is None:
        return ()
    left, low, right, high = box
    out_x, out_y = FLIP_SHARE * (right - left), FLIP_SHARE * (high - low)
    return tuple(
        ((place, low - out_y), (place, high + out_y))
        if axis == "y"
        else ((left - out_x, place), (right + out_x, place))
        for axis, place in flip_lines_of(job)
    )


BESIDE_SHARE, BELOW_SHARE = 0.06, 0.25
"""A stock of unknown size reaches this far beyond the cuts (share of their longer side), and this
far below them (share of their depth)."""

MIN_BESIDE_MM = 0.01
"""A stock of unknown size reaches at least this far beyond the cuts."""


def _as_planned(path: Toolpath, job: Job | None) -> StockMoves:
    """Return the moves of a toolpath through the stock, exactly as planned."""
    from camtool.stock.moves import stock_moves_of_toolpath
    from camtool.stock.slides import tools_of_rows

    tools = tools_of_rows(path, job)
    return stock_moves_of_toolpath(path, tools.index, tools.cutters)


def _stock_pair(
    toolpath: Toolpath | None,
    job: Job | None,
    wanted_path: Toolpath | None,
    target: LoadedTarget | None,
    bands: Callable[[float], Callable[[Floats], Floats]] | None,
    before: Callable[[], StockBefore] | None,
) -> Callable[[], StockPair] | None:
    """Return a function that computes the moves that cut the stock, and those that should; None
    without a toolpath."""
    if toolpath is None:
        return None

    def pair() -> StockPair:
        from camtool.stock.moves import stock_moves_of_toolpath
        from camtool.stock.slides import slide_moves, tools_of_rows

        plan = None if wanted_path is None else wanted_path.operations
        tools = tools_of_rows(toolpath, job, plan)
        if target is not None:
            moves = slide_moves(toolpath, target, tools)
        else:
            moves = stock_moves_of_toolpath(toolpath, tools.index, tools.cutters)
        stock = None if job is None else job.stock
        box = None if stock is None else stock.box_mm
        pair = stock_pair(moves, box, None if stock is None else stock.thickness_mm)
        other = wanted_path is not None and wanted_path is not toolpath
        wanted_moves = _as_planned(wanted_path, job) if other and wanted_path is not None else None
        return replace(
            pair, wanted=wanted_moves, bands=bands, before=None if before is None else before()
        )

    return pair


def stock_pair(
    moves: StockMoves, box_mm: tuple[float, float, float, float] | None, thickness_mm: float | None
) -> StockPair:
    """Return the stock that these moves cut; where its box or thickness is None, it is as large as
    they need."""
    from camtool.stock.cut import cut_box

    box, depth = box_mm, thickness_mm or 0.0
    if thickness_mm is None and len(moves):
        depth = max(-(1.0 + BELOW_SHARE) * float(moves.end[:, 2].min()), 0.0)
    if box is None:
        left, bottom, right, top = cut_box(moves)
        margin = max(BESIDE_SHARE * max(right - left, top - bottom), MIN_BESIDE_MM)
        box = left - margin, bottom - margin, right + margin, top + margin
    return StockPair(moves, None, box, depth or 1.0, box_mm is not None)


def _bands(
    drawing: Drawing | None, job: Job | None, wanted_path: Toolpath | None, machine: Machine | None
) -> Callable[[float], Callable[[Floats], Floats]] | None:
    """Return a function that computes the heights which drawing and job allow (see `StockPair`);
    None if the wanted moves are not those of a plan."""
    if drawing is None or job is None or machine is None:
        return None
    if wanted_path is None or wanted_path.operations is None:
        return None

    def bands(wall_mm: float) -> Callable[[Floats], Floats]:
        from camtool.planning.plan import planned
        from camtool.stock.wanted import wanted_solid

        return wanted_solid(planned(drawing, job, machine).steps, wall_mm).bands

    return bands


def rounds_of(verification: Verification) -> tuple[Round, ...]:
    """Return the full circles for polar plots, each with the number of the same circle cut in the
    other direction."""
    from camtool.verification.circles import CirclePairs

    circles = verification.circles
    pairs = CirclePairs([one.circle for one in circles])
    both_mm: dict[int | None, float] = {}
    for index, one in enumerate(circles):
        for pair in pairs.add(index, one.bins):
            both_mm[index] = both_mm[pairs.partner(index)] = pair.circular_mm
    rounds = []
    for index, one in enumerate(circles):
        partner, figures = pairs.partner(index), one.figures
        rounds.append(
            Round(
                one.circle.centre_mm,
                one.circle.radius_mm,
                one.circle.ccw,
                one.bins,
                figures.circular_mm,
                (figures.radial_max_mm, figures.radial_min_mm, figures.radial_mean_mm),
                one.reversing.value,
                None if partner is None else partner + 1,
                both_mm.get(index, math.nan),
            )
        )
    return tuple(rounds)


def _width_mm(job: Job, toolpath: Toolpath | None) -> float | None:
    """Return the width of the cut at the surface, mm; None if it changes along the path.

    The width of a V bit, or a round nose, depends on its depth: it has one width if a single
    operation cuts level, that of its deepest pass."""
    from camtool.verification.case import nose_of, tool_mm

    tool = nose_of(job)
    if tool is None:
        return tool_mm(job)
    if toolpath is None or len(job.operations) > 1:
        return None
    across = np.hypot(*(toolpath.end - toolpath.starts)[:, :2].T) > POSITION_EPS_MM
    rows = np.flatnonzero(toolpath.is_feed & (across | toolpath.is_arc))
    z = toolpath.end[rows, 2]
    if not len(rows) or (toolpath.starts_of(rows)[:, 2] != z).any() or z.min() >= 0.0:
        return None
    return 2.0 * tool.radius_at(-float(z.min()))


def _turns(job: Job, toolpath: Toolpath) -> tuple[tuple[int, Tool], ...]:
    """Return the tools in the order in which they cut, each with the first row that it cuts.

    They are those of the operations of a plan, else those of the job with the numbers that the
    program calls; () if the program calls other numbers, or none although there are several tools.
    """
    from camtool.planning.link import tool_note

    first = job.operations[0].tool if job.operations else None
    if first and all(each.tool == first for each in job.operations):
        return ((0, first),)
    if toolpath.operations is None:
        numbers = {each.tool.number: each.tool for each in reversed(job.operations)}
        changes = np.flatnonzero(toolpath.kind == Kind.TOOL_CHANGE)
        tool_numbers = [int(number) for number in toolpath.value[changes].tolist()]
        if first is None or not tool_numbers or not {*tool_numbers} <= {*numbers}:
            return ()
        mounted = [first, *(numbers[number] for number in tool_numbers)]
        return tuple(zip([0, *changes.tolist()], mounted, strict=True))
    tools = {tool_note(each): each.tool for each in job.operations}
    notes = [note.tool for note in toolpath.operations.notes]
    if not all(note in tools for note in notes):
        return ()
    begins = toolpath.operations.begin.tolist()
    return tuple((row, tools[note]) for row, note in zip(begins, notes, strict=True))


def _travel(toolpath: Toolpath | None, machine: Machine | None) -> tuple[float, float] | None:
    """Return the table's travel, mm, if the path lies within it with part zero at its lower left
    corner; else None, since then the place of the travel is not known."""
    if toolpath is None or machine is None:
        return None
    x, y = machine.axes.x.travel_mm, machine.axes.y.travel_mm
    (left, right), (low, high), _ = toolpath_extents(toolpath).tolist()
    if x is None or y is None or left < 0.0 or low < 0.0 or right > x or high > y:
        return None
    return x, y


def _playback(
    toolpath: Toolpath | None,
    verification: Verification | None,
    machine: Machine | None,
    listing: Callable[[], Listing | None] | None,
    bounds: ReportTable,
) -> Callable[[], Playback] | None:
    """Return a function that computes the times of the toolpath: as simulated if there is a
    verification, else by its feeds."""
    if toolpath is None or machine is None:
        return None

    def playback() -> Playback:
        if verification is None:
            times = by_feed(toolpath, machine.rapid_mm_min)
        else:
            times = Playback(
                seconds=verification.rows.seconds,
                error_mm=verification.rows.total,
                trace_row=verification.trace.row,
                tables=tuple(_tables(verification.report)),
            )
        times = replace(times, tables=(*times.tables[:1], bounds, *times.tables[1:]))
        lines = None if listing is None else listing()
        return times if lines is None else replace(times, blocks=lines.blocks, binary=lines.binary)

    return playback


def _bounds(drawing: Drawing | None, job: Job | None, toolpath: Toolpath | None) -> ReportTable:
    """Return the table of the extents of drawing, stock and program along the axes."""
    from camtool.verification.report import mm

    boxes: list[tuple[str, list[list[float]]]] = []
    if drawing is not None and len(drawing.paths):
        boxes.append(("drawing", extents(drawing.paths).tolist()))
    stock = None if job is None else job.stock
    if stock is not None and stock.box_mm is not None:
        left, low, right, high = stock.box_mm
        boxes.append(("stock", [[left, right], [low, high], [-stock.thickness_mm, 0.0]]))
    if toolpath is not None and len(toolpath):
        boxes.append(("program", toolpath_extents(toolpath).tolist()))
    lines = [
        TableLine((name, *(f"{mm(low)} to {mm(high)}" for low, high in box)))
        for name, box in boxes
    ]
    return ReportTable("Bounds", ("mm", "X", "Y", "Z"), tuple(lines))


def _tables(report: Report) -> Iterator[ReportTable]:
    """Yield the tables of a report that have lines: figures, findings, worst moves, contours and
    dimensions."""
    lines = report.to_text(findings=False).splitlines()
    facts = [(line[:NAME_WIDTH].strip(), line[NAME_WIDTH:].strip()) for line in lines]
    yield ReportTable("Report", (), tuple(map(TableLine, facts)))
    for title, columns, rows in (
        _findings(report),
        _worst(report),
        _contours(report),
        _dimensions(report),
    ):
        if rows:
            yield ReportTable(title, columns, tuple(rows[:LINES_SHOWN]))


def _place_in(words: str) -> tuple[float, float] | None:
    """Return the place (x, y) mm that the text of a finding names, None if it names none."""
    match = _WHERE.search(words)
    return None if match is None else (float(match[1]), float(match[2]))


def _faults(report: Report) -> tuple[tuple[float, float], ...]:
    """Return the places of the findings about the stock, except remarks."""
    from camtool.stock.findings import StockCode

    codes = {each.name for each in StockCode}
    codes |= {ProgramCode.RAPID_IN_STOCK.name, ProgramCode.LOOSE_PIECE.name}
    faults = [item for item in report.findings if item.severity != "info"]
    places = [_place_in(item.where) for item in faults if item.code in codes]
    return tuple(dict.fromkeys(place for place in places if place is not None))


def _findings(report: Report) -> tuple[str, tuple[str, ...], list[TableLine]]:
    lines = []
    for item in report.findings:
        cells = item.severity, item.code, item.where, item.message
        lines.append(TableLine(cells, at_mm=_place_in(item.where)))
    return "Findings", ("severity", "code", "where", "message"), lines


def _worst(report: Report) -> tuple[str, tuple[str, ...], list[TableLine]]:
    """Return the title, headings and lines of the table of worst moves, which the report numbers
    from 1."""
    lines = [
        TableLine(
            (
                str(index),
                str(item.move if item.block is None else item.block),
                _um(item.total_um),
                _um(item.interpolation_um),
                _um(item.mechanics_um),
                _place(item.at_mm),
                item.source,
            ),
            item.move - 1,
        )
        for index, item in enumerate(report.worst, 1)
    ]
    names = ("", "block", "error µm", "interpolation µm", "mechanics µm", "near mm", "from")
    return "Worst moves", names, lines


def _contours(report: Report) -> tuple[str, tuple[str, ...], list[TableLine]]:
    lines = [
        TableLine(
            (item.name, _um(item.max_um), _um(item.rms_um), _um(item.mean_um), _place(item.at_mm)),
            at_mm=item.at_mm,
        )
        for item in sorted(report.contour_errors, key=lambda item: -item.max_um)
    ]
    return "Contours", ("contour", "max µm", "rms µm", "mean µm", "worst near mm"), lines


def _dimensions(report: Report) -> tuple[str, tuple[str, ...], list[TableLine]]:
    lines = []
    for item in report.inspection:
        (x, y), (u, v) = item.places_mm
        sizes = (
            f"{size:.4f}" for size in (item.nominal_mm, item.fit_mm, item.low_mm, item.high_mm)
        )
        cells = item.name, item.limits, *sizes, item.verdict
        lines.append(TableLine(cells, at_mm=(0.5 * (x + u), 0.5 * (y + v))))
    names = (
        "dimension",
        "limits",
        "nominal mm",
        "best fit mm",
        "least mm",
        "largest mm",
        "verdict",
    )
    return "Dimensions", names, lines


def _um(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _place(at_mm: tuple[float, float]) -> str:
    return f"({at_mm[0]:.3f}, {at_mm[1]:.3f})"
