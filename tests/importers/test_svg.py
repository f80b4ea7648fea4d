"""The SVG reader: places against hand-computed points, curves against svgpathtools' own."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.distance import points_to_segments
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents, path_lengths, signed_areas
from camtool.geometry.polylines import Segments
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from camtool.importers.svg import shapes
from camtool.importers.svg.reader import read
from camtool.importers.svg.shapes import parse_path

SPACES = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
)
PAGE = 'width="100mm" height="100mm" viewBox="0 0 100 100"'
"""One user unit is 1 mm, and (x, y) of the file is (x, 100 − y) of the drawing."""

NEAR_MM = 1e-9
LINE = '<line x1="1" y1="2" x2="4" y2="6"{}/>'


def drawn(body: str, page: str = PAGE, **options: object) -> Drawing:
    text = f"<svg {SPACES} {page}>{body}</svg>"
    return read(text.encode(), "part.svg", ReadOptions(**options))


def path(data: str, more: str = "") -> Drawing:
    return drawn(f'<path id="p" d="{data}" {more}/>')


def corners(drawing: Drawing, index: int = 0) -> np.ndarray:
    """Vertices of one path back in the file's frame: (n, 2)."""
    points = drawing.paths[index].vertices[:, :2]
    return np.column_stack([points[:, 0], 100.0 - points[:, 1]])


def skipped(drawing: Drawing) -> dict[str, int]:
    counts: dict[str, int] = {}
    for item in drawing.skipped:
        counts[item.kind] = counts.get(item.kind, 0) + item.count
    return counts


# ---- transforms


@pytest.mark.parametrize(
    ("transform", "wanted"),
    [
        ("", [(1, 2), (4, 6)]),
        ("translate(10)", [(11, 2), (14, 6)]),
        ("translate(10,-2)", [(11, 0), (14, 4)]),
        ("scale(2)", [(2, 4), (8, 12)]),
        ("scale(2 3)", [(2, 6), (8, 18)]),
        ("rotate(90)", [(-2, 1), (-6, 4)]),
        ("rotate(-90)", [(2, -1), (6, -4)]),
        ("rotate(90 10 20)", [(28, 11), (24, 14)]),
        ("rotate(450,10,20)", [(28, 11), (24, 14)]),
        ("skewX(45)", [(3, 2), (10, 6)]),
        ("skewY(45)", [(1, 3), (4, 10)]),
        ("matrix(1 2 3 4 5 6)", [(12, 16), (27, 38)]),
        ("translate(10 0) scale(2)", [(12, 4), (18, 12)]),
        ("scale(2), translate(10 0)", [(22, 4), (28, 12)]),
        (" scale( 2 )translate( 10 , 0 ) ", [(22, 4), (28, 12)]),
        ("scale(-1 1)", [(-1, 2), (-4, 6)]),
        ("none", [(1, 2), (4, 6)]),
    ],
)
def test_transforms(transform: str, wanted: list[tuple[float, float]]) -> None:
    own = drawn(LINE.format(f' transform="{transform}"'))
    np.testing.assert_allclose(corners(own), wanted, atol=NEAR_MM)
    group = drawn(f'<g transform="{transform}">{LINE.format("")}</g>')
    np.testing.assert_array_equal(group.paths.vertices, own.paths.vertices)


def test_transforms_nest_from_the_outside_in() -> None:
    nested = drawn(
        '<g transform="translate(10 0)"><a><g transform="scale(2)">'
        + LINE.format(' transform="rotate(90)"')
        + "</g></a></g>"
    )
    np.testing.assert_allclose(corners(nested), [(6, 2), (-2, 8)], atol=NEAR_MM)


@pytest.mark.parametrize(
    "transform",
    ["spin(3)", "scale()", "scale(1 2 3)", "rotate(1 2)", "scale(1", "scale(a)", "matrix(1 2)",
     "scale(nan)", "translate(inf)", "scale(1e300)", "scale(1) and more"],
)  # fmt: skip
def test_an_element_with_a_wrong_transform_is_left_out_and_named(transform: str) -> None:
    rest = drawn(LINE.format("") + LINE.format(f' id="bad" transform="{transform}"'))
    assert len(rest.paths) == 1
    (item,) = rest.skipped
    assert item.kind == "line"
    assert item.reason.startswith("cannot be read (line bad: transform ")
    with pytest.raises(DrawingError, match=r"^part\.svg: .*cannot be read \(g at line 1"):
        drawn(f'<g transform="{transform}">{LINE.format("")}</g>')


def test_what_stands_in_a_group_that_cannot_be_read_is_counted() -> None:
    lost = drawn(f'{LINE.format("")}<g transform="scale(a)">{LINE.format("") * 3}<text/></g>')
    assert skipped(lost) == {"g": 1, "line": 3, "text": 1}


def test_transforms_that_multiply_without_bounds_are_refused() -> None:
    body = '<g transform="scale(1e9)">' * 4 + LINE.format("") + "</g>" * 4
    with pytest.raises(DrawingError, match="numbers that are too large"):
        drawn(body)


def test_a_transform_onto_a_line_draws_nothing() -> None:
    both = drawn(LINE.format("") + '<circle r="3" transform="scale(0 1)"/>')
    assert skipped(both) == {"circle": 1}


# ---- shapes


