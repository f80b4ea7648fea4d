"""Turning, threads and parting in the half section: X along the axis, Y the radius.

The nose of the insert is a circle, and its centre is what moves. The section is grown by its
radius with exact arcs; that is the finishing pass. Levels of roughing run towards the chuck (to
-X) up to the section grown by the allowance too.

    Y │            ╭──────── bar
      │     ┌──────┘ section        ◀── levels, from the bar down
      └─────┴───────────────▸ X     part's end on the right"""

from __future__ import annotations

import math

import numpy as np

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.distance import nearest
from camtool.geometry.measure import sample
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments, reverse
from camtool.planning.findings import NOSE_LEAVES, OVERHANG_NOT_JUDGED, THREAD_FORM
from camtool.planning.items import RAPID, Chosen, CutRun, Fixed, Setting, Work
from camtool.planning.job import Operation, Stock
from camtool.planning.naming import at_place, key_of, operation_name
from camtool.planning.settings import levels

CLEAR_SHARE = 0.25
"""Rapids keep away from the bar by this part of its radius ..."""

MAX_CLEAR_MM = 1.0
"""... and no farther than this."""

MIN_ALONG_MM = 1e-7
"""A section that runs back by no more than this does so only by rounding."""

SHARP_DEPTH = 0.6134
"""Depth of an external ISO thread over its pitch (17/24 of the height of its triangle)."""

MAX_PASSES = 1000

SAMPLES = 4000
"""Number of points of the section at which the material left by the nose is measured."""


def _above_zero(operation: Operation, *names: str) -> None:
    for name in names:
        value = operation.own_value(name)
        if value is None or not (math.isfinite(value) and value > 0.0):
            raise OptionError(
                f"{operation.kind!r} needs {name} above 0"
                + ("" if value is None else f", not {value:g}"),
                where=key_of(operation, name),
                mend=f"write {name}",
            )


