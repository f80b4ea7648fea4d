"""What is mended on reading, and what is told of it."""

from __future__ import annotations

import itertools
import json
import math
from random import Random
from unittest.mock import ANY

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.findings import Code, Severity
from camtool.geometry.drawing import Drawing, Mark, Skipped, Units
from camtool.geometry.facts import drawing_facts
from camtool.geometry.findings import ContourCode
from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.overlaps import SAME_LINE_MM
from camtool.geometry.polylines import Polyline
from camtool.importers import healing
from camtool.importers.assemble import MAX_PLACES, assemble
from camtool.importers.findings import DrawingCode
from camtool.importers.healing import clean_pieces
from camtool.importers.options import ReadOptions, Selection
from camtool.importers.pieces import Piece
from tests.strategies import examples


def piece(
    *points: tuple[float, ...],
    closed: bool = False,
    layer: str = "0",
    colour: str = "#ff0000",
    line_type: str = "",
) -> Piece:
    vertices = np.array([(*p, 0.0)[:3] for p in points], dtype=np.float64)
    return Piece(vertices, closed, layer, colour, f"LINE {points[0]}", line_type)


def put(*pieces: Piece, marks: tuple[Mark, ...] = (), **options: object) -> Drawing:
    return assemble(
        list(pieces),
        file="t.dxf",
        units=Units("mm", 1.0, "in a test"),
        used={},
        skipped=[],
        findings=[],
        options=ReadOptions(**options),  # type: ignore[arg-type]
        marks=marks,
    )


def found(drawing: Drawing, code: Code) -> list[str]:
    return [f.message for f in drawing.findings if f.code == code]


SQUARE = [(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)]


def test_what_lies_twice_is_one_finding_with_its_length() -> None:
    square = piece(*SQUARE[:4], closed=True)
    drawing = put(square, square, piece((2, 0), (5, 0)), piece((8, 0), (14, 0)))
    assert [len(path) for path in drawing.paths] == [4, 1]
    healed = drawing.healing
    assert (healed.duplicates, healed.duplicates_mm) == (1, pytest.approx(40.0))
    assert (healed.overlaps, healed.overlaps_mm) == (2, pytest.approx(5.0))
    (finding,) = [f for f in drawing.findings if f.code == DrawingCode.DRAWN_TWICE]
    assert finding.severity == Severity.INFO
    assert finding.measured == pytest.approx(45.0)
    assert not found(drawing, DrawingCode.ENTITY_SKIPPED)


def test_a_contour_drawn_over_with_lines_stays_one_contour() -> None:
    lines = [piece(a, b) for a, b in itertools.pairwise(SQUARE)]
    drawing = put(piece(*SQUARE[:4], closed=True), *lines)
    assert drawing.paths.closed.tolist() == [True]
    assert drawing.healing.overlaps == 4


def test_other_layers_and_colours_are_cut_again() -> None:
    lines = [piece((0, 0), (9, 0)), piece((1, 0), (5, 0), layer="B"),
             piece((1, 0), (5, 0), colour="#0000ff")]  # fmt: skip
    assert put(*lines).healing.overlaps == 0
    across = put(*lines, across_layers=True)
    assert across.healing.overlaps == 1
    assert across.layers == ("0", "0")


def test_ends_of_other_layers_join_when_asked() -> None:
    lines = [piece((0, 0), (9, 0), layer="A"), piece((9, 0.004), (9, 9), layer="B")]
    assert len(put(*lines).paths) == 2
    across = put(*lines, across_layers=True)
    assert across.layers == ("A",)
    assert [(gap.layer, gap.size_mm) for gap in across.closed_gaps] == [
        ("A", pytest.approx(0.004))
    ]


def test_branches_are_told_with_place_and_number_of_ends() -> None:
    tee = [piece((0, 0), (5, 0)), piece((5, 0), (9, 0)), piece((5, 0), (5, 7))]
    drawing = put(*tee)
    (finding,) = [f for f in drawing.findings if f.code == ContourCode.BRANCHED]
    assert (finding.severity, finding.measured) == (Severity.WARNING, 3.0)
    assert finding.where == "layer 0, x 5.0000 y 0.0000 mm"
    assert sorted(len(path) for path in drawing.paths) == [1, 2]