@pytest.mark.parametrize(
    "transform",
    ["", "scale(-1 1)", "rotate(37)", "translate(3 4) rotate(20) scale(-2 2)",
     "matrix(0 1 1 0 0 0)"],
)  # fmt: skip
def test_a_circle_stays_exact_under_similar_maps(transform: str) -> None:
    circle = drawn(f'<circle cx="30" cy="40" r="5" transform="{transform}"/>')
    scale = 2.0 if "2)" in transform else 1.0
    assert circle.paths.closed.tolist() == [True]
    assert len(circle.paths.vertices) == 2
    np.testing.assert_allclose(np.abs(circle.paths.vertices[:, 2]), 1.0)
    np.testing.assert_allclose(Segments.of(circle.paths).radius, 5.0 * scale)
    assert circle.fit.max_mm == 0.0


def test_a_circle_is_where_it_should_be() -> None:
    circle = drawn('<circle cx="30" cy="40" r="5" transform="scale(-1 1)"/>')
    np.testing.assert_allclose(extents(circle.paths), [[-35, -25], [55, 65]], atol=NEAR_MM)


def test_an_ellipse_is_fitted_within_the_tolerance() -> None:
    ellipse = drawn('<ellipse cx="50" cy="50" rx="20" ry="10"/>', tolerance_mm=0.01)
    assert 0.0 < ellipse.fit.max_mm <= 0.01
    angle = np.linspace(0.0, 2.0 * np.pi, 500)
    true = np.column_stack([50.0 + 20.0 * np.cos(angle), 50.0 + 10.0 * np.sin(angle)])
    distance = points_to_segments(true, Segments.of(ellipse.paths)).min(axis=1)
    assert distance.max() <= 0.01
    np.testing.assert_allclose(abs(signed_areas(ellipse.paths)[0]), 200.0 * np.pi, rtol=1e-3)


def test_a_circle_squeezed_is_that_ellipse() -> None:
    squeezed = drawn('<circle cx="50" cy="100" r="20" transform="scale(1 .5)"/>')
    plain = drawn('<ellipse cx="50" cy="50" rx="20" ry="10"/>')
    np.testing.assert_allclose(squeezed.paths.vertices, plain.paths.vertices, atol=1e-6)


def test_a_rectangle() -> None:
    plain = drawn('<rect x="10" y="20" width="30" height="40"/>')
    assert plain.paths.closed.all()
    np.testing.assert_allclose(corners(plain), [(10, 20), (40, 20), (40, 60), (10, 60)])


@pytest.mark.parametrize("radii", ['rx="5"', 'ry="5"', 'rx="5" ry="5"'])
def test_round_corners_are_exact_arcs(radii: str) -> None:
    round_ = drawn(f'<rect x="10" y="20" width="30" height="40" {radii}/>')
    segments = Segments.of(round_.paths)
    assert len(segments) == 8
    np.testing.assert_allclose(segments.radius[segments.is_arc], 5.0)
    area = abs(signed_areas(round_.paths)[0])
    assert area == pytest.approx(30 * 40 - (4 - math.pi) * 25, rel=1e-12)
    np.testing.assert_allclose(extents(round_.paths), [[10, 40], [40, 80]], atol=NEAR_MM)


def test_corner_radii_end_at_half_the_sides() -> None:
    slot = drawn('<rect x="10" y="20" width="30" height="10" rx="5" ry="50"/>')
    assert abs(signed_areas(slot.paths)[0]) == pytest.approx(300 - (4 - math.pi) * 25, rel=1e-12)
    elliptic = drawn('<rect x="10" y="20" width="30" height="20" rx="10" ry="5"/>')
    area = 600 - (4 - math.pi) * 50
    assert abs(signed_areas(elliptic.paths)[0]) == pytest.approx(area, rel=1e-5)


def test_lines_of_points() -> None:
    both = drawn('<polyline points="1,2 3,4, 5 6"/><polygon points="1 2 3 4 5 7"/>')
    assert both.paths.closed.tolist() == [False, True]
    np.testing.assert_allclose(corners(both), [(1, 2), (3, 4), (5, 6)])
    assert both.sources == ("polyline at line 1", "polygon at line 1")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ('<circle r="-1"/>', "r is negative"),
        ('<rect width="-1" height="3"/>', "width is negative"),
        ('<circle r="NaN"/>', "'NaN' is no length"),
        ('<circle r="inf"/>', "'inf' is no length"),
        ('<circle r="1e999"/>', "is too large"),
        ('<circle r="3vw"/>', "has the unit 'vw'"),
        ('<polyline points="1e13 2 3 4"/>', "is too large"),
        ('<path d="M 0 0 L 1e999 0"/>', "is too large"),
        ('<path d="M 0 0 L 1e12 0 l 1e12 0"/>', "too far away"),
        ('<path d="M 0 0 A 1e-30 1e-30 0 0 1 1 1"/>', "has no shape"),
        ('<line x2="1 2"/>', "is no length"),
    ],
)
def test_shapes_with_wrong_numbers_are_left_out_and_named(body: str, message: str) -> None:
    rest = drawn(LINE.format("") + body + body)
    assert len(rest.paths) == 1
    (item,) = rest.skipped
    assert item.count == 2
    assert item.reason.startswith(f"cannot be read ({item.kind} at line 1: ")
    assert message in item.reason
    (finding,) = rest.findings
    assert finding.code == DrawingCode.ENTITY_SKIPPED