def checked(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation unchanged; OptionError for a bar without diameter, and for impossible
    flank angles."""
    _above_zero(operation, "bar", "lead_angle", "trail_angle")
    if not 0.0 <= operation.own_value("face") < math.inf:
        raise OptionError(
            f"the bar stands out by {operation.own_value('face'):g} mm",
            where=key_of(operation, "face"),
            mend="give 0 or more",
        )
    if operation.own_value("trail_angle") >= 0.5 * math.pi:
        raise OptionError(
            "a trailing flank of 90° and more cuts into what was turned before",
            where=key_of(operation, "trail_angle"),
            mend="give the angle between the flank and the axis, such as 32deg",
        )
    return operation


def checked_thread(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation unchanged; OptionError for a thread without its sizes, or deeper than
    its radius."""
    _above_zero(operation, "thread_pitch", "thread_major", "thread_length")
    depth, radius = thread_depth_mm(operation), 0.5 * operation.own_value("thread_major")
    if depth >= radius:
        raise OptionError(
            f"a thread {depth:.4g} mm deep cuts through its radius of {radius:.4g} mm",
            where=key_of(operation, "depth" if operation.depth_mm is not None else "thread_pitch"),
            mend="give a smaller pitch or depth",
        )
    if operation.tool.kind != "v" or operation.tool.tip_angle_rad is None:
        raise OptionError(
            "a thread needs a tool with two flanks",
            where=key_of(operation, "tool"),
            mend='use a tool with kind = "v" and a tip_angle of 60deg',
        )
    return operation


def checked_parting(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation unchanged; OptionError for a bar or a blade without width."""
    _above_zero(operation, "bar")
    if operation.own_value("part_at") is None or not operation.tool.diameter_mm:
        raise OptionError(
            "parting needs the place of the part's end and a blade of some width",
            where=key_of(operation, "part_at"),
            mend="write part_at, and the width of the blade as its tool's diameter",
        )
    return operation


def thread_depth_mm(operation: Operation) -> float:
    """Return the depth of a thread, mm: as given, or that of an external ISO thread of its
    pitch."""
    pitch: float = operation.own_value("thread_pitch")
    return SHARP_DEPTH * pitch if operation.depth_mm is None else operation.depth_mm


def turn(chosen: Chosen, setting: Setting) -> Work:
    """Return one item for each section: levels down to the allowance, then the finishing pass."""
    operation = setting.operation
    items, findings = [], list[Finding]()
    for path, name, source in zip(chosen.lines, chosen.names, chosen.source.tolist(), strict=True):
        section = _section(path, name, operation)
        runs, nose_findings = _runs(section, setting, name)
        items.append(Fixed(tuple(runs), setting, name, source))
        findings += nose_findings
        findings.append(_overhang(section, name))
    return Work(tuple(items), tuple(findings))


def _section(path: Polyline, name: str, operation: Operation) -> Floats:
    """Return the section (n, 3) of the part to be turned, from the part's end to the chuck;
    OptionError if it cannot be turned."""

    def refuse(message: str, place: Floats, mend: str) -> OptionError:
        where = f"{operation_name(operation)}, {at_place(name, place.tolist())}"
        return OptionError(message, where=where, mend=mend)

    if path.closed:
        raise refuse(
            "a half section is an open line from the part's end to the chuck",
            path.start,
            "draw the outline without the axis",
        )
    if path.start[0] < path.end[0]:
        path = reverse(path)
    points = sample(path, max(_length(path) / SAMPLES, 1e-6))
    below = points[:, 1] < -POSITION_EPS_MM
    if below.any():
        raise refuse(
            "the section crosses the axis, which is Y 0",
            points[int(below.argmax())],
            'draw one half above it, and place the drawing by its own zero (origin = "drawing")',
        )
    segments = Segments.of(path)
    swept = np.abs(segments.sweep)
    ways = np.diff(points, axis=0)
    back = ways[:, 0] > MIN_ALONG_MM + 1e-6 * np.hypot(*ways.T)
    if back.any() or (swept > math.pi).any():
        raise refuse(
            "the section has an undercut: it runs back towards the part's end",
            points[int(back.argmax())],
            "turn it from both ends, or leave the undercut out",
        )
    radius = 0.5 * operation.own_value("bar")
    if points[:, 1].max() > radius + POSITION_EPS_MM:
        raise refuse(
            f"the section has a radius of {points[:, 1].max():.4g} mm, and the bar one of"
            f" {radius:.4g} mm",
            points[int(points[:, 1].argmax())],
            "take a larger bar",
        )
    slopes = np.arctan2(ways[:, 1], -ways[:, 0])
    moves = np.hypot(*ways.T) > 1e-9
    for bad, angle, flank in (
        (moves & (slopes > operation.own_value("lead_angle") + 1e-3), slopes, "lead_angle"),
        (moves & (-slopes > operation.own_value("trail_angle") + 1e-3), -slopes, "trail_angle"),
    ):
        if bad.any():
            row = int(bad.argmax())
            raise refuse(
                f"the section {'rises' if flank == 'lead_angle' else 'falls'} by"
                f" {math.degrees(angle[row]):.3g}°, and the insert's {flank[:-6]}ing flank, at"
                f" {math.degrees(operation.own_value(flank)):.3g}°, would cut into it",
                points[row],
                f"use another insert ({flank}), or another section",
            )
    return path.vertices


def _length(path: Polyline) -> float:
    return float(np.hypot(*np.diff(path.vertices[:, :2], axis=0).T).sum())


def _beside(section: Floats, distance: float) -> Floats:
    """Return the path (n, 3) of the nose's centre at a distance outside a section, from its end
    (or the axis) to where the section ends at the chuck."""
    (x0, y0), (x1, y1) = section[0, :2].tolist(), section[-1, :2].tolist()
    far = 10.0 * (abs(x0 - x1) + float(section[:, 1].max()) + distance)
    around = [[x1 - far, y1, 0.0], [x1 - far, -far, 0.0], [x0, -far, 0.0]]
    region = Polylines.of([Polyline(np.concatenate([section, around]), closed=True)])
    ring = max(offset_shape(region, -distance), key=len) if distance else region[0]
    vertices = ring.vertices
    # From the rightmost line upwards, at the height of the section's end, to the left of its end.
    count = len(vertices)
    start = next(
        k
        for k in range(count)
        if vertices[k, 2] == 0.0
        and vertices[k, 1] < y0 <= vertices[(k + 1) % count, 1] + POSITION_EPS_MM
        and vertices[k, 0] > x0 - POSITION_EPS_MM
    )
    path = [[float(vertices[start, 0]), max(y0, 0.0), 0.0]]
    for step in range(1, count):
        x, y, bulge = vertices[(start + step) % count].tolist()
        if x < x1 - POSITION_EPS_MM:
            path[-1][2] = 0.0
            if path[-1][0] - x1 > POSITION_EPS_MM:
                path.append([x1, y, 0.0])
            break
        if math.dist(path[-1][:2], (x, y)) > POSITION_EPS_MM:
            path.append([x, y, bulge])
        else:
            path[-1][2] = bulge
    return np.array(path)


def _runs(section: Floats, setting: Setting, name: str) -> tuple[list[CutRun], list[Finding]]:
    """Return the run that cuts a section in levels and finishes it, and findings about what the
    nose leaves."""
    operation, feed = setting.operation, setting.feeds.cut_mm_min
    nose, bar = operation.tool.radius_mm, 0.5 * operation.own_value("bar")
    clear = min(CLEAR_SHARE * bar, MAX_CLEAR_MM)
    front = float(section[0, 0]) + operation.own_value("face")
    home = (max(front, section[0, 0]) + nose + clear, bar + nose + clear)
    places: list[list[float]] = [[*home, 0.0]]
    feeds: list[float] = []

    def go(x: float, y: float, feed: float, bulge: float = 0.0) -> None:
        if math.dist(places[-1][:2], (x, y)) > POSITION_EPS_MM:
            places[-1][2] = bulge
            places.append([x, y, 0.0])
            feeds.append(feed)

    lowest = float(section[:, 1].min())
    rough = _beside(section, nose + operation.allowance_mm)
    if bar > lowest:
        for level in levels(bar - lowest, operation.step_down_mm, None):
            height = bar + level + nose
            for right, end in _spans(rough, height, home[0]):
                enters_at_front = right == home[0]
                go(right, places[-1][1] if enters_at_front else home[1], RAPID)
                go(right, height, RAPID if enters_at_front else feed)
                go(end, height, feed)
                go(end + 0.5 * clear, height + 0.5 * clear, RAPID)
                if not enters_at_front:
                    go(end + 0.5 * clear, home[1], RAPID)
                go(home[0], places[-1][1], RAPID)
    finish = _beside(section, nose)
    go(home[0], float(finish[0, 1]), RAPID)
    go(float(finish[0, 0]), float(finish[0, 1]), feed)
    for (x, y, _), bulge in zip(finish[1:].tolist(), finish[:-1, 2].tolist(), strict=True):
        go(x, y, feed, bulge)
    # First away from the shoulder that the passes before have left there.
    go(places[-1][0] + 0.5 * clear, places[-1][1] + 0.5 * clear, RAPID)
    go(places[-1][0], home[1], RAPID)
    go(*home, RAPID)
    vertices = np.insert(np.array(places), 2, 0.0, axis=1)
    run = CutRun(vertices, np.array(feeds), setting.feeds.plunge_mm_min, name)
    return [run], _left_by_nose(section, finish, nose, name, operation)


def _spans(path: Floats, height: float, right: float) -> list[tuple[float, float]]:
    """Return the stretches (right, left) of a level at this height that are free of the part:
    those above the path, which runs to the left. `right`: X at which the level begins."""
    crossings: list[float] = []
    segments = Segments.of(Polyline(path))
    for k in range(len(segments)):
        (x0, y0), (x1, y1) = segments.start[k].tolist(), segments.end[k].tolist()
        if segments.bulge[k] == 0.0:
            if (y0 <= height) != (y1 <= height):
                crossings.append(x0 + (height - y0) / (y1 - y0) * (x1 - x0))
            continue
        (cx, cy), radius = segments.centre[k].tolist(), float(segments.radius[k])
        half = math.sqrt(max(radius**2 - (height - cy) ** 2, 0.0))
        begin, sweep = float(segments.start_angle[k]), float(segments.sweep[k])
        roots = []
        if abs(height - cy) < radius:
            for x in (cx + half, cx - half):
                turned = math.remainder(math.atan2(height - cy, x - cx) - begin, 2.0 * math.pi)
                if sweep * turned >= 0.0 and abs(turned) <= abs(sweep):
                    roots.append(x)
        odd = (y0 <= height) != (y1 <= height)
        if odd and len(roots) != 1:
            roots = [x0 if abs(y0 - height) < abs(y1 - height) else x1]
        crossings += sorted(roots, reverse=True) if odd or len(roots) == 2 else []
    spans: list[tuple[float, float]] = []
    free_from: float | None = right
    if path[0, 1] > height:
        return []
    for x in crossings:
        if free_from is None:
            free_from = x
        else:
            spans.append((free_from, x))
            free_from = None
    if free_from is not None:
        spans.append((free_from, float(path[-1, 0])))
    return [(a, b) for a, b in spans if a - b > POSITION_EPS_MM]


def _left_by_nose(
    section: Floats, finish: Floats, nose: float, name: str, operation: Operation
) -> list[Finding]:
    """Return a finding for the inner corner in which the round nose leaves most, [] if it leaves
    nothing."""
    if not nose:
        return []
    line = Polyline(section)
    points = sample(line, max(_length(line) / SAMPLES, 1e-6))
    points = points[points[:, 1] >= finish[0, 1]]
    off = nearest(points, Segments.of(Polyline(finish))).distance - nose
    worst = int(off.argmax())
    if off[worst] <= 1e-6:
        return []
    where = f"{operation_name(operation)}, {at_place(name, points[worst].tolist())}"
    return [NOSE_LEAVES(where=where, measured=float(off[worst]), nose=nose)]


def _overhang(section: Floats, name: str) -> Finding:
    """Return the finding about the overhang: the length that stands out of the chuck, and its
    ratio to the thinnest diameter."""
    length = float(section[0, 0] - section[-1, 0])
    radii = section[:, 1]
    thin = 2.0 * float(radii[radii > POSITION_EPS_MM].min(initial=math.inf))
    return OVERHANG_NOT_JUDGED(where=name, measured=length, share=length / thin)


def thread(_: Chosen, setting: Setting) -> Work:
    """Return one run: threading passes of equal chip area, and one spring pass along the last."""
    operation = setting.operation
    pitch, major = operation.own_value("thread_pitch"), operation.own_value("thread_major")
    speed = setting.spindle_rpm
    if not speed:
        raise OptionError(
            "a thread needs a spindle that turns",
            where=key_of(operation, "spindle"),
            mend="give its speed",
        )
    feed = setting.feeds.cut_mm_min
    if abs(feed - pitch * speed) > 1e-6 * feed:
        raise OptionError(
            f"a pitch of {pitch:g} mm at {speed:g} rev/min is a feed of {pitch * speed:.6g}"
            f" mm/min, and the job says {feed:g}",
            where=key_of(operation, "feed"),
            mend=f"give a feed of {pitch * speed:.6g}",
        )
    depth, first = thread_depth_mm(operation), operation.step_down_mm or 0.5 * pitch * SHARP_DEPTH
    count = max(math.ceil((depth / first) ** 2 - 1e-9), 1)
    if count > MAX_PASSES:
        raise OptionError(
            f"a first pass of {first:g} mm makes {count} passes",
            where=key_of(operation, "step_down"),
            mend="give a larger first pass",
        )
    radius, begin = 0.5 * major, operation.own_value("thread_begin")
    run_in = 3.0 * pitch
    start, end = begin + run_in, begin - operation.own_value("thread_length")
    clear = radius + max(pitch, depth)
    places, feeds = [[start, clear]], list[float]()
    for number in [*range(1, count + 1), count]:
        bottom = radius - depth * math.sqrt(number / count)
        # The tool retreats by the same distance from each pass, as in LinuxCNC's G76.
        outside = bottom + clear - radius + depth
        places += [[start, outside], [start, bottom], [end, bottom], [end, outside]]
        feeds += [RAPID, RAPID, feed, RAPID]
    places.append([end, clear])
    feeds.append(RAPID)
    vertices = np.concatenate([np.array(places), np.zeros((len(places), 2))], axis=1)
    run = CutRun(vertices, np.array(feeds), setting.feeds.plunge_mm_min, "thread")
    angle = operation.tool.tip_angle_rad or 0.0
    form = THREAD_FORM(
        where=operation_name(operation),
        measured=count + 1,
        pitch=pitch,
        major=major,
        minor=major - 2.0 * depth,
        flank=math.degrees(angle),
    )
    return Work((Fixed((run,), setting, "thread"),), (form,))


def part_off(_: Chosen, setting: Setting) -> Work:
    """Return one run that parts off: the blade to the axis beside the part's end, and out
    again."""
    operation = setting.operation
    bar, half = 0.5 * operation.own_value("bar"), operation.tool.radius_mm
    x, clear = operation.own_value("part_at") - half, min(CLEAR_SHARE * bar, MAX_CLEAR_MM)
    top = bar + half + clear
    vertices = np.array([[x, top, 0.0, 0.0], [x, 0.0, 0.0, 0.0], [x, top, 0.0, 0.0]])
    feeds = np.array([setting.feeds.cut_mm_min, RAPID])
    run = CutRun(vertices, feeds, setting.feeds.plunge_mm_min, "parting")
    return Work((Fixed((run,), setting, "parting"),))
