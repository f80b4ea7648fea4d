"""What all readers share: cleaning, chaining within layers, findings."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.findings import Code, Severity
from camtool.geometry.drawing import Drawing, Skipped, Units
from camtool.geometry.measure import signed_areas
from camtool.importers import healing
from camtool.importers.assemble import MAX_GAP_FINDINGS, MAX_SIZE_MM, MIN_SIZE_MM, assemble
from camtool.importers.findings import DrawingCode
from camtool.importers.healing import clean_pieces
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece

MM = Units("mm", 1.0, "in a test")


def piece(*points: tuple[float, ...], closed: bool = False, layer: str = "0") -> Piece:
    vertices = np.array([(*p, 0.0)[:3] for p in points])
    return Piece(vertices, closed, layer, "#ff0000", f"LINE {points[0]}")


def put(*pieces: Piece, skipped: tuple[Skipped, ...] = (), **options: object) -> Drawing:
    return assemble(
        list(pieces),
        file="t.dxf",
        units=MM,
        used={"LINE": len(pieces)},
        skipped=list(skipped),
        findings=[],
        options=ReadOptions(**options),
    )


def found(drawing: Drawing, code: Code) -> list[str]:
    return [finding.message for finding in drawing.findings if finding.code == code]


def test_lines_of_a_square_become_one_closed_path() -> None:
    square = put(
        piece((0, 0), (10, 0)),
        piece((10, 10), (0, 10)),
        piece((10, 0), (10, 10)),
        piece((0, 10), (0, 0)),
    )
    assert square.paths.closed.tolist() == [True]
    assert abs(signed_areas(square.paths)[0]) == 100.0
    assert square.sources[0].endswith("+ 1 more")
    assert not square.findings
    assert not square.gaps


def test_layers_are_never_joined() -> None:
    drawing = put(
        piece((0, 0), (10, 0), layer="A"),
        piece((10, 0), (10, 10), layer="B"),
        piece((10, 10), (0, 0), layer="A"),
    )
    assert drawing.layers == ("A", "B")
    assert [len(path.vertices) for path in drawing.paths] == [3, 2]


def test_closed_gaps_are_told_with_place_and_size() -> None:
    drawing = put(piece((0, 0), (10, 0)), piece((10, 0.004), (10, 10)))
    (finding,) = drawing.findings
    assert (finding.code, finding.severity) == (DrawingCode.GAP_CLOSED, Severity.INFO)
    assert finding.measured == pytest.approx(0.004)
    assert finding.where == "layer 0, x 10.0000 y 0.0020 mm"
    assert len(drawing.paths) == 1


def test_open_gaps_are_told_and_stay_open() -> None:
    drawing = put(piece((0, 0), (10, 0)), piece((10, 0.05), (10, 10)))
    assert len(drawing.paths) == 2
    assert found(drawing, DrawingCode.GAP_OPEN) == ["two open ends are 50 µm apart and stay open"]
    (gap,) = drawing.gaps
    assert gap.size_mm == pytest.approx(0.05)
    assert [f.severity for f in drawing.findings] == [Severity.WARNING]


def test_gaps_stay_when_chaining_is_off_but_equal_ends_join() -> None:
    pieces = (piece((0, 0), (10, 0)), piece((10, 0.004), (10, 10)), piece((10, 10), (0, 10)))
    drawing = put(*pieces, chain_gaps=False)
    assert [len(path.vertices) for path in drawing.paths] == [2, 3]
    assert not found(drawing, DrawingCode.GAP_CLOSED)


def test_many_gaps_end_in_one_count() -> None:
    count = MAX_GAP_FINDINGS + 7
    pieces = []
    for row in range(count):
        pieces.append(piece((0, row), (10, row)))
        pieces.append(piece((10.001 + 1e-5 * row, row), (20, row)))
    drawing = put(*pieces)
    messages = found(drawing, DrawingCode.GAP_CLOSED)
    assert len(messages) == MAX_GAP_FINDINGS + 1
    assert messages[0] == "a gap of 1.26 µm was closed"
    assert messages[-1] == "7 more gaps were closed, of 1 to 1.06 µm"


def test_pieces_without_length_are_counted() -> None:
    drawing = put(
        piece((0, 0), (10, 0)),
        piece((3, 3), (3, 3)),
        piece((4, 4), closed=True),
        piece((5, 5, 0.5), (5, 5 + 1e-7, 0.5), closed=True),
    )
    assert drawing.skipped == (Skipped("LINE", 3, "has no length"),)
    assert found(drawing, DrawingCode.ENTITY_SKIPPED) == ["3 LINE left out: has no length"]


@pytest.mark.parametrize("turn", [0, 1, 2])
@pytest.mark.parametrize("back", [False, True])
def test_a_contour_drawn_twice_is_drawn_once(turn: int, back: bool) -> None:
    points = np.array([[0, 0, 0.5], [10, 0, 0.0], [10, 5, -0.25]])
    other = np.roll(points, turn, axis=0)
    if back:
        other = other[::-1].copy()
        other[:, 2] = -np.roll(other[:, 2], -1)
    drawing = put(*(Piece(p, True, "0", "", "ARC 1") for p in (points, other)))
    assert len(drawing.paths) == 1
    assert drawing.skipped == (Skipped("ARC", 1, "is drawn twice"),)


def test_a_line_drawn_twice_does_not_spoil_the_chain() -> None:
    square = [(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)]
    lines = [piece(a, b) for a, b in itertools.pairwise(square)]
    drawing = put(*lines, piece((10, 0), (0, 0)), piece((0, 0), (10, 0), layer="other"))
    assert drawing.paths.closed.tolist() == [True, False]
    assert drawing.skipped == (Skipped("LINE", 1, "is drawn twice"),)


def test_what_only_looks_the_same_is_kept() -> None:
    arc = Piece(np.array([[0, 0, 0.5], [10, 0, 0.0]]), False, "0", "", "ARC 1")
    against = Piece(np.array([[0, 0, -0.5], [10, 0, 0.0]]), False, "0", "", "ARC 2")
    drawing = put(arc, against, piece((0, 0), (10, 0)))
    assert not drawing.skipped


def test_there_and_back_is_one_line() -> None:
    drawing = put(piece((0, 0), (10, 0), closed=True))
    assert drawing.paths.closed.tolist() == [False]


@pytest.mark.parametrize(
    ("size", "told"), [(MIN_SIZE_MM, False), (MIN_SIZE_MM * 0.99, True), (MAX_SIZE_MM, False),
                       (MAX_SIZE_MM * 1.01, True)],
)  # fmt: skip
def test_implausible_sizes(size: float, told: bool) -> None:
    drawing = put(piece((0, 0), (size, 0)), gap_mm=0.0)
    messages = found(drawing, DrawingCode.IMPLAUSIBLE_SIZE)
    assert bool(messages) == told
    assert all("--units" in message for message in messages)


def test_skipped_entities_are_told_once_a_kind() -> None:
    drawing = put(
        piece((0, 0), (1, 1)),
        skipped=(Skipped("TEXT", 2, "no outline"), Skipped("TEXT", 3, "no outline")),
    )
    assert drawing.skipped == (Skipped("TEXT", 5, "no outline"),)
    assert found(drawing, DrawingCode.ENTITY_SKIPPED) == ["5 TEXT left out: no outline"]


def test_nothing_to_draw_says_what_there_was() -> None:
    with pytest.raises(DrawingError, match=r"t\.dxf: holds no lines .* 2 TEXT \(no outline\)"):
        put(skipped=(Skipped("TEXT", 2, "no outline"),))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 2e9])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_numbers_that_are_no_place_are_errors(wrong: float, column: int) -> None:
    vertices = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 0.0], [9.0, 9.0, 0.0]])
    vertices[1, column] = wrong
    with pytest.raises(DrawingError, match=r"^t\.dxf: layer CUT, SPLINE 9: "):
        put(Piece(vertices, False, "CUT", "", "SPLINE 9"))


@given(
    st.lists(
        st.tuples(*[st.integers(0, 3)] * 2, st.sampled_from([0.0, 0.25, -1.0])),
        min_size=1,
        max_size=12,
    ),
    st.booleans(),
)
def test_repeats_go_and_the_path_stays(rows: list[tuple[int, int, float]], closed: bool) -> None:
    vertices = np.array(rows, dtype=np.float64)
    clean = clean_pieces([Piece(vertices, closed, "0", "", "PATH 1")], "t.dxf")

    def drawn(path: np.ndarray, closed: bool) -> list[tuple[float, ...]]:
        """Segments that go somewhere: start, end, bulge."""
        ends = np.roll(path[:, :2], -1, axis=0)
        segments = [(*a[:2], *b, a[2]) for a, b in zip(path, ends, strict=True)]
        count = len(path) if closed else len(path) - 1
        return [s for s in segments[:count] if s[:2] != s[2:4]]

    wanted = drawn(vertices, closed)
    if not len(clean.lines):
        assert not wanted
        assert clean.skipped == (Skipped("PATH", 1, "has no length"),)
        return
    (path,) = clean.lines
    if closed and not path.closed:
        # There and back is one line.
        assert len(wanted) == 2
        assert drawn(path.vertices, False) == wanted[:1]
    else:
        # An open path's last vertex leaves nothing, whatever bulge it has.
        assert drawn(path.vertices, closed) == wanted
    assert len(drawn(path.vertices, path.closed)) == len(path)


def test_a_drawing_of_too_many_points_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(healing, "MAX_POINTS", 3)
    put(piece((0, 0), (1, 0), (1, 1)))
    with pytest.raises(DrawingError, match="holds more than 3000000 points"):
        put(piece((0, 0), (1, 0)), piece((5, 0), (6, 0)))
