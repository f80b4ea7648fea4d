"""Programs with depth: ramps, helices, passes, tabs, pockets, pecks, carving; judged rightly."""

import math

import numpy as np
import pytest

from camtool.findings import Code, Severity
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.coverage import holes_of
from camtool.verification.cuts import cut_moves, loops
from camtool.verification.findings import VerificationCode
from camtool.verification.verify import Verification, VerifyOptions
from tests.oracles.deep_moves import Shop, everything
from tests.oracles.path_machine import path_machine
from tests.targets import verify

I8751 = [f"axes.{axis}.coded_step_mm=0.0125" for axis in "xyz"]
SHOPS = {
    "grbl": (5.0, 2.0, 200.0, []),
    "linuxcnc": (5.0, 2.0, 500.0, []),
    "flashcut": (1.0, 0.06, 8.0, []),
    "pic-mmh": (1.0, 0.02, 0.8, []),
    "valcnc": (20.0, 2.0, 14400.0, []),
    "i8751": (10.0, 1.0, 50.0, [*I8751, "feed.default_mm_min=50", "dialect.tolerance_mm=0.03"]),
}


def judged(decoded: Toolpath, wanted: Toolpath | None = None) -> Verification:
    return verify(decoded, path_machine(), wanted=wanted)


def errors(found: Verification) -> list[Code]:
    return [finding.code for finding in found.findings if finding.severity == Severity.ERROR]


@pytest.mark.parametrize("name", SHOPS)
def test_each_dialect_cuts_all_of_it(name: str) -> None:
    size, deep, feed, settings = SHOPS[name]
    target = load_target(name, settings=settings)
    wanted = everything(size, deep, feed)
    program = target.target.write(wanted, target.machine)
    decoded = target.target.read(program.data, target.machine)
    options = VerifyOptions(tool_diameter_mm=0.3 * size)
    found = verify(decoded, target.machine, wanted=wanted, options=options)
    assert errors(found) == []
    split = ProgramCode.MOVE_SPLIT in {finding.code for finding in program.findings}
    assert split == (name not in ("grbl", "linuxcnc"))
    nominal = {size_.name: size_.nominal_mm for size_ in found.report.dimensions}
    # The pocket is contour 3, and deeper contour 4.
    assert [key for key in nominal if key.endswith("X")] == ["part X"] + [
        f"contour {number} X" for number in (1, 2, 4)
    ]
    for number, wide in ((1, size), (2, 0.8 * size), (4, size)):
        assert nominal[f"contour {number} X"] == pytest.approx(wide)
        assert nominal[f"contour {number} Y"] == pytest.approx(wide)
    for one in found.report.dimensions:
        assert one.predicted_mm == pytest.approx(one.nominal_mm, rel=0.03)
    (circle,) = found.report.circles
    assert circle.z_mm == -deep
    assert circle.radius_mm == pytest.approx(0.4 * size)


def test_helices_and_slopes_come_back_as_they_are_where_they_can_be_said() -> None:
    for name in ("grbl", "linuxcnc"):
        size, deep, feed, _ = SHOPS[name]
        target = load_target(name)
        wanted = everything(size, deep, feed)
        decoded = target.target.read(
            target.target.write(wanted, target.machine).data, target.machine
        )
        moves = wanted.is_feed & (wanted.end != wanted.starts).any(axis=1) | wanted.is_arc
        assert decoded.kind[decoded.is_feed].tolist() == wanted.kind[moves].tolist()
        assert np.abs(decoded.end[decoded.is_feed] - wanted.end[moves]).max() < 0.00051


def shop() -> Shop:
    return Shop(10.0, 3.0, 100.0)


def moved(path: Toolpath, rows: np.ndarray, way: tuple[float, float, float]) -> Toolpath:
    """The same with the ends of some rows elsewhere."""
    end = path.end.copy()
    end[rows] += way
    return replace(path, end=end)


def test_a_lost_pass_is_missing() -> None:
    made = shop()
    made.pocket(20.0, 20.0)
    wanted = made.finish()
    assert errors(judged(wanted, wanted)) == []
    upper = wanted.end[:, 2] == -1.5
    lost = judged(moved(wanted, upper, (0.0, 0.0, -1.5)), wanted)
    assert errors(lost) == [VerificationCode.CONTOUR_MISSING]
    assert "none is at its depth" in lost.findings[0].message


@pytest.mark.parametrize("off", [0.03, -0.03])
def test_a_slope_at_another_height_is_missing_and_extra(off: float) -> None:
    made = shop()
    made.carve(10.0, 10.0)
    wanted = made.finish()
    carved = wanted.is_feed & (wanted.end[:, 2] < 0.0)
    found = judged(moved(wanted, carved, (0.0, 0.0, off)), wanted)
    assert set(errors(found)) == {VerificationCode.CONTOUR_MISSING, VerificationCode.EXTRA_CUT}
    assert errors(judged(moved(wanted, carved, (0.0, 0.0, 0.1 * off)), wanted)) == []


