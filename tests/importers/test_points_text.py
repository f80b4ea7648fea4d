"""Points as text: decimal commas, quoted fields, units and bulges in the names of columns."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import path_lengths
from camtool.importers.options import ReadOptions
from camtool.importers.points.reader import read


def points(text: str, **options: object) -> Drawing:
    return read(text.encode(), "p.csv", ReadOptions(**options))


def shape(drawing: Drawing, index: int = 0) -> list[list[float]]:
    return drawing.paths[index].vertices[:, :2].tolist()


TWO = [[1.5, 2.25], [3.0, 4.05]]


@pytest.mark.parametrize(
    "text",
    [
        "1,5;2,25\n3;4,05",
        "1,5\t2,25\n3\t4,05",
        "1,5 2,25\n3 4,05",  # 3 has no comma: blanks part the fields
        "1,5 2,25\n3,0 4,05",  # 4,05 is a decimal: nobody writes 05
        '"1,5","2,25"\n"3","4,05"',
        '"1,5";"2,25"\n"3";"4,05"',
        "1.5,\t2.25\n3,\t4.05",
        "x;y\n1,5;2,25\n3;4,05\n;\n;;\n",
        "% of Octave\n1.5 2.25 % here\n3 4.05",
        " 1,5 ; 2,25 \n 3 ;4,05",
    ],
)
def test_the_comma_is_read_as_what_it_is(text: str) -> None:
    assert shape(points(text)) == TWO


def test_a_comma_that_parts_is_no_decimal_sign() -> None:
    assert shape(points("1,5\n2,25\n")) == [[1.0, 5.0], [2.0, 25.0]]
    assert shape(points("1, 5\n2, 25\n")) == [[1.0, 5.0], [2.0, 25.0]]


@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        ("1,5 2,5\n3,5 4,5", "line 1", "or two points x,y; separate x and y by a semicolon"),
        ("1,5,2,5\n3,5,4,5", "line 1", "4 fields, wanted x and y; if the comma is the decimal"),
        ("1,5;2.5\n3;4", "line 1", "decimal comma (line 1) and a decimal point (line 1)"),
        ("1,5;2\n3;4\n5.5;6", "line 3", "decimal comma (line 1) and a decimal point (line 3)"),
        ("1.5\t2\n3\t4,25", "line 2", "decimal comma (line 2) and a decimal point (line 1)"),
        ('"1,5","2"\n"3.5","4"', "line 2", "decimal comma (line 1)"),
        ("1;2\n1.234,5;3", "line 2", "decimal comma (line 2)"),
        ("1;2\n1,234,567;3", "line 2, column 1", "'1,234,567' is no number"),
        ("1,5;2\n3,5", "line 2", "1 fields"),
        ("x [mm],y [in]\n1,2\n3,4", "line 1", "different units"),
        ("x [mm],y\n1,2\n3,4", "line 1", "different units"),
        ("x [ell],y [ell]\n1,2\n3,4", "line 1", "'ell' is no unit"),
        ("x,y,bulge\n1,2\n3,4", "line 2", "2 fields, wanted x, y and bulge"),
        ("bulge,x,y\n1,2,0\n3,4,0", "line 1", "give x,y or x,y,bulge"),
        ("1;1e999\n2;3", "line 1, column 3", "is not finite"),
    ],
)
def test_what_cannot_be_told_is_refused(text: str, where: str, message: str) -> None:
    with pytest.raises(DrawingError) as caught:
        points(text)
    assert caught.value.where == where
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("names", "unit", "size"),
    [
        ("x [in],y [in]", "in", 25.4),
        ("X (cm);Y (cm)", "cm", 10.0),
        ("x_um\ty_um", "um", 0.001),
        ("x/mm,y/mm", "mm", 1.0),
        ("x_pos,y_pos", "mm", 1.0),
        ("X-Position,Y-Position", "mm", 1.0),
        ("east,north", "mm", 1.0),
    ],
)
def test_columns_may_name_their_unit(names: str, unit: str, size: float) -> None:
    sign = next(sign for sign in ";\t," if sign in names)
    drawing = points(f"{names}\n1{sign}2\n3{sign}4\n")
    assert (drawing.units.name, drawing.units.mm_per_unit) == (unit, size)
    np.testing.assert_allclose(shape(drawing), [[size, 2 * size], [3 * size, 4 * size]])
    assert points(f"{names}\n1{sign}2\n3{sign}4\n", units="mm").paths[0].vertices[1, 0] == 3.0


def test_a_column_of_bulges() -> None:
    circle = points("x,y,bulge\n0,0,1\n2,0,1\n0,0,0\n")
    assert circle.paths.closed.tolist() == [True]
    assert path_lengths(circle.paths)[0] == pytest.approx(2.0 * math.pi)
    # Three quarters of a circle: the bulge tan(270°/4) is above 1 and is cut in two.
    most = points(f"x;y;bulge\n1;0;{math.tan(3 * math.pi / 8)}\n0;-1;0")
    assert path_lengths(most.paths)[0] == pytest.approx(1.5 * math.pi)
    assert np.abs(most.paths.vertices[:, 2]).max() <= 1.0


REALS = st.floats(-1e4, 1e4).map(lambda value: round(value, 4))


def decimal(value: float, sign: str) -> str:
    return repr(value).replace(".", sign)


@given(
    st.lists(st.tuples(REALS, REALS), min_size=2, max_size=12),
    st.sampled_from([(";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), ("  ", ".")]),
    st.sampled_from(["", "x{0}y\n", "# made\n"]),
    st.sampled_from(["\n", "\r\n"]),
)
def test_every_dialect_gives_the_same_points(
    rows: list[tuple[float, float]], dialect: tuple[str, str], head: str, end: str
) -> None:
    if max(math.dist(a, b) for a, b in itertools.pairwise(rows)) < 1e-4:
        return
    sign, point = dialect
    lines = [sign.join(decimal(value, point) for value in row) for row in rows]
    told = points(head.format(sign.strip(" ") or " ") + end.join(lines), gap_mm=0.0)
    plain = points("\n".join(f"{x!r},{y!r}" for x, y in rows), gap_mm=0.0)
    np.testing.assert_array_equal(told.paths.vertices, plain.paths.vertices)


@given(st.lists(st.tuples(REALS, REALS), min_size=2, max_size=6))
def test_blanks_and_commas_are_right_or_refused(rows: list[tuple[float, float]]) -> None:
    """No choice of numbers makes decimal commas between blanks come out as other points."""
    if max(math.dist(a, b) for a, b in itertools.pairwise(rows)) < 1e-4:
        return
    text = "\n".join(f"{decimal(x, ',')} {decimal(y, ',')}" for x, y in rows)
    plain = points("\n".join(f"{x!r},{y!r}" for x, y in rows), gap_mm=0.0)
    try:
        drawing = points(text, gap_mm=0.0)
    except DrawingError as error:
        refused = error.message
    else:
        refused = "two points"
        np.testing.assert_array_equal(drawing.paths.vertices, plain.paths.vertices)
    assert "two points" in refused
