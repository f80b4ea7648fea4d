"""Checks before anything is written: travel, stock, tools, feeds; what looks forgotten.

Everything that is cut lies below the stock top, z < 0. The stock, where the job knows one, ends at
its sides and at its thickness; beside it is air, so leads and overrun may go there. Rapids through
it are found in `camtool.stock.rapids`."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from camtool.arrays import Bools, Floats, distinct
from camtool.findings import Finding, Sentence, Severity
from camtool.geometry.measure import path_extents
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.machine.model import Machine, exceeds
from camtool.planning.findings import (
    CUT_DOUBTFUL,
    CUT_DOUBTFUL_BEYOND,
    CUT_DOUBTFUL_CENTRE,
    CUT_DOUBTFUL_CHIP,
    CUT_DOUBTFUL_DEPTH,
    CUT_DOUBTFUL_EDGE,
    CUT_DOUBTFUL_LENGTH,
    CUT_DOUBTFUL_LOOSE,
    CUT_DOUBTFUL_LOOSE_FINISH,
    CUT_DOUBTFUL_NOSE,
    CUT_DOUBTFUL_PLUNGE,
    CUT_DOUBTFUL_PRESET,
    CUT_DOUBTFUL_RIDGES,
    CUT_DOUBTFUL_SPEED,
    CUT_DOUBTFUL_WIDTH,
    FEED_ABOVE_LIMIT,
    FEED_ABOVE_LIMIT_ON_SLOPE,
    LONG_DRAWING,
    LONG_PROGRAM,
    OUT_OF_STOCK,
    OUT_OF_STOCK_AS_ALLOWED,
    OUT_OF_STOCK_BESIDE,
    OUT_OF_STOCK_CLAMP,
    OUT_OF_STOCK_LEAD,
    OUT_OF_STOCK_MORE,
    OUT_OF_STOCK_MORE_LEADS,
    OUT_OF_STOCK_PART,
    OUT_OF_STOCK_PARTLY,
    OUT_OF_STOCK_WHOLLY,
    OUT_OF_TRAVEL,
    TOOL_CHANGE_NOT_STATED,
    TOOL_NOT_SAID,
    TOOL_NOT_SAID_APART,
)
from camtool.planning.items import Fixed, Setting, Step
from camtool.planning.job import MAX_MOVES, MILLS, Job, Stock, Tool
from camtool.planning.naming import (
    at_place,
    operation_name,
    own_numbers,
    range_words,
    shortened_list,
)
from camtool.planning.place import MAX_SIZE_MM
from camtool.planning.settings import lowered_feeds
from camtool.planning.sides import runs_beside
from camtool.records import replace
from camtool.toolpath.moves import (
    STOCK_TOP_MM,
    Kind,
    Toolpath,
    changes_between_cuts,
    feeds_below_top,
    toolpath_extents,
)

LIMIT_SLACK = 1e-6
"""A chip load or surface speed may be beyond its limits by this part of them, by rounding."""

MAX_BEYOND_SHARE = 0.25
"""An allowance that takes a tool farther beyond a line than this part of its radius looks like a
mistake: corrections of wear and play are hundredths of millimetres."""

CORNER_GAP = math.sqrt(2.0)
"""Rings of a pocket are by this factor farther apart at a square corner than along its sides."""

MIN_STEP_OVER = 0.1
"""No finer step-over is proposed than this."""

OFF_STOCK_MM = 0.01
"""A drawing may lie beyond the edge of the stock by this much; stock is not measured more
exactly."""

EDGES = ("left", "right", "lower", "upper")
"""The edges of the stock, seen from above."""

AXES = "XYZ"
Box = tuple[float, float, float, float]
"""Left, lower, right and upper edge, mm."""


def checked(
    toolpath: Toolpath, job: Job, machine: Machine, steps: Sequence[Step] = ()
) -> tuple[Finding, ...]:
    """Return the findings about what no program may do and about probable mistakes; () if all is
    well.

    Errors: an axis beyond its travel, a cut deeper than the stock, a feed that the machine cannot
    make (on slopes: along Z), an operation whose tool the program cannot ask for; of the `steps`,
    what is drawn beside the stock, leads and clamps beside it. A warning: something is cut wholly
    beside the stock."""
    edge_findings = [
        *_clamps_off_stock(job),
        *(each for step in steps for each in _off_stock(step, job.stock)),
        *(each for step in steps for each in _leads_off_stock(step, job.stock)),
    ]
    if "off-stock" in job.allow:
        edge_findings = [
            replace(each, severity=min(each.severity, Severity.WARNING)) for each in edge_findings
        ]
    return (
        *out_of_travel(toolpath, machine),
        *lowered_feeds(job, machine),
        *_too_deep(toolpath, job),
        *(edge_findings or _beside_stock(toolpath, job)),
        *_tools_not_said(job),
        *_change_not_stated(toolpath, machine),
        *_feeds_above_limits(toolpath, machine),
        *_long(toolpath),
    )


def _long(toolpath: Toolpath) -> Iterator[Finding]:
    """Yield warnings for sizes and numbers of moves that are possible only because the job allows
    them (`allow`)."""
    reach = toolpath_extents(toolpath)[:2]
    size = float(max(np.ptp(reach, axis=1).max(), np.abs(reach).max())) if len(toolpath) else 0.0
    if size > MAX_SIZE_MM:
        yield LONG_DRAWING(measured=size, limit=MAX_SIZE_MM)
    if len(toolpath) > MAX_MOVES:
        yield LONG_PROGRAM(measured=len(toolpath), limit=MAX_MOVES)


def out_of_travel(toolpath: Toolpath, machine: Machine) -> Iterator[Finding]:
    """Yield a finding for each axis on which the toolpath (part zero included) spans more than the
    axis can travel."""
    for name, axis, (low, high) in zip(
        AXES, machine.axes, toolpath_extents(toolpath).tolist(), strict=True
    ):
        span = high - low
        if axis.travel_mm is None or span <= axis.travel_mm + POSITION_EPS_MM:
            continue
        yield OUT_OF_TRAVEL(
            where=f"axis {name}, from {low:.4f} to {high:.4f} mm",
            measured=span,
            limit=axis.travel_mm,
            axis=name,
            mend=_into_travel(toolpath, machine, name),
        )


def _into_travel(toolpath: Toolpath, machine: Machine, name: str) -> str:
    """Return text on how to bring a toolpath into the travel of an axis: the change that helps
    here, or a larger machine."""
    axis = AXES.index(name)
    needed = math.ceil(np.ptp(toolpath_extents(toolpath)[axis]))
    yours = own_numbers(machine, [f"axes.{name.lower()}.travel_mm={needed}"])
    if name == "Z":
        return f"lower safe_z or the depth; {yours}"
    room = [each.travel_mm or math.inf for each in machine.axes]
    feeds = toolpath.is_feed
    spans = np.ptp(toolpath_extents(toolpath, rows=feeds if feeds.any() else None), axis=1)
    if spans[axis] <= room[axis]:
        return f"use --origin lower-left; {yours}"
    if spans[0] <= room[1] and spans[1] <= room[0]:
        return f"use --rotate 90 --origin lower-left; {yours}"
    return f"scale the drawing, or cut it in parts; {yours}"


def _too_deep(toolpath: Toolpath, job: Job) -> Iterator[Finding]:
    """Yield a finding for cuts below the stock: a remark or warning within the depth that is
    allowed there, an error beyond it."""
    stock = job.stock
    cuts = feeds_below_top(toolpath)
    if stock is None or not cuts.any():
        return
    rows = np.flatnonzero(cuts)
    low = np.minimum(toolpath.starts[rows, 2], toolpath.end[rows, 2])
    deepest = int(rows[low.argmin()])
    depth = STOCK_TOP_MM - float(low.min())
    below_mm = depth - stock.thickness_mm
    if POSITION_EPS_MM < below_mm <= stock.through_mm + POSITION_EPS_MM:
        yield OUT_OF_STOCK_AS_ALLOWED(
            where=_place(toolpath, deepest),
            measured=depth,
            limit=stock.thickness_mm + stock.through_mm,
            through=below_mm,
            thickness=stock.thickness_mm,
            allowed=stock.through_mm,
        )
    elif below_mm > POSITION_EPS_MM:
        yield OUT_OF_STOCK(
            where=_place(toolpath, deepest),
            measured=depth,
            limit=stock.thickness_mm + stock.through_mm,
            thickness=stock.thickness_mm,
            allowed=stock.through_mm,
        )


def _beside_stock(toolpath: Toolpath, job: Job) -> Iterator[Finding]:
    """Yield a finding for each cut that lies wholly beside the stock."""
    stock, cuts = job.stock, feeds_below_top(toolpath)
    if stock is None or stock.box_mm is None or not cuts.any():
        return
    is_beside = _is_beside(toolpath, stock.box_mm, _radii(toolpath, job))
    stay = np.cumsum((toolpath.kind == Kind.RAPID) & (toolpath.end[:, 2] >= STOCK_TOP_MM))
    touching_stays = distinct(stay[cuts & ~is_beside])
    outside = cuts & ~np.isin(stay, touching_stays)
    if outside.any():
        row = int(outside.argmax())
        x, y = toolpath.end[row, :2].tolist()
        yield OUT_OF_STOCK_BESIDE(
            where=f"{_place(toolpath, row)} near ({x:.3f}, {y:.3f}) mm",
            measured=len(distinct(stay[outside])),
        )


def _off_stock(step: Step, stock: Stock | None) -> list[Finding]:
    """Return findings for drawn contours of an operation that lie partly or wholly beside the
    stock.

    An error: a part and an engraving that are not whole then, and what lies wholly beside it. A
    pocket that is open at the edge, a notch, and a line that runs out of the stock may be meant: a
    warning. The tool itself may run beside the stock."""
    is_repeat = step.operation.stage == "finish" or step.operation.rest_of is not None
    if stock is None or stock.box_mm is None or is_repeat or not step.runs:
        return []
    chosen, contract = step.chosen, step.operation.contract
    boxes, names = path_extents(chosen.lines), list(chosen.names)
    is_whole = chosen.lines.closed & (chosen.rim if contract.runs_beside else True)
    is_whole = np.asarray(is_whole & (not contract.clears))
    subjects = [contract.cut_name or ("part" if rim else "hole") for rim in chosen.rim.tolist()]
    if contract.takes in ("circles", "holes", "pins"):
        items = [item for item in step.items if isinstance(item, Fixed)]
        is_own = np.isin(chosen.source, [item.source for item in items])
        boxes, names = boxes[is_own], [names[row] for row in np.flatnonzero(is_own).tolist()]
        points = chosen.points[:0] if contract.takes == "circles" else chosen.points
        boxes = np.concatenate([boxes, np.repeat(points[:, :, None], 2, axis=2)])
        names += chosen.point_names[: len(points)]
        is_whole, subjects = np.zeros(len(boxes), dtype=np.bool_), ["hole"] * len(boxes)
    left_x, low, right, high = stock.box_mm
    overhangs = np.column_stack(
        [
            left_x - boxes[:, 0, 0],
            boxes[:, 0, 1] - right,
            low - boxes[:, 1, 0],
            boxes[:, 1, 1] - high,
        ]
    )
    size = np.ptp(boxes, axis=2)[:, [0, 0, 1, 1]]
    findings = defaultdict[Sentence, list[Finding]](list)
    for row in np.flatnonzero((overhangs > OFF_STOCK_MM).any(axis=1)).tolist():
        # For contours wholly off the stock, the side on which they lie farthest; for others, how
        # far they reach over the edge.
        gaps = overhangs[row] - size[row]
        is_off = bool((gaps >= np.where(size[row] > 0.0, -POSITION_EPS_MM, OFF_STOCK_MM)).any())
        edge = int((gaps if is_off else overhangs[row]).argmax())
        sentence = OUT_OF_STOCK_PART if is_whole[row] else OUT_OF_STOCK_PARTLY
        sentence = OUT_OF_STOCK_WHOLLY if is_off else sentence
        one = sentence(
            where=at_place(names[row], boxes[row].mean(axis=1)),
            measured=max(float(gaps[edge]), 0.0) if is_off else float(overhangs[row, edge]),
            limit=OFF_STOCK_MM,
            what=subjects[row],
            edge=EDGES[edge],
        )
        findings[sentence].append(one)
    return [
        each for group in findings.values() for each in shortened_list(group, OUT_OF_STOCK_MORE)
    ]


def _clamps_off_stock(job: Job) -> Iterator[Finding]:
    """Yield an error for each keep-out box that does not reach the stock, which a clamp must.
    Boxes without an end are not checked: they keep an area free."""
    stock = job.stock
    if stock is None or stock.box_mm is None:
        return
    left_x, low, right, high = stock.box_mm
    for box in job.keep_out:
        (x, wide), (y, height) = box.x_mm, box.y_mm
        gaps = (left_x - wide, x - right, low - height, y - high)
        if max(gaps) > OFF_STOCK_MM and math.isfinite(sum((x, wide, y, height))):
            yield OUT_OF_STOCK_CLAMP(
                where=f"[[keep_out]] {box.name!r}",
                measured=max(gaps),
                limit=OFF_STOCK_MM,
                edge=EDGES[gaps.index(max(gaps))],
            )


def _leads_off_stock(step: Step, stock: Stock | None) -> list[Finding]:
    """Return errors for leads that begin or end with the whole tool beside the stock, where clamps
    may be."""
    operation, runs = step.operation, step.runs
    if stock is None or stock.box_mm is None or not runs:
        return []
    left_x, low, right, high = stock.box_mm
    radius, first = operation.tool.radius_mm, runs.first
    findings = []
    for lead, name, rows in (
        (operation.lead_in, "lead-in", first[:-1]),
        (operation.lead_out, "lead-out", first[1:] - 1),
    ):
        if lead.kind == "none":
            continue
        x, y = runs.vertices[rows, :2].T
        overhangs = np.column_stack([left_x - x, x - right, low - y, y - high]) - radius
        for row in np.flatnonzero((overhangs > OFF_STOCK_MM).any(axis=1)).tolist():
            edge = int(overhangs[row].argmax())
            findings.append(
                OUT_OF_STOCK_LEAD(
                    where=f"{operation_name(operation)} at X {x[row]:.3f} Y {y[row]:.3f}",
                    measured=float(overhangs[row, edge]),
                    limit=OFF_STOCK_MM,
                    lead=name,
                    edge=EDGES[edge],
                )
            )
    return shortened_list(findings, OUT_OF_STOCK_MORE_LEADS)


def _is_beside(toolpath: Toolpath, box: Box, radius: Floats) -> Bools:
    """Return the mask (N,) of rows in which the tool, of `radius` (N,) mm, stays beside the
    stock's box. Bounding boxes are compared, for arcs those of their whole circles."""
    begin, end = toolpath.starts[:, :2], toolpath.end[:, :2]
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    arm = np.hypot(*(begin - toolpath.centre).T)[:, None]
    arc = toolpath.is_arc[:, None]
    low = np.where(arc, toolpath.centre - arm, low) - radius[:, None]
    high = np.where(arc, toolpath.centre + arm, high) + radius[:, None]
    is_outside = (high <= np.array(box[:2])) | (low >= np.array(box[2:]))
    return np.asarray(is_outside.any(axis=1))


