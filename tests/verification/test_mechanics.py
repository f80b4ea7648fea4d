"""Judging machines with play by region, out of square, with scatter."""

import math

import numpy as np
import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.verification.verify import Verification
from tests.oracles.dense_moves import circle, square
from tests.oracles.path_machine import both, path_machine
from tests.targets import verify

RADIUS = 20.0
MAP = (
    "play_map.use=true",
    "play_map.x.x_mm=[0.0, 10.0, 20.0]",
    "play_map.x.y_mm=[0.0, 20.0]",
    "play_map.x.play_mm=[[0.03, 0.05]]",
)


def judged_square(at: float, *settings: str) -> Verification:
    path = square(ToolpathBuilder(), at, at, 2.0).finish()
    return verify(path, path_machine(*settings), wanted=path)


@pytest.mark.parametrize(("at", "play_um"), [(1.0, 30.0), (15.0, 50.0), (31.0, 50.0)])
def test_a_part_has_the_play_of_its_place(at: float, play_um: float) -> None:
    found = judged_square(at, *MAP).report.error_um
    assert found.mechanics.max == pytest.approx(play_um, abs=1e-6)


def test_a_play_that_the_map_says_is_known() -> None:
    for settings, want in ((MAP, ["axis Y", "axis Z"]), (MAP[1:], ["axis X", "axis Y", "axis Z"])):
        found = judged_square(1.0, *settings).findings
        assert [f.where for f in found if f.code == ProgramCode.PLAY_NOT_KNOWN] == want


@pytest.mark.parametrize("lean", [0.001, -0.02])
def test_a_circle_out_of_square_is_an_ellipse_at_45_degrees(lean: float) -> None:
    """x + y t, y: the half axes s of the ellipse have product R² and squares' sum R² (2 + t²),
    so they differ by R |t|, which is the circular error G."""
    path = circle(ToolpathBuilder(), 30.0, 0.0, RADIUS).finish()
    settings = (f"mechanics.squareness_rad={lean}", "controller.grid=none")
    found = verify(path, path_machine(*settings), wanted=path).report
    (ring,) = found.circles
    assert ring.G_um == pytest.approx(1000.0 * RADIUS * abs(math.tan(lean)), rel=1e-3)


@pytest.mark.parametrize("play", [0.01, 0.2])
def test_a_circle_with_play_in_both_axes(play: float) -> None:
    """From the right end, counter-clockwise, engaged towards +: on the right X stands still while
    Y goes by w = √(2Rb − b²), on the left and below one axis lacks b; the figures against the
    closed form of all four quarters, and against its least-squares centre by Gauss-Newton."""
    path = circle(ToolpathBuilder(), 30.0, 30.0, RADIUS).finish()
    settings = (*both("backlash_mm", play), "controller.grid=none")
    (ring,) = verify(path, path_machine(*settings), wanted=path).report.circles
    w = math.sqrt(2.0 * RADIUS * play - play**2)
    assert ring.Fmax_um == pytest.approx(1000.0 * (math.hypot(RADIUS, w) - RADIUS), rel=1e-3)
    assert ring.Fmin_um == pytest.approx(-1000.0 * play, rel=1e-3)
    angle = np.linspace(0.0, 2.0 * math.pi, 100_000, endpoint=False)
    x, y = RADIUS * np.cos(angle), RADIUS * np.sin(angle)
    right, upper = angle <= math.pi, (angle <= 0.5 * math.pi, angle <= 1.5 * math.pi)
    slide_x = np.where(right, np.minimum(RADIUS, x + play), np.maximum(play - RADIUS, x))
    falling = np.where(upper[1], np.minimum(RADIUS, y + play), np.maximum(play - RADIUS, y))
    slide_y = np.where(upper[0], y, falling)
    centre = np.zeros(3)
    for _ in range(20):
        off = np.stack([slide_x - centre[0], slide_y - centre[1]])
        radii = np.hypot(*off)
        slopes = np.column_stack([-off[0] / radii, -off[1] / radii, -np.ones_like(radii)])
        centre -= np.linalg.lstsq(slopes, radii - centre[2], rcond=None)[0]
    assert ring.G_um == pytest.approx(1000.0 * np.ptp(radii), rel=5e-3)


def test_a_part_scatters_within_bounds_and_as_the_seed_says() -> None:
    """Six standard deviations at most."""
    settings = both("repeatability_mm", 0.01)
    one, same, other = (
        judged_square(1.0, *settings, f"mechanics.seed={seed}").report.error_um.mechanics.max
        for seed in (0, 0, 1)
    )
    assert one is not None
    assert one == same
    assert one != other
    assert 0.0 < one < 6.0 * 10.0 * math.sqrt(2.0)