@pytest.mark.parametrize(
    ("points", "message"), [("1 2 3", "one coordinate is missing"), ("1 2 nan 4", "hold 'nan 4'")]
)
def test_points_are_drawn_up_to_their_fault(points: str, message: str) -> None:
    rest = drawn(f'<polyline points="5 5 9 9 {points}"/>')
    np.testing.assert_allclose(corners(rest), [(5, 5), (9, 9), (1, 2)])
    (item,) = rest.skipped
    assert (item.kind, item.count) == ("rest of polyline", 1)
    assert message in item.reason


def test_shapes_without_size_are_counted() -> None:
    rest = drawn(
        LINE.format("") + '<circle/><ellipse rx="3" ry="0"/><rect width="3"/><path/>'
        '<line x1="5" x2="5"/><polygon points="3 3"/><path d="M 3 3"/>'
    )
    assert skipped(rest) == {"circle": 1, "ellipse": 1, "rect": 1, "path": 2, "line": 1,
                             "polygon": 1}  # fmt: skip
    assert len(rest.paths) == 1


# ---- path data


def test_subpaths_and_closing() -> None:
    drawing = path("M10 10h10v10z l-5 -5 m20 20 l1 0 0 1 M80 80 V90 H70 L80 80")
    assert len(drawing.paths) == 4
    assert drawing.paths.closed.tolist() == [True, False, False, True]
    np.testing.assert_allclose(corners(drawing, 0), [(10, 10), (20, 10), (20, 20)])
    np.testing.assert_allclose(corners(drawing, 1), [(10, 10), (5, 5)])
    np.testing.assert_allclose(corners(drawing, 2), [(25, 25), (26, 25), (26, 26)])
    np.testing.assert_allclose(corners(drawing, 3), [(80, 80), (80, 90), (70, 90)])


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("M10-20.5.5.5", "M 10 -20.5 L 0.5 0.5"),
        ("M0 0a5 5 0 0110 0", "M 0 0 a 5 5 0 0 1 10 0"),
        ("M0 0a5 5 0 1 110 0a5 5 0 0020 0", "M 0 0 a 5 5 0 1 1 10 0 a 5 5 0 0 0 20 0"),
        ("M0 0 10 10 20 0", "M 0 0 L 10 10 L 20 0"),
        ("m5 5 10 10 20 0", "M 5 5 L 15 15 L 35 15"),
        ("M1e1,2E0L.1e2-3.", "M 10 2 L 10 -3"),
        ("M0 0C1 1 2 1 3 0S5 1 6 0", "M 0 0 C 1 1 2 1 3 0 C 4 -1 5 1 6 0"),
        ("M0 0Q1 1 2 0T4 0t2 0", "M 0 0 Q 1 1 2 0 Q 3 -1 4 0 Q 5 1 6 0"),
        ("M0 0L9 9S5 1 6 0", "M 0 0 L 9 9 C 9 9 5 1 6 0"),
        ("M0 0L9 9T6 0", "M 0 0 L 9 9 Q 9 9 6 0"),
        ("M0 0a0 5 0 0 1 9 9", "M 0 0 L 9 9"),
        ("M0 0L5 5a3 3 0 0 1 0 0L9 9", "M 0 0 L 5 5 L 9 9"),
        ("M5 5A1 1 0 0 1 15 5", "M5 5A5 5 0 0 1 15 5"),
        ("M5 5A-5 -5 0 0 1 15 5", "M5 5A5 5 0 0 1 15 5"),
    ],
)
def test_short_forms_are_the_long_ones(short: str, long: str) -> None:
    one, other = path(short), path(long)
    assert len(one.paths) == len(other.paths)
    np.testing.assert_allclose(one.paths.vertices, other.paths.vertices, atol=NEAR_MM)


def test_numbers_without_a_gap_by_hand() -> None:
    with pytest.raises(DrawingError, match="has 3 numbers, wanted 2"):
        path("M10-20.5.5")
    np.testing.assert_allclose(corners(path("M10-20.5.5.5")), [(10, -20.5), (0.5, 0.5)])


@pytest.mark.parametrize("data", ["L 1 2", "5 5", "M", "M 1", "\u0660 1", "#", "M 0 0 L"])
def test_path_data_wrong_from_the_start_draw_nothing(data: str) -> None:
    with pytest.raises(DrawingError, match=r"^part\.svg: .*cannot be read \(path p: path data"):
        path(data)


@pytest.mark.parametrize(
    ("rest", "sign", "message"),
    [("L", 17, "'L' has 0 numbers, wanted 2"), ("L 1", 17, "has 1 numbers"),
     ("L nan 0", 17, "'L' holds 'n'"), ("L inf 0", 17, "holds 'inf 0'"),
     ("C 1 1 2 2 3", 17, "has 5 numbers, wanted 6"), ("A 1 1 0 2 0 5 5", 17, "holds '1 1 0 2 0 5"),
     ("A 1 1 0 1 5 5", 17, "holds '1 1 0 1 5 5'"), ("A", 17, "has no numbers, wanted 7"),
     ("z 5", 17, "'z' has 1 numbers, wanted none"), ("# 2", 8, "'L' holds '# 2'"),
     ("L--1 2", 17, "holds '--1 2'"), ("X 1 1", 8, "'L' holds 'X 1 1'"),
     ("L \u0661 \u0662", 17, "does not belong there"), ("L1e 3", 17, "holds 'e 3'"),
     ("L NaN", 17, "holds 'N'")],
)  # fmt: skip
def test_path_data_are_drawn_up_to_their_fault(rest: str, sign: int, message: str) -> None:
    drawing = path(f"M 5 5  L 9 5 7 8{rest} l 50 50")
    np.testing.assert_allclose(corners(drawing), [(5, 5), (9, 5), (7, 8)])
    (item,) = drawing.skipped
    assert (item.kind, item.count) == ("rest of path", 1)
    assert f"path data at sign {sign}: " in item.reason
    assert message in item.reason
    assert [finding.code for finding in drawing.findings] == [DrawingCode.ENTITY_SKIPPED]


