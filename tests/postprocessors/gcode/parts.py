"""Toolpaths for the tests of G-code: one of every kind of row, and random ones."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

LEAST_RADIUS_MM = 0.02


def part(*, tools: bool = False) -> Toolpath:
    """Every kind of row: a slot, a full circle, an arc by odd numbers, events and homing."""
    path = ToolpathBuilder()
    if tools:
        path.event(Kind.TOOL_CHANGE, 1)
    path.event(Kind.SPINDLE_CW, 1200).event(Kind.DWELL, 2).rapid(z=5.0).rapid(1.0, 0.75)
    path.source = "outline/LWPOLYLINE 2F"
    path.line(z=-0.5, feed=60.0).line(2.0, 0.75, feed=120.0)
    path.arc(2.0, 1.25, centre=(2.0, 1.0), ccw=True, feed=120.0).line(1.0, 1.25, feed=120.0)
    path.arc(1.0, 0.75, centre=(1.0, 1.0), ccw=True, feed=120.0).rapid(z=5.0)
    path.source = "holes/CIRCLE 30"
    path.rapid(-1.2, -0.3).line(z=-0.5, feed=60.0)
    path.arc(-1.2, -0.3, centre=(-1.5, -0.4), ccw=False, feed=99.9)
    path.arc(-1.587, -0.704, centre=(-1.5, -0.4), ccw=False, feed=99.9)
    path.line(-1.0, -1.0, -0.25, feed=99.9).rapid(z=5.0)
    path.source = ""
    path.event(Kind.SPINDLE_OFF).event(Kind.SPINDLE_CCW, 812.5).message("turn the part")
    path.event(Kind.DWELL, 0.25).event(Kind.SPINDLE_OFF)
    path.set_position(-1.0, -1.0, 0.0).event(Kind.HOME_Z).set_position(0, 0, 0).event(Kind.HOME_XY)
    return path.rapid(3.0, 0.0).event(Kind.END).finish()


def coordinates() -> st.SearchStrategy[float]:
    """mm, on and off any grid."""
    return st.one_of(
        st.integers(-20_000, 20_000).map(lambda number: number / 1000.0), st.floats(-20.0, 20.0)
    )


@st.composite
def toolpaths(draw: st.DrawFn, most_rows: int = 12) -> Toolpath:
    """Random motions and events between a rapid and an END; arcs of 0.02 to 60 mm radius."""
    path = ToolpathBuilder().rapid(z=5.0).rapid(draw(coordinates()), draw(coordinates()))
    for _ in range(draw(st.integers(1, most_rows))):
        feed = draw(st.sampled_from([10.0, 55.5, 200.0, 500.0]))
        choice = draw(st.integers(0, 9))
        if choice == 0:
            path.rapid(draw(coordinates()), draw(coordinates()))
        elif choice == 1:
            path.rapid(z=draw(st.sampled_from([5.0, 2.5])))
        elif choice in (2, 3, 4):
            path.line(draw(coordinates()), draw(coordinates()), feed=feed)
        elif choice == 5:
            path.line(
                draw(coordinates()), draw(coordinates()), draw(st.floats(-3.0, 0.0)), feed=feed
            )
        elif choice == 6:
            kind = draw(st.sampled_from([Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.DWELL]))
            path.event(kind, draw(st.sampled_from([0.5, 1.0, 1200.0])))
        else:
            _arc(draw, path, feed)
    if draw(st.booleans()):
        path.event(Kind.SPINDLE_OFF)
    return path.rapid(z=5.0).event(Kind.END).finish()


def _arc(draw: st.DrawFn, path: ToolpathBuilder, feed: float) -> None:
    """An arc from where the tool is: any radius, direction and sweep, full circles and helices
    too."""
    x, y, _ = path.position
    radius = 10.0 ** draw(st.floats(math.log10(LEAST_RADIUS_MM), math.log10(60.0)))
    away, ccw = draw(st.floats(0.0, 2.0 * math.pi)), draw(st.booleans())
    sweep = draw(st.one_of(st.just(2.0 * math.pi), st.floats(0.3, 6.2)))
    centre = np.array([x, y]) + radius * np.array([math.cos(away), math.sin(away)])
    turn = sweep if ccw else -sweep
    out = np.array([x, y]) - centre
    end = centre + np.array(
        [
            out[0] * math.cos(turn) - out[1] * math.sin(turn),
            out[0] * math.sin(turn) + out[1] * math.cos(turn),
        ]
    )
    if sweep == 2.0 * math.pi:
        end = np.array([x, y])
    path.arc(
        float(end[0]),
        float(end[1]),
        draw(st.none() | st.floats(-3.0, 0.0)),
        centre=(float(centre[0]), float(centre[1])),
        ccw=ccw,
        feed=feed,
    )