def test_at_a_branch_lines_of_one_kind_are_joined() -> None:
    ends = [((0, 0), "CONTINUOUS"), ((9, 0), "DASHED"), ((5, 7), "CONTINUOUS")]
    drawing = put(*(piece(at, (5, 0), line_type=kind) for at, kind in ends))
    assert sorted(drawing.line_types) == ["CONTINUOUS", "DASHED"]
    assert dict(zip(drawing.line_types, map(len, drawing.paths), strict=True)) == {
        "CONTINUOUS": 2,
        "DASHED": 1,
    }


def test_contours_that_cross_themselves_are_told() -> None:
    drawing = put(piece((0, 0), (5, 5), (5, 0), (0, 5), closed=True))
    (finding,) = [f for f in drawing.findings if f.code == ContourCode.SELF_CROSSING]
    assert finding.severity == Severity.WARNING
    assert finding.where == "layer 0, x 2.5000 y 2.5000 mm"
    assert [c.at_mm for c in drawing.healing.crossings] == [pytest.approx((2.5, 2.5))]


def test_of_several_crossings_of_a_contour_the_first_is_named() -> None:
    zigzag = piece((0, 0), (9, 0), (9, 4), (6, -4), (3, 4), (0, -4), closed=True)
    drawing = put(zigzag)
    crossings = drawing.healing.crossings
    assert len({crossing.at_mm for crossing in crossings}) > 1
    (finding,) = [f for f in drawing.findings if f.code == ContourCode.SELF_CROSSING]
    x, y = crossings[0].at_mm
    assert finding.where == f"layer 0, x {x:.4f} y {y:.4f} mm"
    assert finding.measured == len(crossings)


def test_many_places_end_in_one_count() -> None:
    ties = [
        piece((0, 6 * k), (5, 6 * k + 5), (5, 6 * k), (0, 6 * k + 5), closed=True)
        for k in range(MAX_PLACES + 3)
    ]
    messages = found(put(*ties), ContourCode.SELF_CROSSING)
    assert len(messages) == MAX_PLACES + 1
    assert messages[-1] == "3 more closed contours cross themselves"
    tees = [
        piece((0, 6 * k), end) for k in range(MAX_PLACES + 3) for end in
        ((-2, 6 * k), (2, 6 * k), (0.5, 6 * k + 2))
    ]  # fmt: skip
    messages = found(put(*tees), ContourCode.BRANCHED)
    assert len(messages) == MAX_PLACES + 1
    assert messages[-1] == "more than two ends meet at 3 more places"


def test_specks_are_merged_within_the_tolerance() -> None:
    drawing = put(piece((0, 0), (5, 0), (5, 0.004), (5, 5)), tolerance_mm=0.01)
    assert [len(path) for path in drawing.paths] == [2]
    assert drawing.healing.tiny_merged == 1
    assert found(drawing, DrawingCode.TINY_MERGED)
    assert not found(put(piece((0, 0), (5, 0), (5, 0.006), (5, 5)), tolerance_mm=0.01),
                     DrawingCode.TINY_MERGED)  # fmt: skip


