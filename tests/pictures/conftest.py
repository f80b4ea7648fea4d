"""Scenes that the tests of this folder draw."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from camtool.geometry.drawing import Drawing, Gap, Units
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.pictures.scene import Scene, StockPair, scene_of_drawing, stock_pair
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath

NASTY = "a <b> & \"c\" 'd'\n]]> \x00\x0b\ud800 ñ ☃"


def line(*points: tuple[float, ...], closed: bool = False) -> Polyline:
    return Polyline(np.array([(*point, 0.0)[:3] for point in points], dtype=float), closed)


def circle(x: float, y: float, radius: float) -> Polyline:
    return line((x + radius, y, 1.0), (x - radius, y, 1.0), closed=True)


def scene_of_toolpath(toolpath: Toolpath, *, title: str, drawing: Drawing | None = None) -> Scene:
    """A toolpath with a note of its moves, over its drawing with its size."""
    moves, feeds = int(toolpath.is_motion.sum()), int(toolpath.is_feed.sum())
    sizes = () if drawing is None else scene_of_drawing(drawing).notes
    notes = (*sizes, f"{moves} moves, {feeds} of them at a feed")
    return Scene(title=title, toolpath=toolpath, drawing=drawing, notes=notes)


def drawing_of(paths: list[Polyline], layers: list[str], gaps: tuple[Gap, ...] = ()) -> Drawing:
    empty = ("",) * len(paths)
    return Drawing(
        Polylines.of(paths), tuple(layers), empty, empty, "part.dxf", Units("mm", 1.0, ""),
        gaps=gaps,
    )  # fmt: skip


def followed(drawing: Drawing) -> Toolpath:
    """A toolpath that follows the paths of a drawing."""
    builder = ToolpathBuilder().rapid(z=0.5)
    for path in drawing.paths:
        builder.rapid(*path.start).line(z=-0.1, feed=5.0)
        segments = Segments.of(path)
        for row in range(len(segments)):
            x, y = segments.end[row].tolist()
            if segments.bulge[row] == 0.0:
                builder.line(x, y, feed=10.0)
            else:
                cx, cy = segments.centre[row].tolist()
                builder.arc(x, y, centre=(cx, cy), ccw=bool(segments.bulge[row] > 0), feed=10.0)
        builder.rapid(z=0.5)
    return builder.rapid(0.0, 0.0).finish()


def cut_by(toolpath: Toolpath, tool_mm: float) -> Callable[[], StockPair]:
    """The stock that a toolpath cuts with a flat tool."""
    tools = np.zeros(len(toolpath), dtype=np.int64)
    cutter = CutterProfile(0.5 * tool_mm, 0.5 * tool_mm)
    return lambda: stock_pair(stock_moves_of_toolpath(toolpath, tools, (cutter,)), None, None)


def ring_trace(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A path to a circle about (2.5, 2.5) and round it, with errors that change quickly."""
    turn = np.linspace(0.0, 2.0 * math.pi, count)
    wave = 0.01 + 0.009 * np.sin(1.7 * np.arange(count))
    radius = 2.0 + 0.5 * wave
    points = 2.5 + radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return (
        np.concatenate([[[0.0, 0.0], points[0]], points]),
        np.concatenate([[math.nan, math.nan], wave]),
        np.concatenate([[False, False], np.ones(count, dtype=bool)]),
    )


def plate() -> Drawing:
    outline = line((0.5, 0.5), (4.5, 0.5, 0.4), (4.5, 4.5), (0.5, 4.5, -0.2), closed=True)
    return drawing_of([outline, circle(2.5, 2.5, 1.0)], ["outline", "holes"])


def make_scenes() -> dict[str, Scene]:
    points, error, cutting = ring_trace(400)
    tiny = drawing_of([circle(0.25, 0.25, 0.25)], ["0"])
    wide = drawing_of([line((0, 0), (10, 0, 1), (10, 1), (0, 1, 1), closed=True)], [NASTY])
    many = drawing_of(
        [circle(x, y, 20.0) for x in range(0, 500, 50) for y in range(0, 500, 50)],
        [f"layer with a rather long name, number {k % 12}" for k in range(100)],
    )
    open_line = drawing_of([line((1, 1), (4, 1))], [""], (Gap((4.0, 1.0), 0.2, ""),))
    far = drawing_of([line((-1000.5, 5000), (-999.5, 5000), (-999.5, 5010))], ["far"])
    short = ToolpathBuilder().line(1.0, 0.0, feed=5.0).line(2.0, 1.0, -0.2, feed=5.0).finish()
    return {
        "drawing": scene_of_drawing(plate()),
        "toolpath": scene_of_toolpath(followed(plate()), title="path", drawing=plate()),
        "result": Scene(
            "Plate: predicted result",
            plate(),
            followed(plate()),
            points,
            error,
            cutting,
            (22.0, 22.0),
            ("4 × 4.33 mm · 2 contours", "error: max 19 µm, rms 12 µm"),
        ),
        "tiny": scene_of_toolpath(followed(tiny), title="tiny", drawing=tiny),
        "wide": Scene(NASTY, wide, notes=(NASTY, "word " * 60, "x" * 300)),
        "many": scene_of_drawing(many),
        "many paths": scene_of_toolpath(followed(many), title="many", drawing=many),
        "far": scene_of_drawing(far),
        "line": scene_of_drawing(open_line),
        "ramp": scene_of_toolpath(short, title="ramp"),
        "no error": Scene("", None, None, points, np.zeros(len(points)), cutting),
        "huge error": Scene("", None, None, points, np.full(len(points), 12.5), cutting),
        "empty": Scene(""),
        "empty trace": Scene(
            "e", None, None, np.empty((0, 2)), np.empty(0), np.empty(0, dtype=bool)
        ),
        "empty toolpath": Scene("e", toolpath=ToolpathBuilder().finish()),
    }


SCENES = make_scenes()


@pytest.fixture(params=list(SCENES))
def scene(request: pytest.FixtureRequest) -> Scene:
    """Each scene in turn."""
    return SCENES[request.param]


@pytest.fixture
def scenes() -> dict[str, Scene]:
    """All scenes by name."""
    return SCENES