def _tools_not_said(job: Job) -> Iterator[Finding]:
    """Yield a finding for each operation whose tool differs from the one before, if the program
    cannot ask for it because it has no number, or the same number."""
    for before, operation in pairwise(job.operations):
        one, other = before.tool, operation.tool
        if _shape(one) == _shape(other) or other.number not in (None, one.number):
            continue
        place = operation_name(operation)
        if other.number is None:
            yield TOOL_NOT_SAID(where=place)
        else:
            yield TOOL_NOT_SAID_APART(where=place, number=other.number)


def _change_not_stated(toolpath: Toolpath, machine: Machine) -> Iterator[Finding]:
    """Yield a finding for the first tool change on a machine whose file does not state where tools
    are changed."""
    changes = changes_between_cuts(toolpath)
    keys = [key for key in ("change_mm", "change_z_mm") if getattr(machine.defaults, key) is None]
    if not keys or not len(changes) or machine.spindle.turns == "work":
        return
    row = int(changes[0])
    x, y, z = toolpath.end[row].tolist()
    yield TOOL_CHANGE_NOT_STATED(
        where=f"{_place(toolpath, row)} at X {x:.3f} Y {y:.3f}",
        measured=z,
        count=len(changes),
        machine=machine.target.name,
        keys=" and ".join(keys),
    )


