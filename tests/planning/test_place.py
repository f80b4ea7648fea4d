"""The drawing in the work frame: where everything comes to lie."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.geometry.drawing import Branch, Drawing, Gap, Healing, Mark, SelfCrossing
from camtool.geometry.measure import extents, path_lengths, signed_areas
from camtool.geometry.polylines import Polyline, Segments
from camtool.planning import place as module
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, Operation, Placement, job_of
from camtool.planning.place import collapse_findings, place, rows_taken
from camtool.records import replace
from tests.drawings import drawing_of
from tests.strategies import polylines


def _circle(x: float, y: float, radius: float) -> Polyline:
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), closed=True)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    return Polyline(np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0.0]]), True)


def _line(*numbers: float) -> Polyline:
    return Polyline(np.array([[*numbers[:2], 0.0], [*numbers[2:], 0.0]]))


def _mark(x: float, y: float, layer: str = "0") -> Mark:
    return Mark((x, y), layer, "", "POINT")


def test_the_drawing_itself_when_nothing_changes() -> None:
    made = drawing_of([rectangle(0, 0, 4, 3)])
    for same in ({}, {"origin": "drawing"}, {"origin": "lower-left"}, {"origin": (0.0, 0.0)}):
        assert place(made, job_of(**same)) is made
    assert place(made, job_of(rotate_rad=2.0 * math.pi, fit_mm=(4.0, 9.0))) is made
    assert place(made, job_of(origin="centre")) is not made


@pytest.mark.parametrize(
    ("origin", "shift"),
    [
        ("drawing", (0.0, 0.0)),
        ("lower-left", (-3.0, -5.0)),
        ("centre", (-5.0, -7.0)),
        ((1.0, -2.5), (-1.0, 2.5)),
    ],
)
def test_origins_take_the_chosen_paths(
    origin: str | tuple[float, float], shift: tuple[float, float]
) -> None:
    made = drawing_of([_circle(5, 7, 2), rectangle(-50, -50, 50, 50)], ["CUT", "FRAME"])
    placed = place(made, job_of(origin=origin, layers=("CUT",)))
    expected = made.paths.vertices + np.array([*shift, 0.0])
    np.testing.assert_allclose(placed.paths.vertices, expected, atol=1e-14)


def test_the_box_is_that_of_all_operations_and_of_the_marks_that_are_drilled() -> None:
    made = replace(
        drawing_of(
            [_circle(5, 7, 2), rectangle(-9, 0, 1, 1), rectangle(-50, 0, 1, 1)], ["A", "B", "C"]
        ),
        colours=("", "#ff0000", ""),
        marks=(_mark(0, -4, "HOLES"), _mark(0, -40, "A")),
    )
    first = Operation(layers=("A",))
    for operations, corner in (
        ((first,), (3, 5)),
        ((first, Operation(colours=("#ff*",))), (-9, 0)),
        ((first, Operation("drill", layers=("HOLES",))), (0, -4)),
        ((first, Operation("engrave", layers=("HOLES",))), (3, 5)),
        ((Operation("drill", layers=("HOLES",)),), (0, -4)),
        ((Operation(layers=("NONE",)),), (0, 0)),
    ):
        job = Job(operations, Placement("lower-left"))
        (x, _), (y, _) = extents(place(made, job).paths).tolist()
        assert (x, y) == (-50.0 - corner[0], 0.0 - corner[1])


def test_what_is_taken() -> None:
    made = replace(drawing_of([_circle(0, 0, 1)] * 3, ["A", "B", "a"]), marks=(_mark(0, 0, "A"),))
    assert rows_taken(made, job_of(layers=("a",))) == ([0, 2], [])
    assert rows_taken(made, job_of(kind="drill", layers=("a",))) == ([0, 2], [0])


def test_an_empty_drawing_stays_empty() -> None:
    for origin in ("drawing", "lower-left", "centre"):
        placed = place(drawing_of([]), job_of(layers=("CUT",), origin=origin, mirror="x"))
        assert len(placed.paths) == 0


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"mirror": "x"}, [[-1, 2, -1.0], [-3, 2, -0.5]]),
        ({"mirror": "y"}, [[1, -2, -1.0], [3, -2, -0.5]]),
        ({"rotate_rad": math.radians(90)}, [[-2, 1, 1.0], [-2, 3, 0.5]]),
        ({"rotate_rad": math.radians(-90)}, [[2, -1, 1.0], [2, -3, 0.5]]),
        ({"rotate_rad": math.radians(180)}, [[-1, -2, 1.0], [-3, -2, 0.5]]),
        ({"scale": 2.0}, [[2, 4, 1.0], [6, 4, 0.5]]),
        # Mirrored first, then turned; the other way round it would be (2, 1).
        ({"mirror": "x", "rotate_rad": math.radians(90)}, [[-2, -1, -1.0], [-2, -3, -0.5]]),
    ],
)
def test_quarter_turns_and_mirrors_are_exact(
    settings: dict[str, Any], expected: list[list[float]]
) -> None:
    made = drawing_of([Polyline(np.array([[1, 2, 1.0], [3, 2, 0.5]]), True)])
    assert np.array_equal(place(made, job_of(**settings)).paths.vertices, np.array(expected))


@given(
    polylines(),
    st.sampled_from([None, "x", "y"]),
    st.floats(-7.0, 7.0),
    st.floats(0.1, 10.0),
    st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0)),
)
def test_every_shape_stays_similar(
    path: Polyline, mirror: str | None, angle: float, scale: float, origin: tuple[float, float]
) -> None:
    made = drawing_of([path])
    job = job_of(mirror=mirror, rotate_rad=angle, scale=scale, origin=origin)
    placed = place(made, job).paths
    assert placed.closed.tolist() == made.paths.closed.tolist()
    assert path_lengths(placed) == pytest.approx(scale * path_lengths(made.paths))
    handed = -1.0 if mirror else 1.0
    areas = handed * scale**2 * signed_areas(made.paths)
    assert signed_areas(placed) == pytest.approx(areas, rel=1e-6, abs=1e-6)
    # The centres of arcs come to lie where the same map, point by point, takes them.
    before, after = Segments.of(made.paths), Segments.of(placed)
    near = before.radius < 1e4
    flipped = before.centre[near] * np.array(
        [-1.0 if mirror == "x" else 1.0, -1.0 if mirror == "y" else 1.0]
    )
    turned = scale * (flipped[:, 0] + 1j * flipped[:, 1]) * np.exp(1j * angle) - complex(*origin)
    expected = np.column_stack([turned.real, turned.imag])
    np.testing.assert_allclose(after.centre[near], expected, atol=1e-5)


@pytest.mark.parametrize(
    ("fit", "scale"), [((8.0, 8.0), 2.0), ((8.0, 3.0), 1.0), ((8.0, 0.0), 2.0), ((0.0, 1.5), 0.5)]
)
def test_fit_takes_the_side_that_binds(fit: tuple[float, float], scale: float) -> None:
    made = drawing_of([rectangle(1, 1, 5, 4), rectangle(-9, -9, 9, 9)], ["CUT", "FRAME"])
    placed = place(made, job_of(fit_mm=fit, layers=("CUT",)))
    np.testing.assert_allclose(placed.paths.vertices[:, :2], scale * made.paths.vertices[:, :2])


def test_fit_takes_the_turned_drawing_and_one_copy() -> None:
    made = drawing_of([rectangle(0, 0, 4, 2)])
    job = job_of(
        fit_mm=(8.0, 0.0),
        rotate_rad=math.radians(90),
        copies=(2, 1),
        pitch_mm=(9.0, 0.0),
        origin="lower-left",
    )
    assert extents(place(made, job).paths).tolist() == [[0.0, 17.0], [0.0, 16.0]]


def test_a_flat_drawing_fits_by_the_side_that_it_has() -> None:
    made = drawing_of([_line(0, 0, 4, 0)])
    assert place(made, job_of(fit_mm=(8.0, 1.0))).paths.vertices[1, 0] == 8.0
    with pytest.raises(OptionError, match="4 by 0 mm") as caught:
        place(made, job_of(fit_mm=(0.0, 1.0)))
    assert (caught.value.file, caught.value.where) == ("test.dxf", "key fit")
    assert caught.value.mend
    with pytest.raises(OptionError):
        place(drawing_of([]), job_of(fit_mm=(1.0, 1.0)))


def test_copies_row_by_row_about_one_origin() -> None:
    made = replace(
        drawing_of([rectangle(0, 0, 2, 1), _circle(1, 0.5, 0.25)], ["A", "B"]),
        colours=("#ff0000", ""),
        line_types=("DASHED", ""),
        marks=(_mark(1, 1),),
    )
    placed = place(made, job_of(copies=(2, 3), pitch_mm=(5.0, -4.0), origin="lower-left"))
    assert len(placed.paths) == 12
    corners = [path.vertices[0, :2].tolist() for path in placed.paths][::2]
    assert corners == [[0, 8], [5, 8], [0, 4], [5, 4], [0, 0], [5, 0]]
    assert placed.layers == ("A", "B") * 6
    assert placed.colours == ("#ff0000", "") * 6
    assert placed.line_types == ("DASHED", "") * 6
    assert placed.sources[:3] == ("PATH 0", "PATH 1", "PATH 0 copy 2")
    assert placed.sources[-1] == "PATH 1 copy 6"
    assert placed.paths.closed.all()
    assert [mark.at_mm for mark in placed.marks] == [
        (1, 9), (6, 9), (1, 5), (6, 5), (1, 1), (6, 1)
    ]  # fmt: skip
    assert placed.marks[1].source == "POINT copy 2"
    assert extents(placed.paths).tolist() == [[0.0, 7.0], [0.0, 9.0]]


def test_the_centre_of_copies_is_that_of_all() -> None:
    made = drawing_of([rectangle(0, 0, 2, 1)])
    placed = place(made, job_of(copies=(3, 1), pitch_mm=(4.0, 0.0), origin="centre"))
    assert extents(placed.paths).tolist() == [[-5.0, 5.0], [-0.5, 0.5]]


def test_errors_gaps_and_doubtful_places_come_along() -> None:
    made: Drawing = replace(
        drawing_of([rectangle(0, 0, 2, 1), _line(0, 0, 1, 1)]),
        off_mm=np.tile([1e-3, 5e-4], (6, 1)),
        gaps=(Gap((1.0, 2.0), 0.5, "0"),),
        closed_gaps=(Gap((3.0, 4.0), 0.01, "0"),),
        healing=Healing(
            duplicates=3,
            branches=(Branch((1.0, 0.0), 3, "0"),),
            crossings=(SelfCrossing((0.0, 1.0), 1, "0"),),
        ),
    )
    placed = place(made, job_of(scale=2.0, copies=(2, 1), pitch_mm=(10.0, 0.0)))
    assert placed.fit.max_mm == 2e-3
    assert placed.fit.rms_mm == pytest.approx(1e-3)
    assert len(placed.off_mm) == 12
    assert placed.gaps == (Gap((2.0, 4.0), 1.0, "0"), Gap((12.0, 4.0), 1.0, "0"))
    assert placed.closed_gaps[1] == Gap((16.0, 8.0), 0.02, "0")
    assert placed.healing.duplicates == 3
    assert placed.healing.branches[1] == Branch((12.0, 0.0), 3, "0")
    assert placed.healing.crossings == (
        SelfCrossing((0.0, 2.0), 1, "0"),
        SelfCrossing((10.0, 2.0), 3, "0"),
    )


def test_a_scale_that_leaves_no_shape_is_refused() -> None:
    with pytest.raises(OptionError, match="path 0, vertex 0") as caught:
        place(drawing_of([rectangle(3, 3, 3.2, 3.2)]), job_of(scale=1e-6))
    assert caught.value.where == "key scale"
    assert caught.value.mend


@pytest.mark.parametrize("scale", [1e-9, 1e308, math.nan, math.inf])
def test_a_scale_that_nobody_means_is_refused(scale: float) -> None:
    with pytest.raises(OptionError, match="scale"):
        job_of(scale=scale)


@pytest.mark.parametrize(
    ("settings", "where"),
    [
        ({"scale": 2e5}, "key scale"),
        ({"copies": (2, 1), "pitch_mm": (99_999.5, 1.0)}, "key pitch"),
        ({"origin": (-2e6, 0.0)}, "key origin"),
    ],
)
def test_what_is_larger_than_any_machine_is_refused_by_what_makes_it_so(
    settings: dict[str, Any], where: str
) -> None:
    with pytest.raises(OptionError, match="what is cut") as caught:
        place(drawing_of([rectangle(0, 0, 1, 1)]), job_of(**settings))
    assert caught.value.where == where


def test_a_drawing_in_wrong_units_is_refused_and_one_far_from_its_zero_is_not() -> None:
    with pytest.raises(OptionError, match="--units"):
        place(drawing_of([rectangle(0, 0, 2e5, 1)]), job_of())
    far = drawing_of([rectangle(5e8, 5e8, 5e8 + 64, 5e8 + 32)])
    with pytest.raises(OptionError, match="lower-left"):
        place(far, job_of())
    placed = place(far, job_of(origin="lower-left"))
    assert placed.paths.vertices[:, :2].max() == 64.0


def test_copies_beyond_all_measure_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_POINTS", 8)
    made = drawing_of([rectangle(0, 0, 1, 1)])
    place(made, job_of(copies=(2, 1), pitch_mm=(2.0, 2.0)))
    with pytest.raises(OptionError, match="12 points") as caught:
        place(made, job_of(copies=(3, 1), pitch_mm=(2.0, 2.0)))
    assert caught.value.where == "key copies"


@pytest.mark.parametrize(
    ("settings", "where"),
    [
        ({"fit_mm": (0.0, 0.0)}, "key fit"),
        ({"fit_mm": (-1.0, 2.0)}, "key fit"),
        ({"fit_mm": (math.nan, 2.0)}, "key fit"),
        ({"fit_mm": (1.0, 2.0), "scale": 2.0}, "key scale"),
        ({"copies": (2, 1)}, "key copies"),
        ({"copies": (2, 2), "pitch_mm": (5.0, 0.0)}, "key copies"),
        ({"pitch_mm": (5.0, 0.0)}, "key pitch"),
        ({"copies": (2, 1), "pitch_mm": (math.inf, 0.0)}, "key pitch"),
        ({"origin": (math.nan, 0.0)}, "key origin"),
    ],
)
def test_placements_that_cannot_be(settings: dict[str, Any], where: str) -> None:
    with pytest.raises(OptionError) as caught:
        Placement(**settings)
    assert caught.value.where == where


def _fine(count: int) -> Polyline:
    """A closed path with a run of `count` points 20 nm apart on its first side."""
    run = [[2e-5 * k, 0.0, 0.0] for k in range(count)]
    return Polyline(np.array([*run, [4.0, 0.0, 0.5], [4.0, 3.0, 0.0], [0.0, 3.0, 0.0]]), True)


@given(
    scale=st.sampled_from([1.0, 0.5, 0.06, 0.05, 0.04, 0.01, 1e-3]),
    count=st.integers(1, 60),
    rotate=st.floats(0.0, 6.0),
)
def test_points_that_the_scale_brings_together_are_one(
    scale: float, count: int, rotate: float
) -> None:
    made = drawing_of([_fine(count), rectangle(10, 10, 11, 11)])
    job = job_of(scale=scale, rotate_rad=rotate)
    placed = place(made, job)
    assert len(placed.paths) == 2
    assert path_lengths(placed.paths) == pytest.approx(
        scale * path_lengths(made.paths), abs=2.1e-6 * count
    )
    areas = scale**2 * signed_areas(made.paths)
    assert signed_areas(placed.paths) == pytest.approx(areas, abs=1e-5)
    gone = len(made.paths.vertices) - len(placed.paths.vertices)
    told = collapse_findings(made, placed, job)
    assert [each.measured for each in told] == ([float(gone)] if gone else [])
    if scale > 0.05:
        assert gone == 0
    elif scale < 0.05:  # at 0.05 they are one nanometre apart, and rounding decides
        assert count < 2 or gone > 0


def test_paths_that_become_a_point_are_left_out_and_told() -> None:
    speck = rectangle(5, 5, 5.00001, 5.00001)
    made = replace(
        drawing_of([rectangle(0, 0, 2, 1), speck, _line(0, 0, 1, 1)]),
        layers=("A", "B", "C"),
        healing=Healing(
            crossings=(SelfCrossing((5.0, 5.0), 1, "B"), SelfCrossing((0.5, 0.5), 2, "C"))
        ),
    )
    job = job_of(scale=0.05, copies=(2, 1), pitch_mm=(3.0, 0.0))
    placed = place(made, job)
    assert placed.layers == ("A", "C", "A", "C")
    assert placed.sources[2].endswith("copy 2")
    assert [each.path for each in placed.healing.crossings] == [1, 3]
    (told,) = collapse_findings(made, placed, job)
    assert (told.code, told.severity) == (PlanningCode.POINTS_MERGED, Severity.WARNING)
    assert "2 paths" in told.message


def test_what_nothing_is_taken_of_fits_nowhere() -> None:
    """A profile takes no single points: the message says so, and what does."""
    made = replace(drawing_of([]), marks=(_mark(1.0, 2.0), _mark(3.0, 5.0)))
    with pytest.raises(OptionError, match="choose nothing of this drawing") as caught:
        place(made, job_of(fit_mm=(8.0, 6.0)))
    assert caught.value.where == "key fit"
    assert "--kind drill" in caught.value.mend
    placed = place(made, job_of(kind="drill", fit_mm=(8.0, 6.0)))
    assert np.ptp([mark.at_mm for mark in placed.marks], axis=0).tolist() == [4.0, 6.0]
