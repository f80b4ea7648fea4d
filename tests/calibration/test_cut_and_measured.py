"""The whole way: a coupon drawn, posted, run by its controller's model, read and calibrated."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.coupons import CouponSheet, dxf, sheet
from camtool.calibration.measurements import Added, LinesCoupon, Measurements, Regions, RegionsOf
from camtool.importers.read import read_drawing
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, Operation
from camtool.target.registry import LoadedTarget, load_target
from tests.targets import simulate

NEAR_MM = 1e-6


def slides_at_ends(
    drawn: CouponSheet, target: LoadedTarget, folder: Path
) -> tuple[np.ndarray, np.ndarray]:
    """(R, 2) commanded ends of the rows of the posted coupon, and the slides there."""
    (folder / "coupon.dxf").write_bytes(dxf(drawn))
    drawing = read_drawing(folder / "coupon.dxf")
    job = Job(operations=(Operation(kind="engrave", start="longest-line"),))
    posted = post_drawing(drawing, job, target, check=False)
    assert posted.decoded is not None
    ends = np.full((len(posted.decoded), 2), np.nan)
    for chunk in simulate(posted.decoded, target.machine):
        last = np.flatnonzero(np.diff(chunk.row, append=-1))  # where the next sample's row differs
        ends[chunk.row[last]] = chunk.slide[last, :2]
    return posted.decoded.end[:, :2], ends


def lines_read(
    drawn: CouponSheet, commanded: np.ndarray, slides: np.ndarray, grid_mm: float
) -> list[LinesCoupon]:
    """Each coupon's two lines, from the slides at its corners."""
    found = []
    for path, (_, table) in zip(drawn.paths, drawn.tables, strict=True):
        axis = "xy".index(table["axis"])
        corners = np.array(path.vertices)[:, :2]
        at = [
            int(np.flatnonzero((np.abs(commanded - corner) < grid_mm).all(axis=1))[-1])
            for corner in corners
        ]
        places = slides[at, axis]
        read = {
            **table,
            "first_mm": float(places[3] - places[2]),
            "second_mm": float(places[4] - places[5]),
        }
        found.append(msgspec.convert(read, LinesCoupon))
    return found


def calibrated(
    drawn: CouponSheet, target: LoadedTarget, before: LoadedTarget, folder: Path
) -> Calibration:
    commanded, slides = slides_at_ends(drawn, target, folder)
    step_mm = target.machine.axes.x.coded_step_mm
    lines = lines_read(drawn, commanded, slides, max(step_mm, NEAR_MM))
    cells = Regions(**drawn.regions) if drawn.regions else None
    coupons = tuple((f"lines {n}", each) for n, each in enumerate(lines, start=1))
    said = Measurements("m.toml", "", None, Added(), RegionsOf(cells, cells), coupons)
    return calibrate(said, before.machine)


@pytest.mark.parametrize(
    ("name", "added"), [("pic-mmh", 0.1), ("pic-mmh", 0.0), ("grbl", 0.0), ("flashcut", 0.1)]
)
def test_the_play_and_the_step_of_a_machine_come_back(
    name: str, added: float, tmp_path: Path
) -> None:
    faults = [
        "axes.x.backlash_mm=0.11",
        "axes.y.backlash_mm=0.07",
        f"axes.x.compensation_mm={added}",
        f"axes.y.compensation_mm={added}",
    ]
    coded = load_target(name).machine.axes.x.coded_step_mm
    steps = [f"axes.x.real_step_mm={1.003 * coded}", f"axes.y.real_step_mm={0.998 * coded}"]
    target = load_target(name, settings=[*faults, *steps])
    before = load_target(name, settings=faults[2:])
    result = calibrated(
        sheet("lines", (10.0, 7.0), machine=target.machine), target, before, tmp_path
    )
    for axis, play, scale in (("x", 0.11, 1.003), ("y", 0.07, 0.998)):
        found, step = result.estimate("play", axis), result.estimate("step", axis)
        assert found is not None
        assert step is not None
        # The controller goes to whole steps: lengths are as much off, and the shortest is 5 mm.
        assert found.value == pytest.approx(play, abs=2.1 * coded)
        assert step.value == pytest.approx(scale * coded, rel=2.0 * coded / 5.0)


def test_the_regions_of_the_pic_machine_come_back(tmp_path: Path) -> None:
    target = load_target("pic-mmh", settings=["play_map.use=true"])
    before = load_target("pic-mmh", settings=["axes.x.backlash_mm=0", "axes.y.backlash_mm=0"])
    drawn = sheet("lines", (10.0, 7.0), (3, 3), target.machine)
    result = calibrated(drawn, target, before, tmp_path)
    for column, x_play in enumerate((0.190, 0.201, 0.187)):  # L2353-2373
        for row, y_play in enumerate((0.152, 0.180, 0.173)):
            region = f"{'ABC'[column]}{row + 1}"
            x, y = result.estimate("play", "x", region), result.estimate("play", "y", region)
            assert x is not None
            assert y is not None
            assert x.value == pytest.approx(x_play, abs=5e-4)
            assert y.value == pytest.approx(y_play, abs=5e-4)