def _shape(tool: Tool) -> tuple[object, ...]:
    sizes = (tool.diameter_mm, tool.tip_angle_rad, tool.tip_diameter_mm, tool.corner_radius_mm)
    return tool.kind, *sizes


def _radii(toolpath: Toolpath, job: Job) -> Floats:
    """Return the radius (N,) mm of the tool of each row; the largest of all tools where the tool
    of a row is not known."""
    tools = [operation.tool for operation in job.operations]
    radii = np.full(len(toolpath), max(tool.radius_mm for tool in tools))
    numbered = {tool.number: tool for tool in tools if tool.number is not None}
    changes = np.flatnonzero(toolpath.kind == Kind.TOOL_CHANGE).tolist()
    for begin, end in pairwise([*changes, len(toolpath)]):
        tool = numbered.get(int(toolpath.value[begin]))
        if tool is not None:
            radii[begin:end] = tool.radius_mm
    return radii


def _feeds_above_limits(toolpath: Toolpath, machine: Machine) -> Iterator[Finding]:
    """Yield findings for the move that exceeds the highest rate of X and Y most, and for the move
    that exceeds that of Z most.

    Of a feed the part |dz| / length goes along Z, and the rest of the triangle across."""
    across, along = _lengths(toolpath)
    length = np.hypot(across, along)
    moves = toolpath.is_feed & (length > 0.0)
    feed = np.where(moves, toolpath.feed, 0.0) / np.where(moves, length, 1.0)
    for direction, part, limit in (
        ("in X and Y", across, machine.max_feed_mm_min),
        ("along Z", along, machine.max_plunge_mm_min),
    ):
        speed = feed * part
        if not exceeds(speed, limit).any():
            continue
        row = int(speed.argmax())
        yield (FEED_ABOVE_LIMIT_ON_SLOPE if across[row] else FEED_ABOVE_LIMIT)(
            where=_place(toolpath, row),
            measured=speed[row],
            limit=limit,
            direction=direction,
            machine=machine.target.name,
        )


