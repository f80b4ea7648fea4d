"""Plots over time: no peak is lost, the error is the report's, and memory is bounded."""

from __future__ import annotations

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool
from camtool.errors import OptionError
from camtool.pictures.options import PictureOptions
from camtool.waveforms.columns import Held, TimeColumns
from camtool.waveforms.lanes import TimePlot, columns_for, lanes_svg
from camtool.waveforms.plot import KINDS, TimeSpan, time_plot

SAMPLES = Path(__file__).parents[2] / "samples"
STEP_I8751 = {"axes.x": "0.005", "axes.y": "0.005", "axes.z": "0.005"}
TARGETS = ("flashcut", "grbl", "i8751", "linuxcnc", "matlab-router", "pic-mmh", "valcnc")


def run_on(name: str) -> camtool.Run:
    """A slot and a circle, posted for a target."""
    settings = [f"{axis}.coded_step_mm={step}" for axis, step in STEP_I8751.items()]
    settings = [*settings, "feed.default_mm_min=20"] if name == "i8751" else []
    target = camtool.load_target(name, settings=settings)
    return camtool.post(SAMPLES / "logo.dxf", target)


@pytest.fixture(scope="module", params=TARGETS)
def run(request: pytest.FixtureRequest) -> camtool.Run:
    return run_on(request.param)


def test_the_largest_error_over_time_is_that_of_the_report(run: camtool.Run) -> None:
    assert run.verification is not None
    largest_um = run.verification.report.error_um.total.max
    assert largest_um is not None
    for columns in (1000, 7):
        plot = time_plot("error", run.verification, "logo", columns=columns)
        curve = plot.lanes[0].curves[0]
        assert curve.high.max() == pytest.approx(largest_um, abs=1e-5)
        column, value = plot.lanes[0].mark or (0, 0.0)
        assert curve.high[column] == value == curve.high.max()
    assert f"largest {largest_um:.5g} µm at " in plot.notes[0]
    assert plot.to_s == pytest.approx(run.verification.rows.seconds.sum())


def test_positions_reach_what_the_report_says(run: camtool.Run) -> None:
    """The extents of the slides; the picture of half a program shows no more than that half."""
    assert run.verification is not None
    whole = time_plot("position", run.verification, "logo")
    half = time_plot("position", run.verification, "logo", TimeSpan(0.0, 0.5 * whole.to_s))
    for lane, part in zip(whole.lanes, half.lanes, strict=True):
        curve = lane.curves[0]
        assert np.isfinite(curve.low).all()
        assert part.curves[0].low.min() >= curve.low.min()
        assert part.curves[0].high.max() <= curve.high.max()
    z = whole.lanes[2].curves[0]
    reach = run.verification.report.extents_mm.z
    # The router's tool goes 0.3 mm too deep: its motor overshoots.
    room = 2.5 * run.target.machine.axes.z.coded_step_mm + 0.3
    assert z.low.min() == pytest.approx(reach[0], abs=room)
    assert z.high.max() == pytest.approx(reach[1], abs=room)


def test_speeds_are_those_of_the_machine(run: camtool.Run) -> None:
    """The feed is exceeded by rapids alone, and by √2 where both axes step at the rate of one (and
    by what one step of 16 is, and a servo overshoots)."""
    assert run.verification is not None
    assert run.decoded is not None
    plot = time_plot("speed", run.verification, "logo", columns=3000)
    along = plot.lanes[0].curves[0]
    feeds = run.decoded.feed[run.decoded.is_feed]
    rapid = run.target.machine.rapid_mm_min
    fastest = max(float(np.nanmax(feeds)), rapid if np.isfinite(rapid) else 0.0)
    assert 0.0 < along.high.max() <= 1.5 * fastest
    assert along.low.min() >= 0.0
    names = [strip.name for strip in plot.ribbon]
    assert "feed" in names
    assert "rapid" in names
    for strip in plot.ribbon:
        assert strip.on.any()


def test_the_peak_stands_in_the_picture(run: camtool.Run) -> None:
    """The highest point of the drawn curve is the peak of the report, to the scale of its axis."""
    assert run.verification is not None
    options = PictureOptions(size_px=400)
    plot = time_plot("error", run.verification, "logo", columns=columns_for(options))
    svg = lanes_svg(plot, options)
    drawn = re.findall(r'<path d="([^"]*)"[^>]*>\s*<title>distance from the wanted path<', svg)
    assert len(drawn) == 1
    heights = [float(y) for y in re.findall(r"[-\d.]+ ([-\d.]+)", drawn[0])]
    ring = re.search(r'<circle cx="[^"]*" cy="([^"]*)"', svg)
    assert ring is not None
    assert min(heights) == pytest.approx(float(ring.group(1)), abs=0.011)


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_equal_each_time_and_dark_ones_differ_in_colours(kind: str) -> None:
    run = run_on("grbl")
    first, second = (run.plot(kind, "a.svg") for _ in range(2))
    assert first == second
    dark = run.plot(kind, "a.svg", options=PictureOptions(dark=True))
    assert dark != first
    bare = [re.sub(b'"#[0-9a-f]{6}"', b"", svg) for svg in (first, dark)]
    assert bare[0] == bare[1]
    assert run.plot(kind, "a.png").startswith(b"\x89PNG")


