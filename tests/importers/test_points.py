"""The points reader: forms, faults with their places, and noise."""

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.importers.options import ReadOptions
from camtool.importers.points import reader
from camtool.importers.points.reader import read
from tests.fuzz.reading import read_or_refuse


def points(text: str, **options: object) -> Drawing:
    return read(text.encode(), "p.csv", ReadOptions(**options))


def shape(drawing: Drawing, index: int = 0) -> list[list[float]]:
    return drawing.paths[index].vertices[:, :2].tolist()


THREE = [[1.0, 2.0], [3.5, 4.0], [-5.0, 6.25]]


@pytest.mark.parametrize(
    "text",
    [
        "1,2\n3.5,4\n-5,6.25\n",
        "1, 2\r\n3.5 ,4\r\n -5,6.25",
        "1;2\n3.5;4\n-5;6.25",
        "1;2\n3,5;4\n-5;6,25",
        "1\t2\n3.5\t4\n-5\t6.25",
        "1 2\n 3.5   4\n-5 6.25 ",
        "x,y\n1,2\n3.5,4\n-5,6.25",
        "X [mm];Y [mm]\n1;2\n3.5;4\n-5;6.25",
        '"x","y"\n1,2\n3.5,4\n-5,6.25',
        "# a comment, with 3 numbers\n\n1,2 # first\n# between\n3.5,4\n-5,6.25\n\n\n",
        "\ufeff1,2\n3.5,4\n-5,6.25",
        "1e0,+2\n35e-1,4.\n-5,6.25",
        "[[1, 2], [3.5, 4], [-5, 6.25]]",
        "[[[1, 2], [3.5, 4], [-5, 6.25]]]",
        '{"strokes": [{"points": [[1, 2], [3.5, 4], [-5, 6.25]]}]}',
        '{"units": "mm", "strokes": [{"points": [[1,2],[3.5,4],[-5,6.25]], "closed": false}]}',
    ],
)
def test_every_form_of_the_same_points(text: str) -> None:
    drawing = points(text)
    assert shape(drawing) == THREE
    assert drawing.paths.closed.tolist() == [False]
    assert (drawing.layers, drawing.used) == (("0",), {"stroke": 1})


def test_utf_16_with_its_mark() -> None:
    drawing = read("1,2\n3.5,4\n-5,6.25".encode("utf-16"), "p.csv", ReadOptions())
    assert shape(drawing) == THREE


def test_empty_lines_part_strokes() -> None:
    drawing = points("0,0\n1,0\n\n  \n5,5\n6,5\n6,6\n5,5\n\n9,9\n9,8")
    assert [len(path.vertices) for path in drawing.paths] == [2, 3, 2]
    assert drawing.paths.closed.tolist() == [False, True, False]
    assert drawing.sources == ("stroke at line 1", "stroke at line 5", "stroke at line 10")


def test_json_says_layer_closing_and_unit() -> None:
    text = json.dumps(
        {
            "units": "in",
            "strokes": [
                {"points": [[0, 0], [1, 0], [1, 1]], "closed": True, "layer": "CUT"},
                {"points": [[5, 5], [6, 5], [5, 5.5]], "layer": "MARK"},
            ],
        }
    )
    drawing = points(text)
    assert drawing.layers == ("CUT", "MARK")
    assert drawing.paths.closed.tolist() == [True, False]
    np.testing.assert_allclose(shape(drawing), [[0, 0], [25.4, 0], [25.4, 25.4]])
    assert (drawing.units.name, drawing.units.mm_per_unit) == ("in", 25.4)
    assert points(text, units="cm").paths[0].vertices[1, 0] == 10.0


def test_the_callers_unit() -> None:
    drawing = points("0,0\n1,0\n1,1", units="in")
    np.testing.assert_allclose(shape(drawing), [[0, 0], [25.4, 0], [25.4, 25.4]])


def test_repeated_points_and_empty_strokes_are_counted() -> None:
    drawing = points("0,0\n0,0\n1,0\n1,0\n1,0\n1,1\n\n7,7\n\n8,8\n8,8")
    assert shape(drawing) == [[0, 0], [1, 0], [1, 1]]
    counts = {(item.kind, item.count, item.reason) for item in drawing.skipped}
    assert counts == {("point of stroke", 3, "is repeated"), ("stroke", 2, "has no length")}