def _lengths(toolpath: Toolpath) -> tuple[Floats, Floats]:
    """Return (N,), (N,) mm: the length of each row in XY (along its arc), and in Z."""
    step = toolpath.end - toolpath.starts if len(toolpath) else np.zeros((0, 3))
    spoke = toolpath.starts[:, :2] - toolpath.centre
    arc = np.hypot(spoke[:, 0], spoke[:, 1]) * np.abs(toolpath.sweeps())
    across = np.where(toolpath.is_arc, arc, np.hypot(step[:, 0], step[:, 1]))
    return across, np.abs(step[:, 2])


def _place(toolpath: Toolpath, row: int) -> str:
    """Return the name of a row and its source, such as `move 12 (CIRCLE 2F)`."""
    source = toolpath.text(row)
    return f"move {row} ({source})" if source else f"move {row}"


def doubtful_settings(
    steps: Sequence[Step], machine: Machine, stock: Stock | None, *, starts_spindle: bool
) -> list[Finding]:
    """Return one finding for all settings that look forgotten or too high in the operations that
    cut something; no finding when there are none.

    A point that follows closed contours and a plunge at the feed of the cut count only where
    programs of the target can start a spindle (`starts_spindle`) and the machine has one: others
    engrave with points. A missing speed counts where the program switches it. A round nose leaves
    nothing of a wall that is cut through the `stock` by as much."""
    starts_spindle = starts_spindle and machine.spindle.switched != "none"
    asks_speed = starts_spindle and machine.spindle.switched == "program"
    cutting = [step for step in steps if step.runs]
    doubts: dict[str, list[Step]] = defaultdict(list)
    for step in cutting:
        if asks_speed and step.setting.spindle_rpm is None and step.operation.spindle_rpm is None:
            doubts[CUT_DOUBTFUL_SPEED.words()].append(step)
        if step.operation.contract.turns_work:
            continue
        reasons = (
            *_doubtful(step, starts_spindle),
            *_beyond_tool(step, stock),
            *_loose(step, stock, steps),
        )
        for reason in reasons:
            doubts[reason].append(step)
    if not doubts:
        return []
    parts = []
    for reason, doubtful in doubts.items():
        names = ", ".join(operation_name(step.operation) for step in doubtful)
        parts.append(reason if len(doubtful) == len(cutting) else f"{names}: {reason}")
    return [CUT_DOUBTFUL(reasons="; ".join(parts))]


