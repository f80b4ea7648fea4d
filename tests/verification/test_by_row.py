"""Contours, the worst moves, missed ends, depth, time: from made motions and from real ones."""

import numpy as np
import pytest

from camtool.records import replace
from camtool.simulation.motion import one_row
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.findings import VerificationCode
from camtool.verification.verify import Case, VerifyOptions, judge
from tests.oracles.dense_moves import circle, cut, follow, pic_mmh, square
from tests.oracles.judged import MACHINE, judged
from tests.targets import on, verify


def two_squares():
    """Make two squares, of 1 mm and of 2 mm."""
    b = square(ToolpathBuilder(), 1.0, 1.0, 1.0)
    return square(b, 4.0, 1.0, 2.0).finish()


def further_out(points):
    """Slides 2 µm right of x = 3, and 1 µm left of it."""
    return points + np.where(points[:, :1] > 3.0, [[0.002, 0.0]], [[-0.001, 0.0]])


def test_each_contour_has_its_own_figures() -> None:
    found = judged(two_squares(), two_squares(), further_out).report
    first, second = found.contour_errors
    assert (first.name, second.name) == ("contour 1", "contour 2")
    assert (first.max_um, second.max_um) == pytest.approx((1.0, 2.0), abs=1e-6)
    assert (first.mechanics_um, second.mechanics_um) == pytest.approx((1.0, 2.0), abs=1e-6)
    assert (first.interpolation_um, second.interpolation_um) == pytest.approx((0.0, 0.0), abs=0.2)
    # Upright sides are off by it, level ones not at all but near their corners.
    assert first.rms_um == pytest.approx(1.0 / np.sqrt(2.0), rel=0.01)
    assert second.rms_um == pytest.approx(2.0 / np.sqrt(2.0), rel=0.01)
    # Counterclockwise the inside lies left: one side in, the other out.
    assert first.mean_um == pytest.approx(0.0, abs=0.01)
    assert second.block is None


def test_the_signed_mean_tells_inside_from_outside() -> None:
    toolpath = circle(ToolpathBuilder(), 4.0, 4.0, 2.0).finish()
    larger = judged(toolpath, toolpath, lambda p: (p - 4.0) * 1.001 + 4.0).report.error_um.total
    assert larger.mean == pytest.approx(-2.0, rel=1e-3)  # to the right of the way: outside
    smaller = judged(toolpath, toolpath, lambda p: (p - 4.0) * 0.999 + 4.0).report.error_um.total
    assert smaller.mean == pytest.approx(2.0, rel=1e-3)


def test_the_worst_moves_come_first_and_know_their_blocks() -> None:
    decoded = replace(two_squares(), block=np.arange(len(two_squares())) + 10)
    options = VerifyOptions(worst=3)
    chunks = follow(decoded, 50, further_out)
    found = judge(Case(decoded, on(MACHINE), two_squares(), None, options), chunks).report
    assert len(found.worst) == 3
    errors = [one.total_um for one in found.worst]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == pytest.approx(2.0, abs=1e-6)
    assert all(one.block == one.move + 10 for one in found.worst)
    assert all(one.at_mm[0] > 3.0 for one in found.worst[:2])
    assert found.worst_text().splitlines()[0].startswith(f"block {found.worst[0].block} ")
    none = judge(
        Case(decoded, on(MACHINE), None, None, VerifyOptions(worst=0)), follow(decoded, 5)
    ).report
    assert none.worst == ()