def test_whole_sets_before_a_fault_are_drawn() -> None:
    drawing = path("M 5 5 L 9 5 7 8 1")
    np.testing.assert_allclose(corners(drawing), [(5, 5), (9, 5), (7, 8)])
    arcs = path("M 5 5 A 2 2 0 0 1 9 5 2 2 0 0 0 9")
    assert len(arcs.paths[0].vertices) == 2
    curve = path("M 5 5 C 5 5 9 5 9 5 s 1 1 2 2 9")
    np.testing.assert_allclose(corners(curve)[-1], (11, 7))


def test_a_very_long_number_does_not_hang() -> None:
    with pytest.raises(DrawingError):
        path("M0 0a" + "1" * 20_000 + "x")


@pytest.mark.parametrize("flags", ["0 0", "0 1", "1 0", "1 1"])
@pytest.mark.parametrize("radius", [5.0, 5.0 + 1e-9, 5.001, 8.0, 1000.0])
def test_arcs_of_circles_are_exact(flags: str, radius: float) -> None:
    # From (10, 50) to (20, 50): the half chord is 5.
    arc = path(f"M10 50A{radius!r} {radius!r} 0 {flags} 20 50")
    large, positive = (flag == "1" for flag in flags.split())
    half = math.asin(min(5.0 / radius, 1.0))
    sweep = 2.0 * (math.pi - half if large else half)
    segments = Segments.of(arc.paths)
    assert len(segments) == (2 if large and sweep > math.pi * (1 + 1e-9) else 1)
    np.testing.assert_allclose(segments.radius, radius, rtol=1e-9)
    assert segments.sweep.sum() == pytest.approx(-sweep if positive else sweep, rel=1e-9)
    np.testing.assert_array_equal(corners(arc)[[0, -1]], [(10, 50), (20, 50)])
    assert arc.fit.max_mm == 0.0


def curve_of(data: str, steps: int = 200) -> np.ndarray:
    """Points of path data as svgpathtools sees them, (n, 2) in the file's frame."""
    import svgpathtools

    t = np.linspace(0.0, 1.0, steps)
    points = np.array([seg.point(at) for seg in svgpathtools.parse_path(data) for at in t])
    return np.column_stack([points.real, points.imag])


def assert_on(drawing: Drawing, file_points: np.ndarray, within_mm: float) -> None:
    """The drawing covers these points of the file's frame, and is no longer than they are."""
    points = np.column_stack([file_points[:, 0], 100.0 - file_points[:, 1]])
    segments = Segments.of(drawing.paths)
    assert points_to_segments(points, segments).min(axis=1).max() <= within_mm
    dense = np.hypot(*np.diff(points, axis=0).T).sum()
    assert path_lengths(drawing.paths).sum() == pytest.approx(dense, rel=2e-3, abs=0.02)


CURVES = [
    "M10 10 C 20 50 60 10 30 40",
    "M10 10 Q 40 50 60 10",
    "M10 10 A 20 10 30 0 1 40 20",
    "M10 10 A 20 10 30 1 1 40 20",
    "M10 10 A 20 10 30 1 0 40 20",
    "M10 10 A 20 10 -75 0 0 40 20",
    "M10 10 a 12 12 0 1 0 5 5",
    "M10 10 a 1 3 20 0 0 25 5",
    "M10 10 C 40 40 40 10 10 40",
    "M10 10 l 5 5 c 1 8 3 9 12 5 s 3 4 10 0 q 2 9 9 0 t 9 -9 a 3 5 0 0 0 9 9",
]


@pytest.mark.parametrize("data", CURVES)
def test_curves_are_svgpathtools_curves(data: str) -> None:
    # Its own arcs are rounded to some 1e-7 of their size.
    assert_on(path(data), curve_of(data), 0.0005 + 1e-5)


COORDINATES = {"C": 6, "S": 4, "Q": 4, "T": 2}