def _doubtful(step: Step, starts_spindle: bool) -> Iterator[str]:
    """Yield text on each doubtful setting of an operation, with the flag that changes it."""
    operation, feeds, tool = step.operation, step.setting.feeds, step.operation.tool
    wide = operation.away_mm > 0.0
    on_line = operation.contract.runs_beside and operation.side != "on" and not wide
    if starts_spindle and on_line and step.chosen.lines.closed.any():
        yield CUT_DOUBTFUL_WIDTH.words()
    if operation.beyond_mm > MAX_BEYOND_SHARE * tool.radius_mm:
        yield CUT_DOUBTFUL_BEYOND.words(beyond=operation.beyond_mm)
    deepest = deepest_pass(step.setting)
    finishes = operation.stage == "finish"  # it cuts beside the wall, in cleared stock
    mills = operation.contract.descent == "passes" and tool.kind in MILLS and tool.radius_mm > 0.0
    mills = mills and not finishes
    if mills and deepest > tool.diameter_mm + POSITION_EPS_MM:
        yield CUT_DOUBTFUL_DEPTH.words(depth=deepest, width=tool.diameter_mm)
    plunges = _plunges(step)
    fast = operation.plunge_feed_mm_min is None and feeds.plunge_mm_min >= feeds.cut_mm_min
    if starts_spindle and plunges and fast:
        yield CUT_DOUBTFUL_PLUNGE.words(feed=feeds.plunge_mm_min)


