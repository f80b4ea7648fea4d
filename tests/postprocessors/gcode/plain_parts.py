"""Toolpaths for the tests of flashcut and valcnc: one of every kind of row, and random ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from camtool.target.registry import LoadedTarget
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program


@dataclass(frozen=True)
class Kinds:
    """The capabilities of a dialect: its unit in mm, feeds, and whether it has events and a
    long arc."""

    unit_mm: float
    feeds: tuple[float, ...]
    events: bool
    quarters_only: bool


FLASHCUT = Kinds(0.001, (0.1, 3.0, 8.0, 14.1), events=True, quarters_only=False)
VALCNC = Kinds(0.0008, (14400.0,), events=False, quarters_only=True)
KINDS = {"flashcut": FLASHCUT, "valcnc": VALCNC}


def part(plunge: float, cut: float) -> Toolpath:
    """Every kind of row that both can take: a slot, circles, an odd arc, a helix, all events."""
    path = ToolpathBuilder().event(Kind.TOOL_CHANGE, 1).event(Kind.SPINDLE_CW, 1200)
    path.event(Kind.DWELL, 2).rapid(z=0.5).rapid(1.0, 0.75).line(z=-0.04, feed=plunge)
    path.line(2.0, 0.75, feed=cut).arc(2.0, 1.25, centre=(2.0, 1.0), ccw=True, feed=cut)
    path.line(1.0, 1.25, feed=cut).arc(1.0, 0.75, centre=(1.0, 1.0), ccw=True, feed=cut)
    path.rapid(z=0.5).event(Kind.SPINDLE_OFF).event(Kind.SPINDLE_CCW)
    path.rapid(-1.2, -0.3).line(z=-0.04, feed=plunge)
    path.arc(-1.2, -0.3, centre=(-1.5, -0.4), ccw=False, feed=cut)
    path.arc(-1.58662, -0.70414, centre=(-1.5, -0.4), ccw=False, feed=cut)
    path.line(-1.0, -0.5, -0.02, feed=cut).rapid(0.0, 0.0, 0.5).message("remove the part")
    path.event(Kind.SPINDLE_OFF)
    return path.event(Kind.END).finish()


@st.composite
def on_grid(draw: st.DrawFn, kinds: Kinds, most_rows: int = 10) -> Toolpath:
    """Rows that the dialect can say exactly: each must come back as it is."""
    number = st.integers(-9000, 9000)
    path = ToolpathBuilder()
    at = [0, 0, 0]
    for _ in range(draw(st.integers(1, most_rows))):
        feed = draw(st.sampled_from(kinds.feeds))
        choice = draw(st.sampled_from("rrzzllaaae" if kinds.events else "rrzzllaaa"))
        if choice == "e":
            kind = draw(st.sampled_from([Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF]))
            path.event(kind)
        elif choice == "a":
            _exact_arc(draw, path, at, kinds, feed)
        elif choice == "z":
            height = draw(number.filter(lambda one: one != at[2]))
            at[2] = height
            z = height * kinds.unit_mm
            path = path.line(z=z, feed=feed) if draw(st.booleans()) else path.rapid(z=z)
        else:
            to = draw(st.tuples(number, number).filter(lambda one: list(one) != at[:2]))
            at[:2] = to
            x, y = (one * kinds.unit_mm for one in to)
            path = path.rapid(x, y) if choice == "r" else path.line(x, y, feed=feed)
    return (path.event(Kind.END) if kinds.events else path).finish()


def _exact_arc(
    draw: st.DrawFn, path: ToolpathBuilder, at: list[int], kinds: Kinds, feed: float
) -> None:
    """An arc whose arms are one vector turned by right angles, so equally long."""
    a, b = draw(st.integers(5, 3000)), draw(st.integers(-3000, 3000))
    ccw = draw(st.booleans())
    quarters = 1 if kinds.quarters_only else draw(st.integers(1, 3))
    arm = complex(-a, -b)  # from the centre to the start
    turned = arm * (1j if ccw else -1j) ** quarters
    centre = complex(at[0] + a, at[1] + b)
    end = centre + turned
    at[:2] = round(end.real), round(end.imag)
    unit = kinds.unit_mm
    path.arc(
        at[0] * unit,
        at[1] * unit,
        centre=(round(centre.real) * unit, round(centre.imag) * unit),
        ccw=ccw,
        feed=feed,
    )


@st.composite
def anywhere(draw: st.DrawFn, kinds: Kinds, most_rows: int = 10) -> Toolpath:
    """Rows off any grid: helices, full and nearly full circles, specks and shallow arcs too."""
    number = st.floats(-9.0, 9.0)
    near = st.floats(-0.08, 0.08)  # of a height: slopes become many steps
    path = ToolpathBuilder().rapid(draw(number), draw(number), 0.0)
    for _ in range(draw(st.integers(1, most_rows))):
        feed = draw(st.sampled_from(kinds.feeds))
        choice = draw(st.sampled_from("rzlhaaaa"))
        if choice == "a":
            any_arc(draw, path, feed, draw(st.none() | near))
        elif choice == "h":
            path.line(draw(number), draw(number), draw(near), feed=feed)
        elif choice == "z":
            path.line(z=draw(near), feed=feed)
        elif choice == "r":
            path.rapid(draw(number), draw(number), draw(near))
        else:
            path.line(draw(number), draw(number), feed=feed)
    return path.event(Kind.END).finish()


def any_arc(
    draw: st.DrawFn, path: ToolpathBuilder, feed: float, to_z: float | None = None
) -> None:
    """An arc of 1 µm to 100 mm radius and any sweep."""
    x, y, _ = path.position
    radius = 10.0 ** draw(st.floats(-3.0, 2.0))
    angle, ccw = draw(st.floats(-math.pi, math.pi)), draw(st.booleans())
    speck = st.floats(1e-6, 1e-2)
    sweep = draw(
        st.one_of(
            st.floats(1e-3, 2.0 * math.pi),
            st.just(2.0 * math.pi),
            st.just(math.pi),
            speck,
            speck.map(lambda one: 2.0 * math.pi - one),
            speck.map(lambda one: math.pi - one),
        )
    )
    cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
    to = angle + (sweep if ccw else -sweep)
    full = sweep == 2.0 * math.pi
    end = (x, y) if full else (cx + radius * math.cos(to), cy + radius * math.sin(to))
    path.arc(*end, to_z, centre=(cx, cy), ccw=ccw, feed=feed)


def judge(target: LoadedTarget, wanted: Toolpath, unit_mm: float) -> Program:
    """Write and read back; every row must end where it was wanted to and every arc must be one,
    near the wanted circle and of the wanted sweep, by the numbers of the program alone."""
    program: Program = target.target.write(wanted, target.machine)
    if not program.data:
        assert not len(wanted) or np.abs(wanted.end).max() <= unit_mm
        return program
    decoded: Toolpath = target.target.read(program.data, target.machine)
    row_of = program.row_of_block[decoded.block]
    starts = decoded.starts
    swept = np.zeros(len(wanted))
    for row in range(len(decoded)):
        now = int(row_of[row])
        if decoded.is_arc[row]:
            _judge_arc(wanted, now, decoded, row, unit_mm)
            swept[now] += decoded.sweeps()[row]
        elif decoded.is_motion[row] and wanted.is_arc[now]:
            _near_circle(wanted, now, decoded.end[row], 2.5 * unit_mm)
            middle = (decoded.end[row] + starts[row]) / 2.0
            _near_circle(wanted, now, middle, 2.5 * unit_mm)
        last = row + 1 == len(decoded) or row_of[row + 1] != now
        if last and decoded.is_motion[row]:
            reach = np.abs(decoded.end[row] - wanted.end[now]).max()
            assert reach <= 0.51 * unit_mm, f"row {now} ends {reach} mm off"
    assert (np.diff(row_of[row_of >= 0]) >= 0).all()
    assert (np.abs(starts) < 1e4).all()
    return program


def _judge_arc(wanted: Toolpath, now: int, decoded: Toolpath, row: int, unit_mm: float) -> None:
    assert wanted.is_arc[now]
    assert wanted.kind[now] == decoded.kind[row]
    begin, end, centre = decoded.starts[row, :2], decoded.end[row, :2], decoded.centre[row]
    r1, r2 = math.dist(begin, centre), math.dist(end, centre)
    assert abs(r1 - r2) <= 1.001 * unit_mm
    sweep = decoded.sweeps()[row]
    angle = math.atan2(*(begin - centre)[::-1])
    for part in np.linspace(0.0, 1.0, 9):
        radius, turn = r1 + (r2 - r1) * part, angle + sweep * part
        point = centre + radius * np.array([math.cos(turn), math.sin(turn)])
        _near_circle(wanted, now, point, 6.0 * unit_mm)


def _near_circle(wanted: Toolpath, now: int, point: np.ndarray, most_mm: float) -> None:
    """The point lies within `most_mm` of the wanted arc, its ends included."""
    centre, begin, end = wanted.centre[now], wanted.starts[now, :2], wanted.end[now, :2]
    point = point[:2]
    off = abs(math.dist(point, centre) - math.dist(begin, centre))
    sign = -1.0 if wanted.kind[now] == Kind.ARC_CW else 1.0
    a, b = point - centre, begin - centre
    turn = math.atan2(b[0] * a[1] - b[1] * a[0], float(a @ b)) * sign % (2.0 * math.pi)
    if turn > abs(wanted.sweeps()[now]):
        off = min(math.dist(point, begin), math.dist(point, end))
    assert off <= most_mm, f"row {now}: {point} lies {off} mm from the wanted arc"