@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        ("1,2\n3", "line 2", "1 fields, wanted x and y"),
        ("1,2\n3,4,5", "line 2", "3 fields"),
        ("1,2\n3,", "line 2, column 3", "'' is no number"),
        ("1,2\n3,abc", "line 2, column 3", "'abc' is no number"),
        ("1,2\n  3,  x4", "line 2, column 7", "'x4' is no number"),
        ("1 2\n3   x4", "line 2, column 5", "'x4' is no number"),
        ("1,2\n\nnan,4", "line 3, column 1", "'nan' is not finite"),
        ("nan,nan\n1,2", "line 1, column 1", "'nan' is not finite"),
        ("1,2\n3,-Infinity", "line 2, column 3", "is not finite"),
        ("1,2\n3,1e999", "line 2, column 3", "'1e999' is not finite"),
        ("1,2\n3,1_000", "line 2, column 3", "is no number"),
        ("1,2\n3,0x10", "line 2, column 3", "is no number"),
        ("1,2\n3,\u0661", "line 2, column 3", "is no number"),
        ("1,2\nx,y", "line 2, column 1", "'x' is no number"),
        ("y,x\n1,2", "line 1", "give x,y"),
        ("x,y,z\n1,2,3", "line 1", "give x,y"),
        ("[[1, 2], [3, 4]", "line 1, column 16", "is no JSON"),
        ('[[1, 2], [3, "4"]]', "[1][1]", "is no number"),
        ("[[1, 2], [3, true]]", "[1][1]", "is no number"),
        ("[[1, 2], [3, 4, 5]]", "[1]", "is no [x, y]"),
        ("[[1, 2], 3]", "[1]", "is no [x, y]"),
        ("[[[1, 2]], 3]", "[1]", "is no list"),
        ("[[1, 1e999], [3, 4]]", "[0][1]", "is not finite"),
        (f"[[1, {'9' * 400}], [3, 4]]", "[0][1]", "is not finite"),
        ("[[1, NaN], [3, 4]]", "", "NaN is not finite"),
        ("{}", "strokes", "is no list"),
        ('{"strokes": [], "unit": "mm"}', "the file", "unknown key 'unit'"),
        ('{"units": "furlong", "strokes": []}', "units", "is no unit"),
        ('{"units": 3, "strokes": []}', "units", "is no unit"),
        ('{"strokes": [3]}', "strokes[0]", "is no object"),
        ('{"strokes": [{"points": [[1, 2]], "color": 3}]}', "strokes[0]", "unknown key 'color'"),
        ('{"strokes": [{"points": [[1, 2]], "closed": 1}]}', "strokes[0].closed", "neither true"),
        ('{"strokes": [{"points": [[1, 2]], "layer": 1}]}', "strokes[0].layer", "is no text"),
        ('{"strokes": [{"points": [], "layer": "a\\nb"}]}', "strokes[0].layer", "is no text"),
        ('{"strokes": [{"points": [], "layer": "\\ud800"}]}', "strokes[0].layer", "is no text"),
        ('{"strokes": [{"points": [[1, 2], [3]]}]}', "strokes[0].points[1]", "is no [x, y]"),
        ("[" * 100_000, "", "nested too deep"),
        ("[]", "", "holds no lines"),
        ("# nothing\n", "", "holds no lines"),
        ("1,2\n3,4\x00", "", "null characters"),
        ("1,2\n1e300,4", "layer 0, stroke at line 1", "away"),
    ],
)
def test_faults_name_their_place(text: str, where: str, message: str) -> None:
    with pytest.raises(DrawingError) as caught:
        points(text)
    error = caught.value
    assert error.file == "p.csv"
    assert (error.where or "") == where
    assert message in str(error)
    assert "\n" not in str(error)


def test_numbers_that_overflow_in_their_unit_are_an_error() -> None:
    with pytest.raises(DrawingError, match="not finite"):
        points("1,2\n1e308,4", units="m")


def test_bytes_that_are_no_text_name_their_line() -> None:
    with pytest.raises(DrawingError, match="line 2: is no text in UTF-8"):
        read(b"1,2\n\xff\xfe,3", "p.csv", ReadOptions())


FLOATS = st.floats(-1e6, 1e6).map(lambda v: round(v, 4))


@given(st.lists(st.tuples(FLOATS, FLOATS), min_size=2, max_size=20), st.sampled_from(",;\t "))
def test_points_come_back_as_they_went(rows: list[tuple[float, float]], sign: str) -> None:
    steps = [math.dist(a, b) for a, b in itertools.pairwise(rows)]
    text = "\n".join(f"{x!r}{sign}{y!r}" for x, y in rows)
    as_json = json.dumps(rows)
    if not steps or max(steps) < 1e-4:
        with pytest.raises(DrawingError):
            points(text)
        return
    one, other = points(text, gap_mm=0.0), points(as_json, gap_mm=0.0)
    np.testing.assert_array_equal(one.paths.vertices, other.paths.vertices)
    found = {tuple(row) for row in one.paths.vertices[:, :2].tolist()}
    assert found <= {(x + 0.0, y + 0.0) for x, y in rows}


@given(st.text("0123456789.,;-+eE \t\n#xyNa\"'[]{}:", max_size=60))
def test_noise_is_read_or_refused(text: str) -> None:
    read_or_refuse(text.encode(), "p.csv", ReadOptions(format="points"))


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=3) | st.integers(),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(["units", "strokes", "points", "closed", "layer", "a"]),
                inner,
                max_size=3,
            )
        ),
        max_leaves=12,
    )
)
def test_any_json_is_read_or_refused(value: object) -> None:
    text = json.dumps(value)
    if text[:1] not in "[{":
        return
    with pytest.raises(DrawingError):
        # Random values hold no stroke of two points: only a clean error may come.
        points(text)


def test_more_lines_than_points_may_be_are_refused_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reader, "MAX_POINTS", 3)
    points("0,0\n1,0\n1,1\n")
    with pytest.raises(DrawingError, match="holds more than 3000000 points"):
        points("0,0\n1,0\n1,1\n0,1\n")
