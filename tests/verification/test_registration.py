"""Programs that others made, against their drawings: place, tool and sides are found.

The other CAM is shapely: chords of buffered polygons, which share nothing with our offsets. What
is known of such a program must not change when it is moved, reversed, put into another order,
cut in passes or led into.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.findings import Code, Severity
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import sample, signed_area
from camtool.importers.read import read_drawing
from camtool.pipeline import Judging, verify_program
from camtool.planning.job import Job, Operation, Tool
from camtool.records import replace
from camtool.run import Run
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.findings import VerificationCode
from camtool.verification.registration import Registration, register
from tests.strategies import examples

SAMPLES = Path(__file__).parents[2] / "samples"
CHORD_MM = 0.004
OUTLINE = 6
"""The outline is cut last; the paths before it are what is inside."""


@cache
def mount() -> Drawing:
    return read_drawing(SAMPLES / "mount.dxf")


@dataclass(frozen=True)
class Made:
    """Choices with which a program is made of the drawing: tool, place of its zero, depths of its
    passes, contours (all) and their order, reversed or not, and a lead from outside."""

    diameter: float = 3.0
    shift: tuple[float, float] = (0.0, 0.0)
    passes: tuple[float, ...] = (-1.5, -3.0)
    order: tuple[int, ...] = (0, 1, 2, 3, 4, 5, 6)
    backwards: bool = False
    roll: int = 0
    lead: float = 0.0
    matrix: tuple[tuple[float, float], tuple[float, float]] = ((1.0, 0.0), (0.0, 1.0))

    def rings(self) -> list[Floats]:
        paths = sorted(mount().paths, key=lambda path: abs(signed_area(path)))
        made = []
        for k in self.order:
            side = 1.0 if k == OUTLINE else -1.0
            shape = Polygon(sample(paths[k], 0.05)).buffer(
                0.5 * side * self.diameter, quad_segs=64
            )
            ring = np.array(shape.simplify(CHORD_MM).exterior.coords)[:-1]
            ring = np.roll(ring, self.roll, axis=0)
            ring = np.concatenate([ring, ring[:1]])
            ring = ring[::-1] if self.backwards else ring
            made.append(ring @ np.array(self.matrix).T + self.shift)
        return made

    def text(self) -> str:
        lines = ["G21 G90 G94", "G0 Z5", "M3 S10000"]
        for ring in self.rings():
            x, y = ring[0]
            way = ring[0] - ring[:-1].mean(axis=0)
            lead = ring[0] + self.lead * way / np.hypot(*way)
            lines += [f"G0 X{lead[0]:.4f} Y{lead[1]:.4f}"]
            for z in self.passes:
                lines += [f"G1 Z{z:g} F150", f"G1 X{x:.4f} Y{y:.4f} F400"]
                lines += [f"X{a:.4f} Y{b:.4f}" for a, b in ring[1:]]
            lines += ["G0 Z5"]
        return "\n".join([*lines, "M5", "M2", ""])


def decoded(text: str, name: str = "grbl") -> Toolpath:
    target = load_target(name)
    return target.target.read(text.encode(), target.machine)


def found(made: Made, *, align: bool = True, **more: Any) -> Registration:
    limits: dict[str, Any] = {"tool_diameter_mm": None, "limit_mm": 0.02, "flat_cuts": False}
    return register(decoded(made.text()), mount(), align=align, **(limits | more))


def codes(registration: Registration) -> dict[Code, Severity]:
    return {
        each.code: each.severity for each in registration.findings if isinstance(each.code, Code)
    }


def judged(text: str, name: str = "grbl", **more: Any) -> Run:
    return verify_program(
        text.encode(),
        load_target(name),
        source="x.nc",
        drawing=mount(),
        judging=Judging(found=True, **more),
    )


def assert_all_found(result: Registration, made: Made) -> None:
    report = result.report
    assert (report.outside, report.inside, report.on_line, report.not_cut) == (1, 6, 0, 0)
    assert report.tools[0].diameter_mm == pytest.approx(made.diameter, abs=0.01)
    assert np.allclose(report.shift_mm, made.shift, atol=0.005)
    assert report.off_max_um is not None
    assert report.off_max_um < 15.0


def test_place_tool_and_sides_are_found() -> None:
    made = Made(shift=(-31.25, 12.5))
    result = found(made)
    assert_all_found(result, made)
    assert result.report.followed == pytest.approx(1.0)
    assert codes(result) == {VerificationCode.DRAWING_PLACE: Severity.INFO}


@examples(8)
@given(
    st.builds(
        Made,
        diameter=st.floats(0.5, 4.5),
        shift=st.tuples(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0)),
        passes=st.sampled_from([(-1.0,), (-1.0, -2.0, -3.0)]),
        order=st.permutations(range(7)).map(tuple),
        backwards=st.booleans(),
        roll=st.integers(0, 40),
    )
)
def test_it_does_not_matter_how_the_program_goes(made: Made) -> None:
    assert_all_found(found(made), made)


def test_a_program_that_lies_elsewhere_is_not_guessed_at() -> None:
    result = found(Made(shift=(10.0, 3.5)), align=False)
    assert codes(result) == {VerificationCode.DRAWING_PLACE: Severity.ERROR}
    assert "X10.000 Y3.500" in result.findings[0].message.replace("10.001", "10.000")
    assert "--align" in result.findings[0].message
    assert result.report.followed == 0.0
    assert result.wanted.drawn is None


@pytest.mark.parametrize(
    ("matrix", "flag"),
    [
        (((1.0 / 25.4, 0.0), (0.0, 1.0 / 25.4)), "--scale 0.03937"),
        (((25.4, 0.0), (0.0, 25.4)), "--scale 25.4"),
        (((0.9375, 0.0), (0.0, 0.9375)), "--scale 0.9375"),
        (((1000.0, 0.0), (0.0, 1000.0)), "--scale 1000"),
        (((0.0, -1.0), (1.0, 0.0)), "--rotate 90"),
        (((-1.0, 0.0), (0.0, 1.0)), "--mirror x"),
    ],
)
def test_scale_mirror_and_turn_are_named(
    matrix: tuple[tuple[float, float], tuple[float, float]], flag: str
) -> None:
    result = found(Made(passes=(-3.0,), order=(0, 4, 5, 6), matrix=matrix, shift=(2.0, 5.0)))
    assert codes(result) == {VerificationCode.DRAWING_PLACE: Severity.ERROR}
    assert flag in result.findings[0].message


def test_a_circle_within_a_larger_one_is_no_other_scale(tmp_path: Path) -> None:
    """Two quarters of one, elsewhere: in one 25.4 times as large they keep about one distance."""
    (tmp_path / "circle.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 300"><circle cx="0" cy="100" '
        'r="40" fill="none" stroke="black"/></svg>',
        encoding="utf-8",
    )
    lines = []
    for begin in (0.0, 90.0):
        angles = np.radians(np.linspace(begin, begin - 90.0, 167))
        points = 10.583 * np.column_stack([np.cos(angles), np.sin(angles)]) + [12.5, 45.667]
        lines += [f"G0 X{points[0, 0]:.3f} Y{points[0, 1]:.3f}", "G1 Z-1 F100"]
        lines += [f"G1 X{x:.3f} Y{y:.3f} F600" for x, y in points[1:]] + ["G0 Z3"]
    result = register(
        decoded("\n".join([*lines, ""])), read_drawing(tmp_path / "circle.svg"),
        tool_diameter_mm=None, align=True, limit_mm=0.02, flat_cuts=False,
    )  # fmt: skip
    assert not any("--scale" in finding.message for finding in result.findings)


def test_another_drawing_is_followed_nowhere() -> None:
    other = read_drawing(SAMPLES / "star.csv")
    result = register(
        decoded(Made().text()), other, tool_diameter_mm=None, align=True,
        limit_mm=0.02, flat_cuts=False,
    )  # fmt: skip
    assert codes(result) == {VerificationCode.DRAWING_PLACE: Severity.ERROR}


def test_a_part_that_fits_in_several_places_is_ambiguous() -> None:
    """A program that cuts one of four equal holes fits in four places."""
    result = found(Made(order=(0,), shift=(1.0, 1.0)))
    assert codes(result)[VerificationCode.DRAWING_PLACE] == Severity.ERROR
    assert "as well at" in result.findings[0].message
    assert "--origin" in result.findings[0].message


def test_what_is_not_cut_is_named() -> None:
    result = found(Made(order=(0, 1, 2, 4, 6)))
    missing = [each for each in result.findings if each.code == VerificationCode.NOT_CUT]
    assert len(missing) == 2
    assert result.report.not_cut == 2


def test_a_part_of_a_contour_that_is_not_cut_is_named_with_its_length() -> None:
    ring = Made(order=(OUTLINE,)).rings()[0]
    lines = ["G21 G90 G94", "G0 Z5", f"G0 X{ring[0, 0]:.4f} Y{ring[0, 1]:.4f}", "G1 Z-1 F100"]
    kept = ring[: len(ring) * 3 // 4]
    lines += [f"G1 X{x:.4f} Y{y:.4f} F300" for x, y in kept[1:]]
    result = register(
        decoded("\n".join([*lines, "G0 Z5", "M2", ""])), mount(), tool_diameter_mm=None,
        align=False, limit_mm=0.02, flat_cuts=False,
    )  # fmt: skip
    left = np.hypot(*np.diff(ring[len(kept) - 1 :], axis=0).T).sum()
    parts = [each for each in result.findings if "of the path" in each.message]
    assert len(parts) == 1
    assert parts[0].measured == pytest.approx(left, abs=0.5)


def test_leads_are_counted_and_one_into_the_part_is_a_warning() -> None:
    """From without a lead comes through what is waste round the outline, and what is part round a
    hole."""
    outside = found(Made(order=(OUTLINE,), lead=3.0))
    assert VerificationCode.CUT_INTO_PART not in codes(outside)
    inside = found(Made(order=(0, OUTLINE), lead=3.0), align=False)
    warned = [each for each in inside.findings if each.code == VerificationCode.CUT_INTO_PART]
    assert warned
    assert warned[0].severity == Severity.WARNING
    assert warned[0].measured == pytest.approx(3.0, abs=0.05)
    # The second pass begins where the first one ends.
    assert inside.report.beside_mm == pytest.approx(2 * 3.0, abs=0.1)


def test_a_tool_that_is_given_is_what_the_path_is_measured_for() -> None:
    result = found(Made(), align=False, tool_diameter_mm=2.9)
    assert codes(result)[VerificationCode.TOOL_FOUND] == Severity.WARNING
    assert result.report.tools[0].given
    assert result.report.off_max_um == pytest.approx(50.0, abs=10.0)
    assert codes(result)[VerificationCode.OFF_DRAWING] == Severity.WARNING


def test_two_distances_from_the_drawing_are_ambiguous() -> None:
    """Windows for one tool, the outline for another, and no word of a change of tools."""
    one, other = Made(order=(4, 5)), Made(order=(OUTLINE,), diameter=5.0)
    text = one.text().replace("M2\n", "") + other.text()
    result = register(
        decoded(text), mount(), tool_diameter_mm=None, align=False, limit_mm=0.02, flat_cuts=False
    )
    assert codes(result)[VerificationCode.TOOL_FOUND] == Severity.ERROR
    assert any("--tool-diameter" in each.message for each in result.findings)


def test_each_tool_of_a_program_has_its_own_diameter() -> None:
    one, other = Made(order=(0, 1, 2, 3, 4, 5), diameter=2.0), Made(order=(6,), diameter=5.0)
    text = "T1 M6\n" + one.text().replace("M2\n", "") + "T2 M6\n" + other.text()
    result = register(
        decoded(text, "linuxcnc"), mount(), tool_diameter_mm=None, align=False,
        limit_mm=0.02, flat_cuts=False,
    )  # fmt: skip
    assert [(each.number, round(each.diameter_mm, 2)) for each in result.report.tools] == [
        (1, 2.0),
        (2, 5.0),
    ]
    assert result.diameter_mm is None
    assert (result.report.outside, result.report.inside) == (1, 6)


def test_holes_are_drilled_in_the_middle_of_circles() -> None:
    text = Made(order=(4, 5, 6)).text().replace("M5\n", "")
    for path in mount().paths:
        if len(path.vertices) == 2:
            x, y = path.vertices[:, :2].mean(axis=0)
            text = text.replace("M2\n", f"G0 X{x:.4f} Y{y:.4f}\nG1 Z-3 F100\nG0 Z5\nM2\n")
    result = register(
        decoded(text), mount(), tool_diameter_mm=None, align=False, limit_mm=0.02, flat_cuts=False
    )
    assert (result.report.drilled, result.report.not_cut) == (4, 0)


def test_a_laser_runs_on_the_lines_without_heights() -> None:
    lines = ["G21 G90 G94", "M4 S500"]
    for path in mount().paths:
        points = sample(path, 0.1) + np.array([7.0, 8.0])
        points = np.concatenate([points, points[:1]])
        lines += [f"G0 X{points[0, 0]:.4f} Y{points[0, 1]:.4f}"]
        lines += [f"G1 X{x:.4f} Y{y:.4f} F1000" for x, y in points[1:]]
    run = judged("\n".join([*lines, "M5", "M2", ""]), align=True)
    assert run.report is not None
    assert run.report.found is not None
    assert run.report.found.on_line == 7
    assert run.report.found.tools[0].diameter_mm == 0.0
    assert np.allclose(run.report.found.shift_mm, (7.0, 8.0), atol=1e-3)


def test_a_program_that_cuts_nothing() -> None:
    result = register(
        decoded("G21 G90\nG0 X1 Y1\nM2\n"), mount(), tool_diameter_mm=None, align=True,
        limit_mm=0.02, flat_cuts=False,
    )  # fmt: skip
    assert codes(result) == {VerificationCode.DRAWING_PLACE: Severity.ERROR}


def test_a_drawing_of_points_alone_has_nothing_to_follow(tmp_path: Path) -> None:
    sheet = ezdxf.new()
    for x in (0.0, 10.0):
        sheet.modelspace().add_point((x, 5.0))
    sheet.saveas(tmp_path / "points.dxf")
    path = decoded("G1 X9 Z-1 F100")
    drawing = read_drawing(tmp_path / "points.dxf")
    with pytest.raises(DrawingError, match="no line that a program could follow"):
        register(path, drawing, tool_diameter_mm=None, align=True, limit_mm=0.1, flat_cuts=True)


def test_moves_that_go_on_beyond_their_line_are_left_as_they_are(tmp_path: Path) -> None:
    file = tmp_path / "line.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="9mm" viewBox="0 0 200 9">'
        '<path d="M 0 5 H 100" fill="none" stroke="black"/></svg>',
        encoding="utf-8",
    )
    path = decoded("G0 X-20 Y4\nG1 Z-1 F100\nX120 F600\nG0 Z5\n")
    result = register(
        path, read_drawing(file), tool_diameter_mm=None, align=False, limit_mm=0.1, flat_cuts=True
    )
    assert result.wanted.end.tolist() == path.end.tolist()
    assert result.report.followed == 0.0
    assert codes(result)[VerificationCode.DRAWING_PLACE] == Severity.ERROR


def test_the_wanted_path_is_the_drawing_s() -> None:
    """Each wanted point of what follows lies exactly a radius from the nearest line."""
    result = found(Made(shift=(5.0, 5.0)))
    wanted = result.wanted
    named = np.array([wanted.text(row) != "" for row in range(len(wanted))])
    assert named.sum() > 30
    shift, radius = np.array(result.shift_mm), 0.5 * result.report.tools[0].diameter_mm
    segments_of = [Polygon(sample(path, 0.01)).exterior for path in mount().paths]
    from shapely import Point

    for row in np.flatnonzero(named & wanted.is_feed)[::5].tolist():
        point = Point(*(wanted.end[row, :2] - shift))
        near = min(each.distance(point) for each in segments_of)
        assert near == pytest.approx(radius, abs=1e-4)


def test_the_wanted_path_begins_where_its_rapids_and_plunges_end() -> None:
    """Moves before a contour come to its first wanted point, though the program lies beside it."""
    made = Made(shift=(5.0, 5.0))
    result = found(made)
    wanted, radius = result.wanted, 0.5 * result.report.tools[0].diameter_mm
    named = np.array([wanted.text(row) != "" for row in range(len(wanted))])
    begins = np.flatnonzero(named[1:] & ~named[:-1]) + 1
    starts = wanted.starts[begins, :2]
    assert len(begins) > 3
    program = decoded(made.text())
    beside = [np.hypot(*(program.end[:, :2] - start).T).min() for start in starts]
    assert max(beside) > 1e-4
    lines = [Polygon(sample(path, 0.001)).exterior for path in mount().paths]
    for start in shapely.points(starts - np.array(result.shift_mm)):
        near = min(each.distance(start) for each in lines)
        assert near == pytest.approx(radius, abs=2e-6)
    # They come straight down there, and places on the way are left as they are.
    assert (wanted.end[begins - 2, :2] == starts).all()
    path = decoded(re.sub(r"(?m)^G0 X", "G0 X55.5 Y66.25\nG0 X", made.text()))
    limits = {"tool_diameter_mm": None, "limit_mm": 0.02, "flat_cuts": False}
    on_the_way = register(path, mount(), align=True, **limits).wanted
    ways = [(each.end[:, :2] == (55.5, 66.25)).all(axis=1).sum() for each in (path, on_the_way)]
    assert ways[0] == ways[1] > 3


def test_the_report_has_the_distance_from_the_drawing() -> None:
    run = judged(Made(shift=(5.0, -5.0)).text(), align=True)
    report = run.report
    assert report is not None
    assert report.against == "drawing"
    assert report.found is not None
    assert report.error_um.total.max is not None
    assert report.error_um.total.max >= (report.found.off_max_um or 0.0) - 2.0
    assert report.shape is not None
    assert {round(each.nominal_mm, 3) for each in report.dimensions} >= {80.0, 50.0, 5.0}
    assert "as found" in report.to_text()
    assert not run.failed


def test_a_place_and_a_tool_of_the_job_are_taken() -> None:
    job = Job(operations=(Operation(tool=Tool(diameter_mm=3.0)),))
    placed = replace(job, placement=replace(job.placement, origin=(-5.0, -5.0)))
    run = verify_program(
        Made(shift=(5.0, 5.0)).text().encode(), load_target("grbl"), source="x.nc",
        drawing=mount(), job=placed, judging=Judging(found=True),
    )  # fmt: skip
    assert run.report is not None
    assert run.report.found is not None
    assert run.report.found.tools[0].given
    assert run.report.found.shift_mm == (0.0, 0.0)
    assert run.report.found.not_cut == 0


def names(values: Sequence[Kind]) -> list[str]:
    return [each.name for each in values]


def test_a_full_turn_stays_one_in_the_wanted_path() -> None:
    """Helices of whole turns, whose ends rounding must not part from their starts."""
    lines = ["G21 G90 G94 G17", "G0 Z5"]
    for path in mount().paths:
        if len(path.vertices) == 2:
            x, y = path.vertices[:, :2].mean(axis=0)
            lines += [f"G0 X{x + 1:.3f} Y{y:.3f}", "G1 Z0 F100"]
            lines += [f"G3 X{x + 1:.3f} Y{y:.3f} Z-{k * 0.3:.1f} I-1 F300" for k in range(1, 9)]
            lines += ["G0 Z5"]
    text = "\n".join([*lines, "M2", ""])
    run = judged(text)
    assert run.wanted is not None
    assert names([Kind(k) for k in run.wanted.kind]).count("ARC_CCW") == 4 * 8
    assert run.report is not None
    assert run.report.error_um.total.max is not None
    assert run.report.error_um.total.max < 10.0