def test_arcs_are_recognised_when_asked_after_loose_chords_were_joined(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[int] = []

    def recognise_arcs(path: Polyline, tolerance_mm: float) -> tuple[Polyline, int]:
        seen.append(len(path))
        assert tolerance_mm == 0.002
        return path, 2

    monkeypatch.setattr("camtool.importers.healing.recognise_arcs", recognise_arcs)
    lines = [piece(a, b) for a, b in itertools.pairwise(SQUARE)]
    assert put(*lines).healing.arcs_recognised == 0
    assert seen == []
    drawing = put(*lines, recognise_arcs=True, tolerance_mm=0.002)
    assert (seen, drawing.healing.arcs_recognised) == ([4], 2)
    assert found(drawing, DrawingCode.ARCS_RECOGNISED)


HOLES = (Mark((1.0, 2.0), "holes", "", "POINT 1"), Mark((5.0, 2.0), "pins", "", "POINT 2"))


def test_a_drawing_of_marks_alone_has_no_paths() -> None:
    drawing = put(marks=HOLES)
    assert (len(drawing.paths), drawing.marks) == (0, HOLES)


def test_marks_are_chosen_as_pieces_are() -> None:
    line = piece((0, 0), (9, 0))
    drawing = put(line, marks=HOLES, select=Selection(layers=("pins",)))
    assert (len(drawing.paths), drawing.marks) == (0, HOLES[1:])
    assert set(drawing.skipped) == {
        Skipped("LINE", 1, "is on a layer that was not asked for"),
        Skipped("POINT", 1, "is on a layer that was not asked for"),
    }
    assert len(put(line, marks=HOLES, select=Selection(layers=("0",))).paths) == 1
    with pytest.raises(DrawingError, match="holes, pins"):
        put(marks=HOLES, select=Selection(layers=("hole",)))


def test_a_hole_is_drilled_once() -> None:
    drawing = put(marks=(*HOLES, Mark((1.0 + 1e-9, 2.0), "holes", "", "POINT 3")))
    assert drawing.marks == HOLES
    assert drawing.skipped == (Skipped("POINT", 1, "is drawn twice"),)
    assert found(drawing, DrawingCode.ENTITY_SKIPPED) == ["1 POINT left out: is drawn twice"]


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 2e9])
def test_marks_that_are_no_place_are_errors(wrong: float) -> None:
    with pytest.raises(DrawingError, match=r"^t\.dxf: layer holes, POINT 1: "):
        put(marks=(Mark((1.0, wrong), "holes", "", "POINT 1"),))


@given(
    st.lists(
        st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), min_size=2, max_size=4),
        min_size=1, max_size=12,
    ),
    st.lists(st.sampled_from([0.0, 0.5, -0.5]), min_size=4, max_size=4),
    st.booleans(),
)  # fmt: skip
def test_drawn_once_equals_brute_force(
    rows: list[list[tuple[int, int]]], bulges: list[float], closed: bool
) -> None:
    pieces = [
        piece(*((*p, b) for p, b in zip(points, bulges, strict=False)), closed=closed)
        for points in rows
    ]
    clean = clean_pieces(pieces, "t.dxf")

    def segments(path: Polyline) -> tuple[bool, list[tuple[object, ...]]]:
        """The segments of a path, each the same in both directions, in any order."""
        ends = np.roll(path.vertices, -1, axis=0)
        both = [
            min((*a[:2], *b[:2], a[2]), (*b[:2], *a[:2], 0.0 - a[2]))
            for a, b in zip(path.vertices.tolist(), ends.tolist(), strict=True)
        ]
        return path.closed, sorted(both if path.closed else both[:-1])

    alone = [clean_pieces([one], "t.dxf").lines for one in pieces]
    wanted = [segments(lines[0]) for lines in alone if len(lines)]
    kept = [segments(path) for path in clean.lines]
    assert len(kept) + clean.duplicates == len(wanted)
    assert all(kept.count(one) == 1 for one in kept)
    assert all(one in kept for one in wanted)


NUMBERS = st.one_of(
    st.sampled_from([0.0, 1.0, 1.0 + 1e-7, 1.00001, 5.0, -1e9, 1e9, 2e9, 1e300, math.nan]),
    st.floats(-1e9, 1e9),
)
ANY_PIECE = st.builds(
    lambda rows, closed, layer: piece(*rows, closed=closed, layer=layer),
    st.lists(
        st.tuples(NUMBERS, NUMBERS, st.sampled_from([0.0, 0.5, -1.0, 1e-300, 3.0, 1e300])),
        min_size=1,
        max_size=6,
    ),
    st.booleans(),
    st.sampled_from("AB"),
)


@given(
    st.lists(ANY_PIECE, max_size=8),
    st.sampled_from([1e-9, 0.0005, 10.0, 1e12]),
    st.sampled_from([0.0, 0.01, 1e6]),
    st.booleans(),
)
def test_any_pieces_are_assembled_or_refused(
    pieces: list[Piece], tolerance_mm: float, gap_mm: float, across: bool
) -> None:
    try:
        drawing = put(*pieces, tolerance_mm=tolerance_mm, gap_mm=gap_mm, across_layers=across)
    except DrawingError:
        return
    json.dumps(drawing_facts(drawing))


CORNERS = st.tuples(st.integers(0, 4), st.integers(0, 4))