def _plunges(step: Step) -> bool:
    """Return True if a mill goes straight down into the stock; a bore does so where its hole is
    narrow."""
    operation = step.operation
    if operation.stage == "finish":
        return False
    if operation.contract.cuts == "over" and _comes_down_beside(step):
        return False
    if operation.contract.descent == "helix":
        return bool((step.runs.vertices[step.runs.first[:-1], 2] < -POSITION_EPS_MM).any())
    return operation.contract.descent == "passes" and operation.entry.kind == "plunge"


def _comes_down_beside(step: Step) -> bool:
    """Return True if the tool comes down beside the stock at the begin of every run."""
    stock = step.setting.stock
    if stock is None or stock.box_mm is None:
        return False
    left_x, low, right, high = stock.box_mm
    x, y = step.runs.vertices[step.runs.first[:-1], :2].T
    distances = np.max([left_x - x, x - right, low - y, y - high], axis=0)
    return bool((distances >= step.operation.tool.radius_mm - POSITION_EPS_MM).all())


def _loose(step: Step, stock: Stock | None, steps: Sequence[Step]) -> Iterator[str]:
    """Yield a doubt if an operation cuts parts free without tabs, so that they come loose under
    the tool, also before a finishing pass."""
    operation, closed = step.operation, step.chosen.lines.closed
    if stock is None or operation.stage == "finish" or operation.tabs is not None:
        return
    is_through = -step.setting.levels_mm[-1] >= stock.thickness_mm - POSITION_EPS_MM
    if is_through and runs_beside(operation) and (step.chosen.rim & closed).any():
        later = steps[steps.index(step) + 1 :]
        finished = operation.stage == "rough" and later and later[0].operation.stage == "finish"
        yield (CUT_DOUBTFUL_LOOSE_FINISH if finished else CUT_DOUBTFUL_LOOSE).words()