@given(
    st.lists(
        st.tuples(
            st.sampled_from("CcSsQqTt"),
            st.integers(1, 3),
            st.lists(st.floats(-1e3, 1e3), min_size=18, max_size=18),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_control_points_are_svgpathtools_control_points(
    commands: list[tuple[str, int, list[float]]],
) -> None:
    import svgpathtools

    data = "M3 4"
    for letter, curves, numbers in commands:
        words = numbers[: curves * COORDINATES[letter.upper()]]
        data += letter + " ".join(map(repr, words))
    (subpath,), fault = parse_path(data)
    assert not fault
    wanted = [curve.bpoints()[1:] for curve in svgpathtools.parse_path(data)]
    assert [segment.control.tolist() for segment in subpath.segments] == [
        [[point.real, point.imag] for point in points] for points in wanted
    ]


@pytest.mark.parametrize(
    ("data", "control"),
    [
        ("M1 2S5 6 7 8", [1, 2]),
        ("M1 2T5 6", [1, 2]),
        ("M0 0C1 1 2 3 4 4S5 6 7 8", [6, 5]),
        ("M0 0Q2 3 4 4T7 8", [6, 5]),
        ("M0 0Q2 3 4 4t1 1 1 1", [4, 5]),
        ("M0 0Q2 3 4 4S5 6 7 8", [4, 4]),
        ("M0 0C1 1 2 3 4 4T7 8", [4, 4]),
        ("M0 0C1 1 2 3 4 4L5 5S5 6 7 8", [5, 5]),
        ("M0 0C1 1 2 3 4 4A3 3 0 0 1 5 5S5 6 7 8", [5, 5]),
        ("M0 0C1 1 2 3 4 4M5 5S5 6 7 8", [5, 5]),
        ("M1 2C1 1 2 3 4 4ZS5 6 7 8", [1, 2]),
    ],
)
def test_a_smooth_curve_reflects_only_a_curve_of_its_degree(
    data: str, control: list[float]
) -> None:
    subpaths, fault = parse_path(data)
    assert not fault
    assert subpaths[-1].segments[-1].control[0].tolist() == control


@given(
    st.sampled_from(CURVES),
    st.tuples(*[st.floats(-2.0, 2.0) for _ in range(4)]).filter(
        lambda m: abs(m[0] * m[3] - m[1] * m[2]) > 0.1
    ),
    st.floats(-30.0, 30.0),
)
def test_a_transform_is_the_same_as_transformed_points(
    data: str, m: tuple[float, float, float, float], shift: float
) -> None:
    a, b, c, d = m
    drawing = path(data, f'transform="matrix({a!r} {b!r} {c!r} {d!r} {shift!r} 3)"')
    points = curve_of(data) @ np.array([[a, b], [c, d]]) + np.array([shift, 3.0])
    assert_on(drawing, points, 0.0005 + 1e-5)


@given(st.floats(0.5, 40.0), st.floats(0.0, 360.0), st.sampled_from(["0 0", "0 1", "1 0", "1 1"]))
def test_a_mirrored_arc_is_the_arc_mirrored(radius: float, turn: float, flags: str) -> None:
    data = f"M10 10A{radius!r} {radius!r} {turn!r} {flags} 25 17"
    plain = path(data).paths.vertices
    mirrored = path(data, 'transform="scale(-1 1)"').paths.vertices
    np.testing.assert_allclose(mirrored, plain * np.array([-1.0, 1.0, -1.0]), atol=1e-9)


# ---- the page


@pytest.mark.parametrize(
    ("size", "wanted_mm"),
    [("10mm", 10), ("10 mm", 10), ("1cm", 10), ("1in", 25.4), ("96px", 25.4), ("96", 25.4),
     ("72pt", 25.4), ("6pc", 25.4), ("40Q", 10), ("1e1MM", 10)],
)  # fmt: skip
def test_units_of_the_page(size: str, wanted_mm: float) -> None:
    drawing = drawn(
        '<rect width="50" height="50"/>', f'width="{size}" height="{size}" viewBox="0 0 50 50"'
    )
    np.testing.assert_allclose(extents(drawing.paths), [[0, wanted_mm]] * 2, atol=NEAR_MM)
    unitless = [f.code for f in drawing.findings] == [DrawingCode.UNITLESS]
    assert unitless == (size == "96")


def test_without_any_size_units_are_px_and_said_to_be() -> None:
    drawing = drawn('<rect x="96" y="96" width="96" height="96"/>', "")
    np.testing.assert_allclose(extents(drawing.paths), [[25.4, 50.8], [-50.8, -25.4]])
    assert drawing.units.name == "px"
    (finding,) = drawing.findings
    assert finding.code == DrawingCode.UNITLESS
    assert "--units" in finding.message
    assert "--dpi" in finding.message


def test_a_view_box_alone_gives_the_page() -> None:
    page = 'viewBox="10 20 96 192"'
    drawing = drawn('<rect x="10" y="20" width="96" height="96"/>', page)
    np.testing.assert_allclose(extents(drawing.paths), [[0, 25.4], [25.4, 50.8]])
    fine = drawn('<rect x="10" y="20" width="96" height="96"/>', page, dpi=72.0)
    np.testing.assert_allclose(extents(fine.paths)[0], [0, 96 * 25.4 / 72])


@pytest.mark.parametrize(
    "page",
    ['width="50mm" {}', '{} height="100mm"', 'width="50mm" height="100%" {}',
     'width="auto" height="100mm" {}'],
)  # fmt: skip
def test_one_side_gives_the_other(page: str) -> None:
    drawing = drawn('<rect width="5" height="5"/>', page.format('viewBox="0 0 10 20"'))
    np.testing.assert_allclose(extents(drawing.paths), [[0, 25], [75, 100]], atol=NEAR_MM)


def test_a_page_without_view_box_is_in_px() -> None:
    drawing = drawn('<rect width="96" height="10mm"/>', 'width="100mm" height="50mm"')
    np.testing.assert_allclose(extents(drawing.paths), [[0, 25.4], [40, 50]], atol=NEAR_MM)


def test_the_callers_unit_is_that_of_a_user_unit() -> None:
    body = '<rect x="10" y="10" width="1" height="2"/>'
    drawing = drawn(body, 'width="7px" height="9px" viewBox="10 10 10 10"', units="in")
    np.testing.assert_allclose(extents(drawing.paths), [[0, 25.4], [203.2, 254]], atol=NEAR_MM)
    assert (drawing.units.name, drawing.units.mm_per_unit) == ("in", 25.4)
    assert not drawing.findings
    sized = drawn(body, 'width="40" height="30"', units="mm")
    np.testing.assert_allclose(extents(sized.paths), [[10, 11], [18, 20]], atol=NEAR_MM)
    bare = drawn(body, "", units="mm")
    np.testing.assert_allclose(extents(bare.paths), [[10, 11], [-12, -10]], atol=NEAR_MM)


@pytest.mark.parametrize(
    ("align", "x", "y"),
    # viewBox 10 x 10 on 20 x 40 mm: scale 2 (meet), 20 mm left over in Y.
    [("", (0, 20), (10, 30)), ("xMidYMid", (0, 20), (10, 30)), ("none", (0, 20), (0, 40)),
     ("xMinYMin", (0, 20), (20, 40)), ("xMidYMin meet", (0, 20), (20, 40)),
     ("xMaxYMin", (0, 20), (20, 40)), ("xMinYMid", (0, 20), (10, 30)),
     ("xMaxYMid", (0, 20), (10, 30)), ("xMinYMax", (0, 20), (0, 20)),
     ("xMidYMax", (0, 20), (0, 20)), ("xMaxYMax", (0, 20), (0, 20)),
     # slice: scale 4, 20 mm too much in X.
     ("xMinYMin slice", (0, 40), (0, 40)), ("xMidYMin slice", (-10, 30), (0, 40)),
     ("xMaxYMax slice", (-20, 20), (0, 40)), ("defer xMaxYMid slice", (-20, 20), (0, 40))],
)  # fmt: skip
def test_preserve_aspect_ratio(align: str, x: tuple[float, float], y: tuple[float, float]) -> None:
    page = f'width="20mm" height="40mm" viewBox="5 5 10 10" preserveAspectRatio="{align}"'
    drawing = drawn('<rect x="5" y="5" width="10" height="10"/>', page)
    np.testing.assert_allclose(extents(drawing.paths), [x, y], atol=NEAR_MM)


@pytest.mark.parametrize(
    "page",
    ['viewBox="0 0 0 5"', 'viewBox="0 0 5"', 'viewBox="a b c d"', 'width="0" height="5"',
     'width="-5mm" height="5"', 'width="5vw" height="5"', 'width="x" height="5"',
     'width="5mm" height="5mm" viewBox="0 0 5 5" preserveAspectRatio="left"'],
)  # fmt: skip
def test_a_wrong_page_is_an_error(page: str) -> None:
    with pytest.raises(DrawingError, match=r"^part\.svg: "):
        drawn(LINE.format(""), page)


def test_percentages_are_of_the_view_box() -> None:
    drawing = drawn('<rect x="10%" y="5%" width="20%" height="50%"/><circle r="10%"/>',
                    'width="200mm" height="100mm" viewBox="0 0 200 100"')  # fmt: skip
    box = extents(drawing.paths.select([0]))
    np.testing.assert_allclose(box, [[20, 60], [45, 95]], atol=NEAR_MM)
    # A length without direction: of the diagonal over √2.
    radius = 0.1 * math.hypot(200, 100) / math.sqrt(2)
    np.testing.assert_allclose(Segments.of(drawing.paths.select([1])).radius, radius)
    with pytest.raises(DrawingError, match="page has no size"):
        drawn('<circle r="10%"/>', "")


# ---- structure


def test_an_inner_svg_has_its_own_frame() -> None:
    drawing = drawn(
        '<svg x="10" y="20" width="40" height="20" viewBox="0 0 10 10">'
        '<rect width="10" height="10"/></svg>'
    )
    # Scale 2, centred in X: 10 mm are left on either side.
    np.testing.assert_allclose(extents(drawing.paths), [[20, 40], [60, 80]], atol=NEAR_MM)
    percent = drawn('<svg x="50%" width="50%"><rect width="50%" height="50%"/></svg>')
    np.testing.assert_allclose(extents(percent.paths), [[50, 75], [50, 100]], atol=NEAR_MM)


def test_use_draws_at_its_place() -> None:
    drawing = drawn(
        '<defs><g id="part"><rect width="2" height="3"/></g></defs>'
        '<use href="#part" x="10" y="20" transform="scale(2)"/><use xlink:href="#part"/>'
    )
    assert len(drawing.paths) == 2
    np.testing.assert_allclose(extents(drawing.paths.select([0])), [[20, 24], [54, 60]])
    np.testing.assert_allclose(extents(drawing.paths.select([1])), [[0, 2], [97, 100]])
    assert drawing.sources[0] == "rect at line 1 by use part"


def test_a_symbol_is_drawn_in_the_frame_of_its_use() -> None:
    drawing = drawn(
        '<symbol id="s" viewBox="0 0 10 10"><rect width="10" height="10"/></symbol>'
        '<use href="#s" x="10" y="10" width="30" height="20"/>'
    )
    np.testing.assert_allclose(extents(drawing.paths), [[15, 35], [70, 90]], atol=NEAR_MM)


def test_use_of_what_is_not_there_is_counted() -> None:
    drawing = drawn(LINE.format("") + '<use href="#no"/><use href="other.svg#a"/><use/>')
    assert skipped(drawing) == {"use": 3}


@pytest.mark.parametrize(
    "body",
    ['<g id="a"><use href="#a"/></g>', '<use id="a" href="#a"/>',
     '<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g>'],
)  # fmt: skip
def test_use_that_leads_back_to_itself_is_an_error(body: str) -> None:
    with pytest.raises(DrawingError, match="leads back to itself"):
        drawn(body)


def test_a_bomb_of_uses_is_an_error() -> None:
    levels = "".join(
        f'<g id="l{i}">' + f'<use href="#l{i + 1}"/>' * 10 + "</g>" for i in range(10)
    )
    with pytest.raises(DrawingError, match="drawn through use"):
        drawn(f'<defs>{levels}<g id="l10">{LINE.format("")}</g></defs><use href="#l0"/>')


def test_deep_nesting_is_an_error_and_not_a_fault() -> None:
    deep = 100_000
    with pytest.raises(DrawingError, match="nested deeper"):
        drawn("<g>" * deep + LINE.format("") + "</g>" * deep)
    half = "<g>" * 100
    with pytest.raises(DrawingError, match="nested deeper"):
        drawn(
            f'<defs>{half}<g id="b">{LINE.format("")}</g>{"</g>" * 100}'
            f'<g id="a">{half}<use href="#c"/>{"</g>" * 100}</g>'
            f'<g id="c">{half}{LINE.format("")}{"</g>" * 100}</g></defs><use href="#a"/>'
        )


def test_switch_draws_its_first_plain_child() -> None:
    drawing = drawn(
        '<switch><foreignObject requiredExtensions="x"/><g requiredExtensions="x">'
        '<circle r="5"/></g><g><rect width="1" height="2"/></g><rect width="9" height="9"/>'
        "</switch>"
    )
    np.testing.assert_allclose(extents(drawing.paths), [[0, 1], [98, 100]])


def test_layers() -> None:
    line = iter(f'<line y1="{y}" x2="5" y2="{y}"/>' for y in range(8))
    drawing = drawn(
        next(line)
        + f'<g inkscape:groupmode="layer" inkscape:label="CUT" id="l1">{next(line)}'
        + f'<g id="x">{next(line)}</g>'
        + f'<g inkscape:groupmode="layer" inkscape:label="Deep">{next(line)}</g></g>'
        + f'<g id="outer">{next(line)}<g id="inner">{next(line)}</g></g><g>{next(line)}</g>'
        + f'<g inkscape:groupmode="layer" id="bare">{next(line)}</g>'
    )
    assert drawing.layers == ("0", "CUT", "CUT", "Deep", "outer", "outer", "0", "bare")


@pytest.mark.parametrize(
    ("attributes", "wanted"),
    [
        ("", "#000000"),
        ('stroke="red"', "#ff0000"),
        ('stroke="#0AF"', "#00aaff"),
        ('stroke="#12345678"', "#123456"),
        ('stroke="rgb(1, 2,3)"', "#010203"),
        ('stroke="rgb(100%,0%,50%)" fill="blue"', "#ff0080"),
        ('fill="blue"', "#0000ff"),
        ('stroke="none" fill="blue"', "#0000ff"),
        ('stroke="red" style="stroke: lime"', "#00ff00"),
        ('style="fill:none;stroke:#123456 !important"', "#123456"),
        ('stroke="currentColor" color="teal"', "#008080"),
        ('stroke="url(#gradient)"', ""),
        ('class="cut"', "#ff00ff"),
        ('class="a cut b" style="stroke:olive"', "#808000"),
        ('id="own" class="cut"', "#ffa500"),
        ('stroke="inherit"', "#000000"),
    ],
)
def test_colours(attributes: str, wanted: str) -> None:
    style = "<style>/* x */ .cut, p > q { stroke: magenta } #own{stroke:orange}</style>"
    assert drawn(style + LINE.format(f" {attributes}")).colours == (wanted,)


def test_colours_are_inherited() -> None:
    body = f'<g stroke="red"><g fill="blue">{LINE.format("")}</g></g>'
    assert drawn(body).colours == ("#ff0000",)


@pytest.mark.parametrize(
    "attributes",
    ['display="none"', 'style="display:none"', 'visibility="hidden"', 'style="visibility: '
     'collapse"', 'stroke="none" fill="none"', 'class="off"'],
)  # fmt: skip
def test_what_is_hidden_is_counted_not_cut(attributes: str) -> None:
    line = LINE.format("")
    drawing = drawn(
        f"<style>.off {{ display: none }}</style>{line}<g {attributes}>{line}{line}</g>"
    )
    assert len(drawing.paths) == 1
    assert skipped(drawing) == {"line": 2}
    assert [finding.code for finding in drawing.findings] == [DrawingCode.ENTITY_SKIPPED]


def test_what_is_shown_again_is_drawn() -> None:
    body = f'<g visibility="hidden"><g visibility="visible">{LINE.format("")}</g></g>'
    assert len(drawn(body).paths) == 1


def test_what_cannot_be_cut_is_counted() -> None:
    drawing = drawn(
        '<defs><linearGradient id="g"/><clipPath id="c"><rect width="3" height="3"/></clipPath>'
        '<rect width="3" height="3"/></defs><text>G00 X5</text><image/><mask/><title>t</title>'
        + LINE.format(' clip-path="url(#c)"')
    )
    assert len(drawing.paths) == 1
    assert skipped(drawing) == {"text": 1, "image": 1}
    told = [finding for finding in drawing.findings if finding.code == DrawingCode.NOT_APPLIED]
    assert [str(finding.message) for finding in told] == [
        "1 clip-path of line is not applied: it is drawn whole"
    ]


def test_nothing_to_draw_is_an_error_that_says_what_there_was() -> None:
    with pytest.raises(DrawingError, match=r"only 2 text \(.*--text outline.*\)"):
        drawn("<text/><text/>")


def test_what_was_used_is_counted() -> None:
    drawing = drawn(LINE.format("") + '<line y2="9"/><path d="M5 5h1m2 2h1"/>')
    assert drawing.used == {"line": 2, "path": 1}
    assert len(drawing.paths) == 4


# ---- the file


def test_old_document_types_are_let_pass_and_not_fetched() -> None:
    text = (
        '<?xml version="1.0" encoding="ISO-8859-1"?><!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN"'
        ' "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">'
        f'<svg {SPACES} {PAGE}><g id="\u00e9">{LINE.format("")}</g></svg>'
    )
    assert read(text.encode("latin-1"), "old.svg", ReadOptions()).layers == ("\u00e9",)


@pytest.mark.parametrize(
    "declared",
    ['<!ENTITY a "' + 300 * "a" + '">', '<!ENTITY a "aaa"><!ENTITY b "&a;&a;&a;">',
     '<!ENTITY a "&#38;b;">', '<!ENTITY a "<g/>">', '<!ENTITY % a "aaa">',
     '<!ENTITY a SYSTEM "x" NDATA y>', '<!ENTITY a PUBLIC "x" "y">',
     '<!ENTITY a SYSTEM "file:///etc/passwd">', '<!ENTITY % a SYSTEM "http://localhost/x"> %a;'],
)  # fmt: skip
def test_entities_are_refused_in_one_line(declared: str) -> None:
    text = f"<!DOCTYPE svg [{declared}]><svg {SPACES} {PAGE}>{LINE.format('')}</svg>"
    with pytest.raises(DrawingError, match="plain SVG") as caught:
        read(text.encode(), "bomb.svg", ReadOptions())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "data",
    [b"<svg", b"<svg></sv>", b"<html/>", b"<svg xmlns='http://other.org'><g/></svg>", b"<a/><b/>",
     b"\xff\xfe<svg/>", b"<?xml version='1.0' encoding='utf-7'?><svg/>",
     b"<?xml version='1.0' encoding='shift_jis'?><svg/>", b"<svg><inkscape:g/></svg>",
     b"<svg>&undefined;</svg>", b"<svg>\x00</svg>"],
)  # fmt: skip
def test_what_is_no_svg_is_an_error(data: bytes) -> None:
    with pytest.raises(DrawingError, match=r"^bad\.svg: "):
        read(data, "bad.svg", ReadOptions())


def test_errors_name_the_element_by_line() -> None:
    text = f'<svg {SPACES} {PAGE}>\n<g>\n<path d="M 0 0 L"/></g></svg>'
    with pytest.raises(DrawingError, match=r"^a\.svg: .*\(path at line 3: path data"):
        read(text.encode(), "a.svg", ReadOptions())


@given(st.binary(max_size=200))
def test_bytes_never_crash_the_reader(data: bytes) -> None:
    with pytest.raises(DrawingError):
        read(data, "noise.svg", ReadOptions())


def drawn_or_refused(body: str, page: str) -> Drawing | None:
    """The Drawing, or None after a clean error of one line; anything else fails the test."""
    try:
        return drawn(body, page, tolerance_mm=0.1)
    except DrawingError as error:
        message = str(error)
    assert message.startswith("part.svg: ")
    assert "\n" not in message
    return None


NUMBERS = st.sampled_from(["0", "1", "-2.5", "1e3", ".5", "7", "1e-9", "99", "1e11", "nan", ""])


@given(
    st.lists(st.tuples(st.sampled_from(list("MmLlHhVvCcSsQqTtAaZz")),
                       st.lists(NUMBERS, max_size=8)), max_size=6)
)  # fmt: skip
def test_any_path_is_read_or_refused(commands: list[tuple[str, list[str]]]) -> None:
    data = "M 1 2 " + " ".join(f"{letter} {' '.join(numbers)}" for letter, numbers in commands)
    drawing = drawn_or_refused(f'<path d="{data}"/>', PAGE)
    assert drawing is None or np.isfinite(drawing.paths.vertices).all()


WORDS = st.sampled_from(
    ["<g>", "</g>", "<svg>", "</svg>", LINE.format(""), '<rect width="5" height="5%"/>', "<use/>",
     '<use href="#a"/>', '<g id="a">', '<svg viewBox="0 0 1 1">', '<g transform="scale(2)">',
     '<circle r="1"/>', "<defs>", "</defs>", "<switch>", "</switch>", "x", "&amp;", "<!-- -->",
     "<symbol id='a'>", "</symbol>", "<style>* {stroke:", "</style>", '<g style="display:none">']
)  # fmt: skip


@given(st.lists(WORDS, max_size=12), st.sampled_from(["", PAGE, 'viewBox="0 0 5 5"']))
def test_any_document_is_read_or_refused(words: list[str], page: str) -> None:
    drawn_or_refused("".join(words), page)


def test_a_list_of_points_that_is_too_long_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shapes, "MAX_PATH_CHARACTERS", 11)
    drawing = drawn('<polyline points="0 0 9 9 5 5"/><polyline points="0 0 9 9 5 55"/>')
    assert len(drawing.paths) == 1
    assert "points have more than 11 characters" in drawing.skipped[0].reason