@given(
    st.lists(st.tuples(CORNERS, CORNERS, st.sampled_from([0.0, 0.0, 0.0, 1.0, -0.5])), min_size=1,
             max_size=14),
    st.randoms(use_true_random=False),
)  # fmt: skip
def test_order_and_direction_of_drawing_decide_nothing(
    rows: list[tuple[tuple[int, int], tuple[int, int], float]], random: Random
) -> None:
    pieces = [piece((*a, bulge), b) for a, b, bulge in rows if a != b]
    turned = [piece((*b, -bulge), a) for a, b, bulge in rows if a != b]
    if not pieces:
        return
    other = [random.choice(both) for both in zip(pieces, turned, strict=True)]
    random.shuffle(other)
    one, two = put(*pieces), put(*other)

    def shapes(drawing: Drawing) -> list[tuple[bool, float, float]]:
        lengths = np.round(path_lengths(drawing.paths), 4).tolist()
        areas = np.round(np.abs(signed_areas(drawing.paths)), 4).tolist()
        return sorted(zip(drawing.paths.closed.tolist(), lengths, areas, strict=True))

    assert np.array(shapes(one)) == pytest.approx(np.array(shapes(two)), abs=1e-3)
    assert len(one.healing.branches) == len(two.healing.branches)
    for mine, its in zip(one.healing.branches, two.healing.branches, strict=True):
        assert (mine.ends, mine.layer) == (its.ends, its.layer)
        assert mine.at_mm == pytest.approx(its.at_mm, abs=1e-9)
    assert one.healing.duplicates == two.healing.duplicates
    assert one.healing.overlaps_mm == pytest.approx(two.healing.overlaps_mm)


def test_segments_are_numbered_alike_however_many_at_a_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    vertices = np.random.default_rng(2).uniform(-9.0, 9.0, (7, 3))
    begin, end = np.arange(7), np.roll(np.arange(7), -1)
    numbers = healing.segment_numbers(vertices, begin, end)
    monkeypatch.setattr(healing, "SEGMENTS_AT_ONCE", 2)
    assert healing.segment_numbers(vertices, begin, end).tolist() == numbers.tolist()
    turned = vertices.copy()
    turned[end, 2] = -vertices[begin, 2]
    assert healing.segment_numbers(turned, end, begin).tolist() == numbers.tolist()


# Exploded outlines: what meets exactly is joined as it was drawn, whatever the gap tolerance.


def outline_with_specks(
    random: Random, radius: float, at: tuple[float, float]
) -> list[list[float]]:
    """The vertices (x, y, bulge) of a star-shaped outline, most of whose corners are notches,
    steps and rounds of 2 to 19 µm."""
    rows: list[list[float]] = []
    count = random.randint(3, 9)
    for k in range(count):
        angle = (k + 0.4 * random.random()) * 2.0 * math.pi / count
        reach = radius * random.uniform(0.6, 1.0)
        x, y = at[0] + reach * math.cos(angle), at[1] + reach * math.sin(angle)
        rows.append([x, y, random.choice([0.0, 0.0, 0.2, -0.1])])
        heading = angle + math.pi / 2
        for _ in range(random.choice([0, 1, 2, 3, 6])):
            rows[-1][2] = random.choice([0.0, 0.0, 0.4, -0.4])
            heading += random.uniform(-0.6, 0.9)
            step = random.uniform(0.002, 0.019)
            x, y = x + step * math.cos(heading), y + step * math.sin(heading)
            rows.append([x, y, 0.0])
    return rows


def exploded(rows: list[list[float]], random: Random) -> list[Piece]:
    """Each line and arc of a ring as a piece of its own, drawn in either direction, its ends less
    than the equal-position tolerance off."""

    def near(x: float, y: float) -> tuple[float, float]:
        return x + random.uniform(-2e-7, 2e-7), y + random.uniform(-2e-7, 2e-7)

    pieces = []
    for (x, y, bulge), (u, v, _) in zip(rows, [*rows[1:], rows[0]], strict=True):
        one, other = (*near(x, y), bulge), (*near(u, v), 0.0)
        if random.random() < 0.5:
            one, other = (*other[:2], -bulge), (*one[:2], 0.0)
        pieces.append(piece(one, other))
    return pieces


