"""The Matlab router's arrays: the thesis' star, layouts, faults with their lines, and noise."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.importers.options import ReadOptions
from camtool.importers.points.reader import read
from camtool.importers.read import read_drawing
from tests.fuzz.reading import read_or_refuse

# Thesis on the Matlab router, L3196-3228.
XY = """xy =
[   151   400   630   575   815   501   400   294     6   220   153;
    86   265    86   431   639   642   999   645   665   428    86  ]
"""
LXY = """lxy =
[   249   230    55   240   314   101   106   288   214    67;
   179   179   345   208     3   357   354    20   237   342  ]
"""
VELXY = """velxy =
[   480   480   -77   480  -480  -136  -144  -480   433   -94;
   345  -374   480   416     5   480  -480    33  -480  -480 ]
"""
FIRST = "first_pointx = 151;\nfirst_pointy = 86\n"

SAMPLES = Path(__file__).parents[2] / "samples"


def points(text: str, **options: object) -> Drawing:
    return read(text.encode(), "p.m", ReadOptions(**options))


def lines(name: str, array: np.ndarray) -> str:
    rows = ";\n".join(" ".join(f"{value:g}" for value in row) for row in array)
    return f"{name} = [{rows}];\n"


def star() -> np.ndarray:
    return read_drawing(SAMPLES / "star.csv").paths[0].vertices


@pytest.mark.parametrize(
    "text",
    [
        XY,
        XY + LXY + VELXY,
        FIRST + LXY + VELXY,
        XY + LXY + VELXY + FIRST + "size_of_array = 10\n",
        "% star\nclear all; clc\nglobal size_of_array lx ly\nsize_of_array=10;" + XY,
        "%{\nxy = [1 2\n%}\n" + XY.replace("400   630", "400 ... and on\n 630"),
        XY.replace("   ", ", ").replace("[, ", "[ "),
    ],
)
def test_the_star_of_the_thesis(text: str) -> None:
    drawing = points(text)
    np.testing.assert_allclose(drawing.paths[0].vertices, star(), atol=1e-9)
    assert drawing.units.mm_per_unit == 0.1
    assert "tenths of a millimetre" in drawing.units.why


def test_arrays_may_stand_on_their_side_or_come_in_parts() -> None:
    xy = np.array([[0, 10, 10], [0, 0, 20]])
    length, speed = np.array([[10, 0], [0, 20]]), np.array([[480, 0], [0, 480]])
    wanted = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]
    parts = lines("x_points", xy[:1]) + lines("y_points", xy[1:].T)
    for text in (
        lines("xy", xy),
        lines("xy", xy.T),
        parts,
        parts + lines("xy", xy),
        lines("xy", xy.T) + lines("lxy", length.T) + lines("velxy", speed.T),
        "first_pointx = 0, first_pointy = 0\n"
        + "".join(
            lines(name, row[None, :])
            for name, row in zip(("lx", "ly", "velx", "vely"), [*length, *speed], strict=True)
        ),
    ):
        np.testing.assert_allclose(points(text).paths[0].vertices[:, :2], wanted)


def test_two_points_stand_as_the_router_has_them() -> None:
    drawing = points("xy = [0 30; 0 40]")
    assert drawing.paths[0].end.tolist() == [3.0, 4.0]
    assert points("xy = [0 30; 0 40]", units="in").paths[0].end[0] == pytest.approx(762.0)


@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        ("xy = xy*100;", "line 1", "set to 'xy'; camtool reads numbers only"),
        (XY + "xy = round(xy)", "line 4", "assigned twice"),
        ("a = 3\n" + XY, "line 1", "'a' is none of the known arrays"),
        (XY + "\n\nplot(xy)", "line 6", "'plot' is none of the known arrays"),
        (XY + "s = 'system(1)'", "line 4", "'s' is none"),
        ("lx(1) = 3", "line 1", "lx is followed by '('"),
        ("xy = [1 2; 3 4]'", "line 1", 'goes on with "\'"'),
        ("xy = [1 2; 3 4]*10", "line 1", "goes on with '*'"),
        ("xy = [1-2 3; 3 4]", "line 1", "a calculation with -2"),
        ("xy = [1 - 2; 3 4]", "line 1", "'-' stands in an array"),
        ("xy = [1 2\n3 4 5]", "line 2", "a row has 3 numbers, the first one 2"),
        ("xy = [1 2 3\n3 4 NaN]", "line 2", "NaN is not finite"),
        ("xy = [1 2 -Inf\n3 4 5]", "line 1", "-Inf is not finite"),
        ("xy = [1 2 3\n3 4 1e999]", "line 2", "1e999 is not finite"),
        ("xy = [1 2 3\n3 4 0x10]", "line 2", "stands in an array"),
        ("xy = [1 2 3\n3 4 5", "line 2", "not closed"),
        ("xy = []", "line 1", "an array is empty"),
        ("xy = [1 2 3; 4 5 6; 7 8 9]", "line 1", "3 rows and 3 columns, wanted 2 rows"),
        ("xy =", "line 1", "xy is set to nothing"),
        ("xy", "line 1", "xy is followed by nothing"),
        ("first_pointx = [1 2]\n" + XY, "line 1", "no single number"),
        ("x_points = [1 2 3]", "line 1", "x_points has no y_points"),
        ("x_points = [1 2 3]\ny_points = [1 2]", "line 1", "differ in length"),
        ("x_points = [1 2; 3 4]", "line 1", "more than one row"),
        (XY + LXY.replace("249", "248"), "line 4", "lxy are not the lengths"),
        (XY + VELXY.replace("-77", "77"), "line 4", "velxy has not the directions"),
        (XY + "size_of_array = 11", "line 4", "size_of_array is 11, there are 10 lines"),
        (XY + "first_pointy = 200", "line 4", "first_pointy is 200, xy begins at 86"),
        (FIRST + LXY.replace("55", "-55") + VELXY, "line 3", "a length is negative"),
        (FIRST + LXY + VELXY.replace(" 5 ", " 0 "), "line 6", "line 5 of the job has a length"),
        ("lxy = [1 2 3; 4 5 6]\nvelxy = [1 2; 3 4; 5 6]", "line 2", "another one two columns"),
        (LXY + VELXY, None, "assigns no points; give xy"),
        (LXY, None, "assigns no points"),
        ("% nothing\n", None, "assigns no points"),
    ],
)
def test_faults_name_their_line(text: str, where: str | None, message: str) -> None:
    with pytest.raises(DrawingError) as caught:
        points(text)
    assert caught.value.where == where
    assert message in str(caught.value)


UNITS = st.integers(0, 3000)


@given(st.lists(st.tuples(UNITS, UNITS), min_size=3, max_size=12), st.booleans())
def test_points_come_back_from_all_arrays(rows: list[tuple[int, int]], sideways: bool) -> None:
    xy = np.array(rows).T
    steps = np.diff(xy, axis=1)
    text = lines("xy", xy.T if sideways else xy)
    if not steps.any():
        return
    told = points(text, gap_mm=0.0)
    plain = "\n".join(f"{x},{y}" for x, y in rows)
    wanted = read(plain.encode(), "p.csv", ReadOptions(gap_mm=0.0))
    np.testing.assert_allclose(told.paths.vertices, 0.1 * wanted.paths.vertices)
    job = f"first_pointx={rows[0][0]}\nfirst_pointy={rows[0][1]}\n"
    job += lines("lxy", np.abs(steps)) + lines("velxy", 480 * np.sign(steps))
    again = points(job, gap_mm=0.0)
    np.testing.assert_array_equal(again.paths.vertices, told.paths.vertices)


PARTS = st.sampled_from(
    ["xy", "lxy", "velx", " = ", "[", "]", ";", "\n", ",", " 1", " -2.5", "1e3", "...", "%",
     "%{\n", "'", "(", "NaN", "first_pointx", "clear", "\t", "e", ".", "=", "[0 1 2; 0 3 4]"]
)  # fmt: skip


@given(st.lists(PARTS, max_size=25).map("".join))
def test_noise_is_read_or_refused(text: str) -> None:
    read_or_refuse(text.encode(), "p.m", ReadOptions(format="points"))
