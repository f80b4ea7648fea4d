"""Nearly straight arcs on every target: what a dialect cannot say of them becomes what it can."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.postprocessors.i8751.machines import SAMPLE
from tests.strategies import examples

# How far the decoded path may lie from the arc: a chord's sagitta of a unit or step (or the
# tolerance that the machine file gives to lines), and its points' own rounding, mm.
TARGETS = {
    ("pic-mmh",): 0.0004,
    ("pic-mmh", "dialect.form=annex"): 0.0025,
    ("flashcut",): 0.0025,
    ("flashcut", "dialect.decimals=4"): 0.0005,
    ("valcnc",): 0.0025,
    ("grbl",): 0.0025,
    ("linuxcnc",): 0.0025,
    ("i8751",): 0.08,
    ("matlab-router",): 0.3,
}
MOST_CENTRE_MM = 10_001.0
"""No program names a centre farther away than this."""


@pytest.fixture(scope="module", params=TARGETS, ids=" ".join)
def target(request: pytest.FixtureRequest) -> tuple[LoadedTarget, float]:
    name, *rest = request.param
    sample = SAMPLE if name == "i8751" else None
    return load_target(name, machine_file=sample, settings=rest), TARGETS[request.param]


def arc(
    heights: tuple[float, float],
    x: float,
    y: float,
    angle: float,
    chord: float,
    radius: float,
    ccw: bool,
) -> Toolpath:
    """A plunge at (x, y), from the first height to the second, and an arc over a chord in the
    direction `angle`, all mm."""
    along = np.array([math.cos(angle), math.sin(angle)])
    left = np.array([-along[1], along[0]])
    middle = np.array([x, y]) + 0.5 * chord * along
    far = math.sqrt(radius**2 - 0.25 * chord**2)
    cx, cy = middle + (far if ccw else -far) * left
    ex, ey = np.array([x, y]) + chord * along
    up, down = heights
    path = ToolpathBuilder().rapid(z=up).rapid(x, y).line(z=down, feed=0.8)
    path.arc(ex, ey, centre=(cx, cy), ccw=ccw, feed=0.8).rapid(z=up)
    return path.finish()


def height(across: Floats, chord: float, radius: float) -> Floats:
    """Height of the arc over its chord at `across` mm from its start."""
    t = across - 0.5 * chord
    end = math.sqrt(radius**2 - 0.25 * chord**2)
    beside = (0.25 * chord**2 - t**2) / (np.sqrt(radius**2 - t**2) + end)
    return np.asarray(beside)


def cut_points(path: Toolpath) -> Floats:
    """(K, 2) points along all cuts below Z0 as decoded."""
    sweeps, starts = path.sweeps(), path.starts
    found = []
    for row in range(len(path)):
        if not path.is_feed[row] or path.end[row, 2] > -0.01 or starts[row, 2] > -0.01:
            continue
        share = np.linspace(0.0, 1.0, 41)[:, None]
        begin, end = starts[row, :2], path.end[row, :2]
        if not path.is_arc[row]:
            found.append(begin + share * (end - begin))
            continue
        assert np.abs(path.centre[row]).max() <= MOST_CENTRE_MM
        out = begin - path.centre[row]
        angle = math.atan2(out[1], out[0]) + share * sweeps[row]
        radius = math.hypot(*out) * (1 - share) + math.dist(end, path.centre[row]) * share
        found.append(path.centre[row] + radius * np.hstack([np.cos(angle), np.sin(angle)]))
    return np.concatenate(found)


@examples(30)
@given(
    angle=st.floats(0.0, 2.0 * math.pi),
    chord=st.floats(0.5, 6.0),
    radius=st.floats(0.7, 12.0).map(lambda power: 10.0**power),
    ccw=st.booleans(),
)
def test_nearly_straight_arcs_are_cut_as_they_are(
    target: tuple[LoadedTarget, float], angle: float, chord: float, radius: float, ccw: bool
) -> None:
    loaded, within = target
    x, y = 6.0 + 3.0 * math.cos(angle + math.pi), 6.0 + 3.0 * math.sin(angle + math.pi)
    heights = loaded.machine.defaults.safe_z_mm, -loaded.machine.defaults.cut_depth_mm
    wanted = arc(heights, x, y, angle, chord, radius, ccw)
    program = loaded.target.write(wanted, loaded.machine)
    points = cut_points(loaded.target.read(program.data, loaded.machine))
    away = points - np.array([x, y])
    across = away @ np.array([math.cos(angle), math.sin(angle)])
    beside = away @ np.array([-math.sin(angle), math.cos(angle)]) * (-1.0 if ccw else 1.0)
    inside = np.clip(across, 0.0, chord)
    off = np.hypot(across - inside, beside - height(inside, chord, radius))
    assert off.max() <= within
    assert across.min() <= within
    assert across.max() >= chord - within
    assert np.diff(np.sort(across)).max() <= chord / 10.0
