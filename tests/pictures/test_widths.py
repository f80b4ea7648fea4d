"""How wide pictures draw a tool: as it cuts at the surface."""

import numpy as np
import pytest

from camtool.geometry.polylines import Polyline
from camtool.pictures.scene import scene_of
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, Operation, Tool
from camtool.target.registry import load_target
from tests.drawings import drawing_of

CORNERS = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0.0]]
SQUARE = Polyline(np.array(CORNERS), closed=True)
BIT = Tool(6.0, "v", 1.5707963267948966)


def width(*operations: Operation) -> float | None:
    """The width that the picture of these operations has."""
    job, target = Job(operations), load_target("linuxcnc")
    run = post_drawing(drawing_of([SQUARE]), job, target, check=False)
    return scene_of(title="", drawing=drawing_of([SQUARE]), job=job, toolpath=run.decoded).tool_mm


@pytest.mark.parametrize(
    ("operation", "wide"),
    [
        (Operation("engrave", tool=BIT, depth_mm=0.5), 1.0),
        (Operation("engrave", tool=BIT, depth_mm=1.0, step_down_mm=0.3), 2.0),
        (Operation("engrave", tool=BIT, depth_mm=4.0), 6.0),
        (Operation("engrave", tool=Tool(2.0, "ball"), depth_mm=1.0), 2.0),
        (Operation("engrave", tool=Tool(2.0), depth_mm=0.1), 2.0),
        (Operation("vcarve", tool=BIT, depth_mm=2.0), None),
    ],
)
def test_a_bit_is_as_wide_as_it_cuts_at_its_depth(
    operation: Operation, wide: float | None
) -> None:
    found = width(operation)
    assert found == (None if wide is None else pytest.approx(wide))


def test_several_depths_of_several_operations_have_no_single_width() -> None:
    shallow = Operation("engrave", "one", tool=BIT, depth_mm=0.5)
    deep = Operation("engrave", "two", tool=BIT, depth_mm=1.0)
    assert width(shallow, deep) is None
