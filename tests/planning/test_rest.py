"""Rest machining: what a smaller tool clears behind a wider one, and the floors of carvings."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.planning.air import REST_OVERLAP
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Step
from camtool.planning.job import Job, Operation, Tool
from camtool.planning.plan import planned
from tests.drawings import drawing_of
from tests.oracles.run_sweep import dense, swept
from tests.strategies import examples

SLACK = 0.02
WIDE, FINE = Tool(1.0), Tool(0.4)
V = Tool(6.0, "v", math.radians(60.0))


def polygon(corners: list[tuple[float, float]], angle: float, mirrored: bool) -> Polyline:
    cos, sin = math.cos(angle), math.sin(angle)
    points = np.array(corners) @ np.array([[cos, sin], [-sin, cos]])
    points[:, 0] *= -1.0 if mirrored else 1.0
    return Polyline(np.column_stack([points, np.zeros(len(points))]), closed=True)


def steps_of(machine: Machine, path: Polyline, *operations: Operation) -> tuple[Step, ...]:
    return planned(drawing_of([path]), Job(operations), machine).steps


def pockets(**more: object) -> tuple[Operation, Operation]:
    wide = Operation(kind="pocket", name="wide", tool=WIDE, depth_mm=0.5)
    return wide, Operation(kind="pocket", name="fine", tool=FINE, rest="wide", **more)  # type: ignore[arg-type]


def length_of(step: Step) -> float:
    return sum(float(np.hypot(*np.diff(dense(r)[:, :2], axis=0).T).sum()) for r in step.runs)


SHAPES = {
    "box": [(0, 0), (4, 0), (4, 3), (0, 3)],
    "wedge": [(0, 0), (5, 0), (0, 3)],
    "neck": [(0, 0), (3, 0), (3, 1), (5, 1.2), (5, 1.8), (3, 2), (3, 3), (0, 3)],
    "star": [(0, 3), (1, 1), (3, 0), (1, -1), (0, -3), (-1, -1), (-3, 0), (-1, 1)],
}


@examples(12)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    angle=st.floats(0.0, 6.0),
    mirrored=st.booleans(),
    reverse=st.booleans(),
    pattern=st.sampled_from(["contour", "zigzag"]),
)
def test_both_together_clear_what_the_smaller_one_alone_does(
    machine: Machine, shape: str, angle: float, mirrored: bool, reverse: bool, pattern: str
) -> None:
    corners = SHAPES[shape][:: -1 if reverse else 1]
    path = polygon(corners, angle, mirrored)
    wide, fine = steps_of(machine, path, *pockets(pattern=pattern))
    (alone,) = steps_of(machine, path, Operation(kind="pocket", tool=FINE, depth_mm=0.5))
    region = shapely.Polygon(path.vertices[:, :2])
    first, second = (swept(each.runs, each.operation.tool.radius_mm) for each in (wide, fine))
    # What is opened by a disc is what a tool of this size can clear at all.
    reachable = region.buffer(-0.2).buffer(0.2, quad_segs=64)
    assert second.within(region.buffer(SLACK))
    both = shapely.union(first, second)
    missing = reachable.buffer(-SLACK).difference(both.buffer(SLACK))
    assert missing.area < 1e-9
    assert swept(alone.runs, 0.2).buffer(-SLACK).difference(both.buffer(SLACK)).area < 1e-9
    assert length_of(fine) < 0.5 * length_of(alone)
    # No disc of it lies where the wider tool had been, but for the overlap.
    centres = shapely.points(np.concatenate([dense(run)[:, :2] for run in fine.runs]))
    overlapped = 0.5 * (1.0 + REST_OVERLAP)
    cleared = region.buffer(-overlapped, quad_segs=64).buffer(overlapped, quad_segs=64)
    assert not shapely.contains(cleared.buffer(-0.2 - SLACK), centres).any()
    assert not [each for each in wide.findings if each.code == PlanningCode.UNREACHED]


def test_a_rest_of_nothing_says_so(machine: Machine) -> None:
    circle = Polyline(np.array([[0, 0, 1.0], [5, 0, 1.0]]), closed=True)
    _, fine = steps_of(machine, circle, *pockets())
    assert [each.code for each in fine.findings] == [PlanningCode.NO_REST]
    assert not len(fine.runs)


@examples(6)
@given(angle=st.floats(0.0, 6.0), mirrored=st.booleans(), first=st.booleans())
def test_the_flat_floor_of_a_carving_is_cleared_beside_its_slopes(
    machine: Machine, angle: float, mirrored: bool, first: bool
) -> None:
    depth = 0.8
    path = polygon([(0, 0), (9, 0), (9, 6), (0, 6)], angle, mirrored)
    sign = Operation(kind="vcarve", name="sign", tool=V, depth_mm=depth)
    floor = Operation(kind="pocket", name="floor", tool=WIDE, rest="sign", step_down_mm=0.4)
    steps = steps_of(machine, path, *((floor, sign) if first else (sign, floor)))
    carved, cleared = steps[::-1] if first else steps
    region = shapely.Polygon(path.vertices[:, :2])
    flat = region.buffer(-depth * math.tan(math.radians(30.0)))
    done = swept(cleared.runs, 0.5)
    assert done.within(flat.buffer(SLACK))
    assert flat.buffer(-0.5).buffer(0.5 - SLACK).within(done.buffer(SLACK))
    assert cleared.setting.levels_mm == pytest.approx([-0.4, -0.8])
    assert not [each for each in carved.findings if each.code == PlanningCode.DEPTH_LIMITED]


def test_a_bit_that_is_not_wide_enough_for_the_depth_has_a_higher_floor(machine: Machine) -> None:
    path = polygon([(0, 0), (9, 0), (9, 6), (0, 6)], 0.0, False)
    narrow = Tool(1.0, "v", math.radians(60.0), 0.2)
    sign = Operation(kind="vcarve", name="sign", tool=narrow, depth_mm=2.0)
    floor = Operation(kind="pocket", name="floor", tool=WIDE, rest="sign")
    carved, cleared = steps_of(machine, path, sign, floor)
    deep = 0.4 / math.tan(math.radians(30.0))
    assert cleared.setting.levels_mm == pytest.approx([-deep])
    assert carved.runs.vertices[:, 2].min() == pytest.approx(-deep)
    assert swept(cleared.runs, 0.5).bounds == pytest.approx((0.4, 0.4, 8.6, 5.6), abs=1e-6)


@pytest.mark.parametrize(
    ("other", "more", "words"),
    [
        ({}, {"rest": "wied"}, "no operation 'wied'; name one of: wide"),
        ({"kind": "profile"}, {}, "'wide' is no pocket"),
        ({}, {"tool": Tool(1.0)}, "a tool of 1 mm reaches no more than that of 1 mm"),
        ({}, {"depth_mm": 0.6}, "it is 0.6 mm deep, and 'wide' 0.5 mm"),
        ({"allowance_mm": 0.1}, {}, "leaves 0.1 mm on all walls"),
        ({}, {"layers": ("CUT",)}, "of its own too; leave these out"),
        ({}, {"finish_mm": 0.05}, "a rest has no finishing pass"),
        ({"kind": "vcarve", "tool": V}, {"tool": V}, "a flat floor is for an end mill"),
    ],
)
def test_what_leaves_no_rest(
    other: dict[str, object], more: dict[str, object], words: str
) -> None:
    first = {"kind": "pocket", "name": "wide", "tool": WIDE, "depth_mm": 0.5} | other
    rest = {"kind": "pocket", "name": "fine", "tool": FINE, "rest": "wide"} | more
    with pytest.raises(OptionError) as raised:
        Job((Operation(**first), Operation(**rest)))  # type: ignore[arg-type]
    assert words in str(raised.value)
    assert "key rest" in (raised.value.where or "")


def test_a_pocket_is_no_rest_of_a_later_one() -> None:
    wide, fine = pockets()
    with pytest.raises(OptionError, match="there is no operation 'wide'"):
        Job((fine, wide))