def test_a_dwell_stands() -> None:
    """Two seconds in which nothing moves: a strip of its own, and no speed."""
    program = b"G21 G90\nG1 X10 F600\nG4 P2\nG1 X20\nM2\n"
    run = camtool.verify(program, "linuxcnc")
    assert run.verification is not None
    plot = time_plot("speed", run.verification, "dwell", columns=200)
    stands = next(strip.on for strip in plot.ribbon if strip.name == "stands")
    assert stands.sum() * plot.to_s / 200 == pytest.approx(2.0, abs=0.1)
    inner = np.flatnonzero(stands)[2:-2]
    assert (plot.lanes[0].curves[0].high[inner] == 0.0).all()


held = st.lists(st.tuples(st.floats(0.0, 3.0), st.floats(-5.0, 5.0)), min_size=1, max_size=40)


@given(held, st.integers(1, 30), st.floats(0.0, 5.0), st.floats(0.1, 20.0), st.integers(1, 40))
def test_columns_are_those_of_a_plain_loop(
    parts: list[tuple[float, float]], count: int, from_s: float, span_s: float, size: int
) -> None:
    at_s = np.cumsum([lasts for lasts, _ in parts])
    values = np.array([value for _, value in parts])
    columns = TimeColumns(from_s, from_s + span_s, count, 1)
    holder = Held(columns)
    for low in range(0, len(parts), size):
        part = slice(low, low + size)
        holder.add(at_s[part], values[part, None], np.arange(len(parts))[part])
    holder.finish(float(at_s[-1]) + 1.0)
    ends = np.append(at_s[1:], at_s[-1] + 1.0)
    width = span_s / count
    for column in range(count):
        begin, end = from_s + column * width, from_s + (column + 1) * width
        # A value that holds within the column must be in it; none from beyond its edges may be.
        inside = (ends > begin + 1e-9) & (at_s < end - 1e-9)
        near = (ends >= begin - 1e-9) & (at_s <= end + 1e-9)
        if inside.any():
            assert columns.low[0, column] <= values[inside].min()
            assert columns.high[0, column] >= values[inside].max()
        if np.isfinite(columns.low[0, column]):
            assert columns.low[0, column] >= values[near].min()
            assert columns.high[0, column] <= values[near].max()


def test_memory_is_that_of_the_columns() -> None:
    """Ten times as many samples take no more memory, and the one peak among them is kept."""

    def most(chunks: int) -> int:
        columns = TimeColumns(0.0, float(chunks), 1000, 3)
        holder = Held(columns)
        tracemalloc.start()
        for k in range(chunks):
            at_s = k + np.arange(5000) / 5000.0
            values = np.zeros((5000, 3))
            values[1234, 1] = 7.5 if k == chunks // 2 else 0.0
            holder.add(at_s, values, np.full(5000, k))
        holder.finish(float(chunks))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert columns.high[1].max() == columns.largest[1].value == 7.5
        assert columns.largest[1].row == chunks // 2
        return peak

    most(2)
    assert most(200) < 1.2 * most(20)


def test_a_plot_without_lanes_of_known_values() -> None:
    """A program that cuts nothing has no error, and says so."""
    run = camtool.verify(b"G21 G90\nG0 X10\nM2\n", "grbl")
    assert run.verification is not None
    plot = time_plot("error", run.verification, "rapid")
    assert plot.notes[0] == "nothing is cut, so there is no error"
    assert isinstance(plot, TimePlot)
    assert b"nothing is cut" in run.plot("error", "a.svg")


@pytest.mark.parametrize(
    ("stretch", "message"),
    [
        (TimeSpan(1e6), "from 1e+06 s on there is nothing"),
        (TimeSpan(-1.0), "from -1 s on there is nothing"),
        (TimeSpan(0.0, 0.0), "a stretch of 0 s is none"),
        (TimeSpan(0.0, float("nan")), "a stretch of nan s is none"),
    ],
)
def test_stretches_outside_are_refused(stretch: TimeSpan, message: str) -> None:
    with pytest.raises(OptionError, match=re.escape(message)):
        stretch.within(10.0)
