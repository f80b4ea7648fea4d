"""What the theses on ValCNC and on the Matlab router measured, or said of their pieces."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.measurements import Measurements, StepsCoupon, read_measurements
from camtool.importers.read import read_drawing
from camtool.machine.model import Machine
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.oracles.motion_rows import rows_of
from tests.targets import simulate
from tests.validation.page import check, mm, signed
from tests.validation.pieces import ROOT, UM

MEASURED = ROOT / "samples" / "measured" / "valcnc-steps.toml"
"""Tablas 14 to 16, L1649-1682: ten moves of 8 mm in +."""
TURNS = 8.0 * np.arange(1, 11)


def readings() -> dict[str, np.ndarray]:
    said = tomllib.loads(MEASURED.read_text(encoding="utf-8"))["steps"]
    return {table["axis"]: np.array(table["forward_mm"]) for table in said}


def ten_turns(axis: str, *settings: str) -> np.ndarray:
    """(10,) mm: where a program of ten moves of 8 mm leads the slide."""
    return places_of(*turned(axis, *settings), axis)


def turned(axis: str, *settings: str) -> tuple[Toolpath, Machine]:
    """The program of ten moves of 8 mm as it is decoded, and the machine."""
    target = load_target("valcnc", settings=settings)
    path = ToolpathBuilder()
    for place in TURNS:
        path.rapid(**{axis: float(place)})
    program = target.target.write(path.finish(), target.machine)
    return target.target.read(program.data, target.machine), target.machine


def places_of(decoded: Toolpath, machine: Machine, axis: str) -> np.ndarray:
    """(10,) mm: where the slide stands after each move."""
    rows = rows_of(simulate(decoded, machine))
    return np.array([row.slide[-1, "xyz".index(axis)] for row in rows if len(row.slide)])


def step_by_five(axis: str) -> float:
    """Compute the step from the first five turns."""
    estimate = by_five(axis).estimate("step", axis)
    assert estimate is not None
    return estimate.value


def by_five(axis: str) -> Calibration:
    """Compute the values of the first five turns."""
    said = read_measurements(MEASURED)
    ((name, coupon),) = [each for each in said.coupons if getattr(each[1], "axis", "") == axis]
    assert isinstance(coupon, StepsCoupon)
    assert coupon.forward_mm is not None
    half = StepsCoupon(axis=coupon.axis, nominal_mm=coupon.nominal_mm[:5],
                 forward_mm=coupon.forward_mm[:5])  # fmt: skip
    some = Measurements(
        said.file, said.target, None, said.compensation_mm, said.regions, ((name, half),)
    )
    return calibrate(some, load_target("valcnc").machine)


def test_valcnc(bless: bool) -> None:
    rows = []
    for axis, read in readings().items():
        shipped = ten_turns(axis)
        ideal = ten_turns(axis, f"axes.{axis}.real_step_mm=0.04")
        half = ten_turns(axis, f"axes.{axis}.real_step_mm={step_by_five(axis)!r}")
        assert ideal == pytest.approx(TURNS)
        later = (read - half)[5:]
        # The first half tells the second: at least four times better than without.
        assert 4.0 * np.abs(later).max() < np.abs(read - ideal).max()
        rows.append(
            [
                axis.upper(),
                mm(read[-1], 2),
                mm(ideal[-1], 2),
                mm(shipped[-1], 2),
                signed(float(np.abs(read - ideal).max()) * UM, 0).lstrip("+"),
                signed(float(np.abs(read - shipped).max()) * UM, 0).lstrip("+"),
                signed(float(np.abs(later).max()) * UM, 0).lstrip("+"),
            ]
        )
    heads = ["axis", "after ten turns, mm", "nominal lead", "as shipped"]
    more = ["largest error, µm: nominal", "as shipped", "turns 6 to 10 by turns 1 to 5"]
    check("valcnc", [*heads, *more], rows, bless)


EQUAL_MOTORS = [7.2, 30.5, 1.0]
"""Percent. Frictions with which the three motors of table 4.1 have one gain."""


def test_the_frictions_that_make_the_motors_equal() -> None:
    """Table 4.1 has three gains and one time constant. Load and viscous friction change both;
    dry friction changes the gain alone. Z at least 1 %: the drive of 0 is 0.96 % of the bus."""
    settings = [f"controller.friction_percent={EQUAL_MOTORS}"]
    loaded = load_target("matlab-router", settings=settings)
    loop = loaded.target.speed_loop(loaded.machine)
    assert loop is not None
    gains = [motor.gain for motor in loop.motors]
    assert max(gains) / min(gains) < 1.003
    times = [motor.time_constant_s for motor in loop.motors]
    assert max(times) / min(times) < 1.02


def test_router(bless: bool) -> None:
    """A closed figure "termina en el mismo punto" (L3886-3892); nothing was measured."""
    rows = []
    drawing = read_drawing(ROOT / "samples" / "star.csv")
    for friction in ([0.0] * 3, [1.0] * 3, EQUAL_MOTORS, [10.0] * 3, [30.0] * 3):
        set_to = f"controller.friction_percent={friction}"
        target = load_target("matlab-router", settings=[set_to])
        posted = post_drawing(drawing, job_of(), target)
        assert posted.verification is not None
        assert posted.decoded is not None
        report = posted.verification.report
        error = report.error_um.total
        assert error.max is not None
        assert error.rms is not None
        motion = rows_of(simulate(posted.decoded, target.machine))
        down = posted.decoded.is_feed & (posted.decoded.end[:, 2] < 0.0)
        cut = [row.slide for row, on in zip(motion, down, strict=True) if on and len(row.slide)]
        wanted = posted.decoded.end[down, :2][[0, -1]]
        begin, end = cut[0][-1, :2], cut[-1][-1, :2]
        missed = (end - begin) - (wanted[1] - wanted[0])
        rows.append(
            [
                f"{friction[0]:g} %" if len({*friction}) == 1 else "7.2, 30.5, 1 % for X, Y, Z",
                mm(error.max / UM, 2),
                mm(error.rms / UM, 2),
                mm(math.hypot(*missed), 2),
            ]
        )
    heads = ["friction", "largest error, mm", "rms", "error of the end, from the start, mm"]
    check("router", heads, rows, bless)
