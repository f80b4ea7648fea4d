"""The PIC machine's play by region, measured on it as its thesis measured it (L2353-2423)."""

import numpy as np
import pytest

from camtool.simulation.motion import Effects, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles.motion_rows import rows_of
from tests.targets import simulate

X_REGIONS_UM = (190.0, 201.0, 187.0)
"""H1, H2, H3 (L2353-2373)."""
Y_REGIONS_UM = (152.0, 180.0, 173.0)
"""V1, V2, V3."""


def measured_um(axis: int, low_mm: float, size_mm: float, *settings: str) -> float:
    """Two lines along an axis, joined at their far ends, from `low_mm` of the table on: how far
    the second ends before the place where the first began."""
    machine = load_target("pic-mmh", settings=settings).machine
    corners = [(low_mm, 0.0), (low_mm + size_mm, 0.0), (low_mm + size_mm, 0.2), (low_mm, 0.2)]
    first, *others = [(a, b) if axis == 0 else (b, a) for a, b in corners]
    builder = ToolpathBuilder().rapid(*first)
    for place in others:
        builder.line(*place, feed=0.8)
    options = Options(effects=Effects(compensation=False))
    rows = rows_of(simulate(builder.finish(), machine, options))
    began, ended = rows[0].slide[-1], rows[3].slide[-1]
    return float(ended[axis] - began[axis]) * 1000.0


USE = "play_map.use=true"


@pytest.mark.parametrize(("region", "want_um"), list(enumerate(X_REGIONS_UM)))
def test_each_region_of_x_gives_its_own_play(region: int, want_um: float) -> None:
    """2.5 mm lines, one in each third of the travel of 10 mm."""
    assert measured_um(0, 0.4 + 10.0 / 3.0 * region, 2.5, USE) == pytest.approx(want_um, abs=0.15)


@pytest.mark.parametrize(("region", "want_um"), list(enumerate(Y_REGIONS_UM)))
def test_each_region_of_y_gives_its_own_play(region: int, want_um: float) -> None:
    """1.2 mm lines, one in each third of the travel of 7 mm."""
    assert measured_um(1, 0.5 + 7.0 / 3.0 * region, 1.2, USE) == pytest.approx(want_um, abs=0.15)


@pytest.mark.parametrize(("axis", "low_mm"), [(0, 0.4), (0, 7.1), (1, 0.5), (1, 5.2)])
def test_without_the_map_the_mean_is_the_play_everywhere(axis: int, low_mm: float) -> None:
    """192.5 and 168.5 µm, L2370-2373; the means of the regions are 192.67 and 168.33."""
    want_um = (192.5, 168.5)[axis]
    assert measured_um(axis, low_mm, 1.2) == pytest.approx(want_um, abs=0.15)
    regions = (X_REGIONS_UM, Y_REGIONS_UM)[axis]
    assert np.mean(regions) == pytest.approx(want_um, abs=0.2)


def test_the_map_lies_on_the_table_not_on_the_part() -> None:
    """Part zero 6.8 mm from machine zero: the part begins in the third region."""
    there = "controller.machine_zero_mm=[-6.8, 0.0, 0.0]"
    assert measured_um(0, 0.3, 2.5, USE, there) == pytest.approx(187.0, abs=0.15)