def test_a_slope_the_other_way_round_is_another_slope() -> None:
    there = ToolpathBuilder().rapid(z=1).rapid(5, 5).line(z=-1, feed=9).line(9, 5, -3, feed=9)
    back = ToolpathBuilder().rapid(z=1).rapid(5, 5).line(z=-3, feed=9).line(9, 5, -1, feed=9)
    found = judged(there.rapid(z=1).finish(), back.rapid(z=1).finish())
    assert set(errors(found)) == {VerificationCode.CONTOUR_MISSING, VerificationCode.EXTRA_CUT}
    share = [float(one.message.split("%")[0]) for one in found.findings if "%" in one.message]
    assert min(share) > 90.0


def test_a_helix_of_the_wrong_pitch_is_found() -> None:
    def bore(depth: float) -> Toolpath:
        b = ToolpathBuilder().rapid(z=1).rapid(7, 5).line(z=0, feed=9)
        return b.arc(7, 5, -depth, centre=(5, 5), ccw=True, feed=9).rapid(z=1).finish()

    assert errors(judged(bore(1.0), bore(1.0))) == []
    assert set(errors(judged(bore(1.0), bore(1.1)))) == {
        VerificationCode.CONTOUR_MISSING,
        VerificationCode.EXTRA_CUT,
    }


def test_a_slope_in_steps_of_a_hair_is_that_slope() -> None:
    ramp = ToolpathBuilder().rapid(z=1).rapid(5, 5).line(z=0, feed=9).line(9, 5, -0.1, feed=9)
    stairs = ToolpathBuilder().rapid(z=1).rapid(5, 5).line(z=0, feed=9)
    for number in range(1, 21):
        stairs.line(5 + 0.2 * number, 5, feed=9).line(z=-0.005 * number, feed=9)
    assert errors(judged(stairs.rapid(z=1).finish(), ramp.rapid(z=1).finish())) == []


def drilled(*depths: float) -> Toolpath:
    b = ToolpathBuilder().rapid(z=1)
    for number, depth in enumerate(depths):
        b.rapid(5.0 * number + 5.0, 5.0).line(z=-0.5 * depth, feed=9).rapid(z=1)
        b.rapid(z=-0.4 * depth).line(z=-depth, feed=9).event(Kind.DWELL, 1).rapid(z=1)
    return b.rapid(0, 0).finish()


def test_holes_are_found_and_no_contour_begins_as_one() -> None:
    holes = holes_of(drilled(2.0, 3.0))
    assert holes.places.tolist() == [[5.0, 5.0], [10.0, 5.0]]
    assert holes.bottom_mm.tolist() == [-2.0, -3.0]
    assert holes.row.tolist() == [5, 12]
    made = shop()
    made.profile(10.0, 10.0)
    assert len(holes_of(made.finish())) == 0
    assert len(holes_of(everything(10.0, 3.0, 9.0))) == 2


def test_a_program_that_only_drills_is_judged_and_has_no_false_alarm() -> None:
    holes, options = drilled(2.0, 3.0), VerifyOptions(tool_diameter_mm=1.0)
    found = verify(holes, path_machine(), wanted=holes, options=options)
    assert errors(found) == []
    assert VerificationCode.NO_MOTION not in {finding.code for finding in found.findings}


def ring(radius: float, depth: float) -> Toolpath:
    """A full circle about (5, 5), beside a line."""
    b = ToolpathBuilder().rapid(z=1).rapid(5 + radius, 5).line(z=-depth, feed=9)
    b.arc(5 + radius, 5, centre=(5, 5), ccw=True, feed=9).rapid(z=1)
    return b.rapid(8, 8).line(z=-1, feed=9).line(9, 8, feed=9).rapid(z=1).finish()


def plunge(x: float, depth: float) -> Toolpath:
    """The same where the circle is nothing but a plunge."""
    b = ToolpathBuilder().rapid(z=1).rapid(x, 5).line(z=-depth, feed=9).rapid(z=1)
    return b.rapid(8, 8).line(z=-1, feed=9).line(9, 8, feed=9).rapid(z=1).finish()


def test_a_plunge_stands_for_a_contour_smaller_than_a_dialect_can_say() -> None:
    tiny = ring(0.0005, 1.0)  # places and heights may differ by four steps: 0.02 mm

    def found(decoded: Toolpath, wanted: Toolpath) -> set[Code]:
        return set(errors(verify(decoded, path_machine(), wanted=wanted)))

    both = {VerificationCode.CONTOUR_MISSING, VerificationCode.EXTRA_CUT}
    for x in (5.0, 5.0005, 5.01):
        assert found(plunge(x, 1.0), tiny) == set()
        assert found(tiny, plunge(x, 1.0)) == set()
    # Farther off, of another depth, or for what is larger than the limit, it does not.
    for decoded, wanted in (
        (plunge(5.03, 1.0), tiny),
        (plunge(5.0, 1.1), tiny),
        (plunge(5.0, 1.0), ring(0.03, 1.0)),
    ):
        assert found(decoded, wanted) == both
        assert found(wanted, decoded) == both