def is_ring(path: Polyline, rows: list[list[float]], within: float) -> bool:
    """True if the closed path has these vertices, from any start and in either direction."""
    x, y, bulge = np.array(rows).T
    ways = [np.column_stack([x, y, bulge])]
    ways.append(np.column_stack([x[::-1], y[::-1], -np.roll(bulge[::-1], -1)]))
    if not path.closed or len(path.vertices) != len(rows):
        return False
    return any(
        np.allclose(np.roll(way, shift, axis=0), path.vertices, rtol=0.0, atol=within)
        for way in ways
        for shift in range(len(rows))
    )


@pytest.mark.parametrize("gap", [0.0, 1e-5, 0.003, 0.01, 0.05])
@examples(15, 2000)
@given(seed=st.integers(0, 10**9))
def test_exploded_outlines_are_joined_as_they_were_drawn(gap: float, seed: int) -> None:
    check_exploded_outlines(gap, seed)


@given(seed=st.integers(0, 10**9))
def test_exploded_outlines_with_a_wide_gap(seed: int) -> None:
    check_exploded_outlines(0.5, seed)


@pytest.mark.parametrize(("gap", "said"), [(0.003, "GAP_OPEN"), (0.5, "GAP_CLOSED")])
def test_a_speck_that_doubles_back_is_drawn_twice(gap: float, said: str) -> None:
    """A line of 6.1 µm lies within 0.1 µm of the next line, which begins at its end: it counts as
    drawn twice, and the gap that is left is told or closed."""
    _, drawing = heal_outlines(gap, 223768752)
    found = {finding.code.name: finding.measured for finding in drawing.findings}
    assert found == {"DRAWN_TWICE": pytest.approx(0.006115, abs=1e-6), said: ANY}


def check_exploded_outlines(gap: float, seed: int) -> None:
    """Explode outlines at random, and compare what healing joins with what was drawn."""
    rings, drawing = heal_outlines(gap, seed)
    assume(not any(doubles_back(ring) for ring in rings))
    assert len(drawing.paths) == len(rings)
    for ring in rings:
        assert sum(is_ring(path, ring, 1e-6) for path in drawing.paths) == 1
    assert not [
        f for f in drawing.findings if f.code in (DrawingCode.GAP_CLOSED, ContourCode.BRANCHED)
    ]


def doubles_back(ring: list[list[float]]) -> bool:
    """True if two lines that follow each other lie within the width of one line."""
    place = np.array(ring)[:, :2]
    ways = np.roll(place, -1, axis=0) - place
    straight = np.array(ring)[:, 2] == 0.0
    length = np.hypot(*ways.T)
    following, after = np.roll(ways, -1, axis=0), np.roll(length, -1)
    across = np.abs(ways[:, 0] * following[:, 1] - ways[:, 1] * following[:, 0])
    back = (ways * following).sum(axis=1) < 0.0
    thin = across / np.maximum(length, after) <= 1.1 * SAME_LINE_MM
    return bool((straight & np.roll(straight, -1) & back & thin).any())


def heal_outlines(gap: float, seed: int) -> tuple[list[list[list[float]]], Drawing]:
    """Draw outlines with specks, explode them into pieces, shuffle and heal these."""
    random = Random(seed)
    rings = [outline_with_specks(random, 10.0, (0.0, 0.0))]
    # An island, and one beside it by less than the gap.
    rings.append(outline_with_specks(random, 2.0, (0.5, 0.5)))
    beside = max(x for x, _, _ in rings[0]) + 0.004
    rings.append([[x + beside, y, b] for x, y, b in outline_with_specks(random, 3.0, (3.0, 0.0))])
    turn, flip = random.uniform(0.0, 2.0 * math.pi), random.choice([1.0, -1.0])
    for row in (row for ring in rings for row in ring):
        x, y = flip * row[0], row[1]
        row[0] = math.cos(turn) * x - math.sin(turn) * y
        row[1], row[2] = math.sin(turn) * x + math.cos(turn) * y, flip * row[2]
    pieces = [one for ring in rings for one in exploded(ring, random)]
    random.shuffle(pieces)
    return rings, put(*pieces, gap_mm=gap, tolerance_mm=1e-4)