def test_ends_that_the_controller_does_not_reach() -> None:
    decoded = two_squares()

    def short(row, chunk):
        """The controller stops 30 µm short on row 4, and 10 on row 5."""
        missing = {4: 0.03, 5: 0.01}.get(row, 0.0)
        commanded = chunk.commanded.copy()
        commanded[-1:, 1] -= missing
        return one_row(row, commanded, commanded)

    chunks = [short(index, one) for index, one in enumerate(follow(decoded, 20))]
    made = judge(Case(decoded, on(MACHINE), decoded, None, VerifyOptions()), chunks)
    assert made.report.unreached is not None
    assert made.report.unreached.moves == 2
    assert made.report.unreached.max_um == pytest.approx(30.0, abs=0.15)
    (finding,) = [one for one in made.findings if one.code == VerificationCode.END_NOT_REACHED]
    assert finding.measured == pytest.approx(30.0, abs=0.15)
    assert finding.where.startswith("move 5,")
    whole = judged(decoded, decoded).report.unreached
    assert whole is not None
    assert (whole.moves, whole.max_um) == (0, 0.0)


def test_play_of_z_makes_cuts_shallower() -> None:
    b = cut(ToolpathBuilder(), 1.0, 1.0).line(2.0, 1.0, feed=0.8).rapid(z=0.2)
    for play, depth in ((0.0, 0.0), (0.004, 4.0)):
        machine = pic_mmh(f"axes.z.backlash_mm={play}")
        found = verify(b.finish(), machine).report.error_um.depth_max
        assert found == pytest.approx(depth, abs=0.15)


def test_the_line_adds_its_time() -> None:
    toolpath = two_squares()
    free = verify(toolpath, pic_mmh(), options=VerifyOptions(line_bytes=960)).report
    assert free.time_split_s.link == 0.0
    slow = pic_mmh("link.baud=9600")
    sent = verify(toolpath, slow, options=VerifyOptions(line_bytes=960)).report
    assert sent.time_split_s.link == pytest.approx(1.0)
    assert sent.time_s == pytest.approx(free.time_s + 1.0)
    assert any("9600 baud" in words for words in sent.assumptions)
    streamed = pic_mmh("link.baud=9600", "link.wait=streamed")
    meanwhile = verify(toolpath, streamed, options=VerifyOptions(line_bytes=960)).report
    assert meanwhile.time_s == free.time_s


def test_compensation_is_a_part_of_the_time() -> None:
    found = verify(two_squares(), pic_mmh()).report
    steps = 1457 * found.reversals.x + 1271 * found.reversals.y  # 204 and 178 µm by 0.14 µm
    split = found.time_split_s
    assert 0.0 < split.compensation < split.cutting + split.air
    # In the air at 166 Hz, in the cut at 95 Hz.
    assert steps / 166.0 <= split.compensation <= steps / 95.0


def test_a_circle_cut_both_ways_round() -> None:
    b = circle(ToolpathBuilder(), 4.0, 4.0, 2.0)
    toolpath = circle(b, 4.0, 4.0, 2.0, ccw=False).finish()
    one_way = verify(circle(ToolpathBuilder(), 4.0, 4.0, 2.0).finish(), pic_mmh()).report
    assert one_way.bidirectional == ()
    found = verify(toolpath, pic_mmh()).report
    (both,) = found.bidirectional
    assert both.centre_mm == pytest.approx((4.0, 4.0), abs=1e-4)
    assert both.Gb_um is not None
    assert both.Gb_um >= max(one.G_um or 0.0 for one in found.circles) - 0.2
    x, y = found.circles[0].B_um
    # What compensation adds beyond the play: 192.5 − 204 and 168.5 − 178 µm.
    assert (x, y) == pytest.approx((-11.5, -9.5), rel=0.1)


def test_a_tool_gives_a_shape() -> None:
    toolpath = circle(ToolpathBuilder(), 4.0, 4.0, 2.0).finish()
    options = VerifyOptions(tool_diameter_mm=0.4)
    found = verify(toolpath, pic_mmh(), wanted=toolpath, options=options).report
    assert found.shape is not None
    assert found.shape.overcut_um == pytest.approx(found.error_um.total.max, abs=2.0)
    assert "overcut" in found.to_text()
    assert verify(toolpath, pic_mmh(), wanted=toolpath).report.shape is None