def test_lost_added_and_shallow_holes() -> None:
    missing = judged(drilled(2.0), drilled(2.0, 3.0))
    assert errors(missing) == [VerificationCode.CONTOUR_MISSING]
    (finding,) = [one for one in missing.findings if one.code == VerificationCode.CONTOUR_MISSING]
    assert finding.where == "move 13 at (10.000, 5.000) mm"
    assert errors(judged(drilled(2.0, 3.0), drilled(2.0))) == [VerificationCode.EXTRA_CUT]
    shallow = judged(drilled(2.0, 2.9), drilled(2.0, 3.0))
    assert errors(shallow) == [VerificationCode.CONTOUR_MISSING, VerificationCode.EXTRA_CUT]
    assert "another depth" in shallow.findings[0].message


def test_loops_of_leads_passes_and_ways_there_and_back() -> None:
    made = shop()
    made.profile(10.0, 10.0)
    made.pocket(40.0, 20.0)
    path = made.path.rapid(z=3.0).rapid(60.0, 10.0).line(z=-1.0, feed=9)
    path.line(70.0, 15.0, feed=9).line(z=-2.0, feed=9).line(60.0, 10.0, feed=9)
    toolpath = made.finish()
    cuts = cut_moves(toolpath, flat_cuts=False)
    found = loops(cuts, 0.01)
    for (first, last), deep in zip(found[:3].tolist(), (-3.0, -1.5, -3.0), strict=True):
        points = np.concatenate([toolpath.starts[[first], :2], toolpath.end[first : last + 1, :2]])
        assert points.max(axis=0) - points.min(axis=0) == pytest.approx(10.0)
        assert toolpath.end[last, 2] == deep
    assert found[-1].tolist() == [-1, -1]


def test_a_circle_in_passes_is_reported_once_at_its_deepest() -> None:
    b = ToolpathBuilder().rapid(z=1).rapid(7, 5)
    for level in (-1.0, -2.0, -2.5):
        b.line(z=level, feed=9).arc(7, 5, centre=(5, 5), ccw=True, feed=9)
    b.rapid(z=1).rapid(17, 5).line(z=-1, feed=9).arc(17, 5, centre=(15, 5), ccw=False, feed=9)
    toolpath = b.rapid(z=1).finish()
    found = judged(toolpath, toolpath)
    assert [(one.centre_mm, one.z_mm) for one in found.report.circles] == [
        ((5.0, 5.0), -2.5),
        ((15.0, 5.0), -1.0),
    ]
    assert all(one.G_um == pytest.approx(0.0, abs=1e-6) for one in found.report.circles)
    assert found.report.contours == 2
    assert found.report.closure_um == pytest.approx(0.0, abs=1e-6)


def test_closure_is_that_of_the_last_pass() -> None:
    made = shop()
    made.profile(10.0, 10.0)
    found = judged(made.finish())
    assert found.report.closure_um == pytest.approx(0.0, abs=1e-6)
    line = ToolpathBuilder().rapid(z=1).rapid(5, 5).line(z=-1, feed=9).line(9, 9, feed=9)
    assert judged(line.rapid(z=1).finish()).report.closure_um is None


@pytest.mark.slow
def test_a_pocket_of_50000_moves_and_a_carving_are_judged() -> None:
    for wanted in (large_pocket(50_000), large_carving(20_000)):
        assert errors(judged(wanted, wanted, tool=2.0)) == []


def large_pocket(moves: int) -> Toolpath:
    b = ToolpathBuilder().rapid(z=1).rapid(100, 100).line(z=-1, feed=99)
    for number in range(moves):
        turn, radius = 0.05 * number, 0.02 * 0.05 * number / math.tau * 60.0
        b.line(100 + radius * math.cos(turn), 100 + radius * math.sin(turn), feed=99)
    return b.rapid(z=1).finish()


def large_carving(moves: int) -> Toolpath:
    b = ToolpathBuilder().rapid(z=1).rapid(10, 10).line(z=0, feed=99)
    for number in range(1, moves):
        x, y = number % 400, number // 400
        along = x if y % 2 == 0 else 400 - x
        z = -1.0 - math.sin(0.1 * along) * math.cos(0.3 * y)
        b.line(10 + 0.3 * along, 10 + 0.5 * y, z, feed=99)
    return b.rapid(z=1).finish()
