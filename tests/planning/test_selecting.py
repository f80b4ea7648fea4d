"""What an operation selects by what paths are, against plain words on a drawing of known parts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing, Mark
from camtool.geometry.polylines import Polyline, Polylines, reverse
from camtool.planning.job import Job, Operation, Placement, Tool
from camtool.planning.place import place
from camtool.planning.plan import planned
from camtool.planning.sides import Sides, choose
from camtool.records import replace
from camtool.target.registry import load_target
from tests.drawings import drawing_of

GRBL = load_target("grbl", settings=["axes.x.travel_mm=500", "axes.y.travel_mm=500"]).machine


def box(x: float, y: float, width: float, height: float) -> Polyline:
    corners = [[x, y, 0], [x + width, y, 0], [x + width, y + height, 0], [x, y + height, 0]]
    return Polyline(np.array(corners, dtype=np.float64), closed=True)


def circle(x: float, y: float, diameter: float) -> Polyline:
    r = diameter / 2.0
    return Polyline(np.array([[x - r, y, 1.0], [x + r, y, 1.0]]), closed=True)


NAMES = ("plate", "window", "hole 4", "hole 6", "island", "disc", "line")
"""The paths of the drawing below, in order."""


def drawn() -> Drawing:
    """A plate with a window, in which stands an island, and two holes; a disc beside it; a line;
    a point."""
    paths = [
        box(0, 0, 100, 60),
        box(30, 20, 40, 30),
        circle(10, 10, 4),
        circle(90, 10, 6),
        box(45, 30, 10, 10),
        circle(130, 30, 20),
        Polyline(np.array([[0, 80, 0], [50, 80, 0.0]]), closed=False),
    ]
    sources = ("A 1", "B 2", "CIRCLE 2F", "CIRCLE 30", "B 5", "CIRCLE 31", "LINE 7")
    marks = (Mark((5.0, 50.0), "0", "", "POINT 9"),)
    return replace(drawing_of(paths), sources=sources, marks=marks)


def taken(
    operation: Operation, drawing: Drawing | None = None, job: Job | None = None
) -> list[str]:
    """The names of the paths that an operation takes, and "point"."""
    job = replace(job or Job(), operations=(operation,))
    placed = place(drawing or drawn(), job)
    chosen = choose(placed, operation, Sides.of(placed, job, 1.0))
    return [NAMES[row] for row in chosen.source.tolist()] + ["point"] * len(chosen.points)


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ((), [*NAMES, "point"]),
        (("closed",), ["plate", "window", "hole 4", "hole 6", "island", "disc"]),
        (("open",), ["line"]),
        (("outer",), ["plate", "island", "disc"]),
        (("inner",), ["window", "hole 4", "hole 6"]),
        (("circle",), ["hole 4", "hole 6", "disc"]),
        (("inner", "circle"), ["hole 4", "hole 6"]),
        (("circle", "outer"), ["disc"]),
        (("inner", "not circle"), ["window"]),
        (("closed", "not circle"), ["plate", "window", "island"]),
        (("point",), ["point"]),
    ],
)
def test_words(words: tuple[str, ...], names: list[str]) -> None:
    assert taken(Operation(select=words)) == names


def test_sizes_areas_and_names() -> None:
    inf = float("inf")
    assert taken(Operation(size_mm=(4.0, 6.0))) == ["hole 4", "hole 6"]
    assert taken(Operation(size_mm=(0.0, 4.0))) == ["hole 4"]
    assert taken(Operation(size_mm=(40.0, 100.0))) == ["plate", "window", "line"]
    assert taken(Operation(area_mm2=(1000.0, inf))) == ["plate", "window"]
    assert taken(Operation(area_mm2=(0.0, inf))) == [*NAMES[:-1]]
    assert taken(Operation(entities=("2f", "point*", "7"))) == ["hole 4", "line", "point"]
    assert taken(Operation(entities=("CIRCLE 3?",))) == ["hole 6", "disc"]
    assert taken(Operation(select=("circle",), size_mm=(5.0, inf), entities=("3?",))) == [
        "hole 6",
        "disc",
    ]


def test_sizes_are_those_of_the_part() -> None:
    job = Job(placement=Placement(scale=2.0))
    assert taken(Operation(select=("circle",), size_mm=(8.0, 12.0)), job=job) == [
        "hole 4",
        "hole 6",
    ]


@given(st.sampled_from([None, "x", "y"]), st.floats(-3.0, 3.0), st.booleans())
def test_turning_and_mirroring_change_nothing(
    mirror: str | None, angle: float, turned: bool
) -> None:
    job = Job(placement=Placement(mirror=mirror, rotate_rad=angle))
    drawing = drawn()
    if turned:
        drawing = replace(drawing, paths=Polylines.of(map(reverse, drawing.paths)))
    for words in (("inner",), ("outer",), ("circle", "inner"), ("closed", "not circle")):
        operation = Operation(select=words)
        assert taken(operation, drawing, job) == taken(operation)
    sized = Operation(area_mm2=(100.0, 1300.0))
    assert taken(sized, drawing, job) == taken(sized)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"select": ("open", "closed")}, "nothing is open and closed"),
        ({"select": ("inner", "outer")}, "nothing is outer and inner"),
        ({"select": ("point", "circle")}, "nothing is point and circle"),
        ({"select": ("circle", "not circle")}, "nothing is circle and not circle"),
        ({"select": ("round",)}, "unknown word to select by 'round'"),
        ({"size_mm": (8.0, 3.0)}, "8 to 3 is no range"),
        ({"area_mm2": (-1.0, 3.0)}, "-1 to 3 is no range"),
        ({"size_mm": (float("nan"), 3.0)}, "is no range"),
    ],
)
def test_contradictions_are_refused(settings: dict[str, object], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        Operation(**settings)  # type: ignore[arg-type]


def test_an_operation_that_selects_nothing_is_refused() -> None:
    with pytest.raises(OptionError, match="nothing is circle and of size 7 to 8 mm"):
        taken(Operation(select=("circle",), size_mm=(7.0, 8.0)))


def test_sides_do_not_depend_on_who_cuts_what() -> None:
    """A job with one operation cuts the same as one with an operation each for holes, inner and
    outer contours."""
    tool = Tool(diameter_mm=3.0)
    whole = drawn()
    closed = replace(whole, marks=())
    words = (("inner", "circle"), ("inner", "not circle"), ("outer",))
    parted = Job(operations=tuple(Operation(select=each, tool=tool) for each in words))
    together = Job(operations=(Operation(select=("closed",), tool=tool),))
    one, other = (planned(closed, job, GRBL) for job in (parted, together))

    def cuts(plan: object) -> set[tuple[str, tuple[float, ...]]]:
        path = plan.toolpath  # type: ignore[attr-defined]
        low = path.is_feed & (path.end[:, 2] < 0.0)
        return {
            (path.text(row), tuple(path.end[row].round(6))) for row in np.flatnonzero(low).tolist()
        }

    assert {name for name, _ in cuts(one)} == {name for name, _ in cuts(other)}
    boxes = [
        {
            name: tuple(np.ptp([p for n, p in cuts(plan) if n == name], axis=0).round(6))
            for name, _ in cuts(plan)
        }
        for plan in (one, other)
    ]
    assert boxes[0] == boxes[1]