def _beyond_tool(step: Step, stock: Stock | None) -> Iterator[str]:
    """Yield text on each respect in which an operation demands more of its tool than the tool is
    made for, as far as its file says."""
    operation, tool, setting = step.operation, step.operation.tool, step.setting
    contract, pecks = operation.contract, operation.contract.descent == "pecks"
    depth = -setting.levels_mm[-1]
    length = tool.cutting_length_mm
    if length is not None and depth > length + POSITION_EPS_MM:
        yield CUT_DOUBTFUL_LENGTH.words(depth=depth, length=length)
    if (pecks or _plunges(step)) and tool.centre_cutting is False:
        yield CUT_DOUBTFUL_CENTRE.words()
    chip = tool.feed_per_tooth_mm(setting.feeds.cut_mm_min, setting.spindle_rpm)
    speed = tool.edge_speed_m_min(setting.spindle_rpm)
    if chip is not None and not pecks and _is_beyond(chip, tool.chip_load_mm):
        yield CUT_DOUBTFUL_CHIP.words(chip=chip, limits=range_words(tool.chip_load_mm))
    if speed is not None and _is_beyond(speed, tool.surface_speed_m_min):
        yield CUT_DOUBTFUL_EDGE.words(speed=speed, limits=range_words(tool.surface_speed_m_min))
    cuts_beside = contract.leaves_walls and (contract.clears or operation.side != "on")
    below = depth - stock.thickness_mm if stock is not None else 0.0
    if cuts_beside and max(below, 0.0) < tool.nose_mm - POSITION_EPS_MM:
        yield CUT_DOUBTFUL_NOSE.words(nose=tool.nose_mm)
    makes_floor = contract.clears or contract.cuts == "over"
    ridge = peak_mm(tool, operation.step_over) if makes_floor else 0.0
    if ridge > POSITION_EPS_MM and below <= 0.0:
        flat = 1.0 - 2.0 * tool.nose_mm / tool.diameter_mm
        finer = max(math.floor(100.0 * flat / CORNER_GAP) / 100.0, MIN_STEP_OVER)
        finer = min(finer, 0.5 * operation.step_over)
        yield CUT_DOUBTFUL_RIDGES.words(ridge=ridge, finer=finer, less=peak_mm(tool, finer))
    if tool.materials and not operation.material:
        yield CUT_DOUBTFUL_PRESET.words(materials=", ".join(tool.materials))


def peak_mm(tool: Tool, step_over: float) -> float:
    """Return the height, mm, of the highest peaks that a tool leaves on a floor: at square corners
    of rings, where the rings are farther apart."""
    return ridge_mm(tool, min(CORNER_GAP * step_over, 1.0))


def ridge_mm(tool: Tool, step_over: float) -> float:
    """Return the height of the ridges that a nose of radius r leaves on a floor, mm.

    Halfway between two paths the floor is x = ½ (step − flat) beside the flat of the tool; the
    nose is r − √(r² − x²) above its tip there."""
    flat = tool.diameter_mm - 2.0 * tool.nose_mm
    half_gap = max(0.5 * (step_over * tool.diameter_mm - flat), 0.0)
    return tool.nose_mm - math.sqrt(max(tool.nose_mm**2 - half_gap**2, 0.0))


def _is_beyond(value: float, limits: tuple[float, float] | None) -> bool:
    """Return True if a number is outside its limits by more than rounding."""
    if limits is None:
        return False
    min_value, max_value = limits
    return value < min_value * (1.0 - LIMIT_SLACK) or value > max_value * (1.0 + LIMIT_SLACK)


def deepest_pass(setting: Setting) -> float:
    """Return the depth of the deepest pass, mm."""
    return float(-np.diff([0.0, *setting.levels_mm]).min())
