"""Sides by nesting: over the whole drawing, whatever is chosen of it and whoever cuts it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, Unchosen, Units
from camtool.geometry.findings import ContourCode
from camtool.geometry.measure import extents, sample
from camtool.geometry.polylines import Polyline, Polylines
from camtool.importers.assemble import assemble
from camtool.importers.options import ReadOptions, Selection
from camtool.importers.pieces import Piece
from camtool.machine.model import Machine
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Contour
from camtool.planning.job import Job, Operation, Stock, Tool, job_of
from camtool.planning.plan import planned
from camtool.planning.sides import Sides, choose
from camtool.records import replace
from camtool.toolpath.findings import ProgramCode
from tests.strategies import examples

LAYERS = ("A", "B", "C", "D")
D = 0.5


def _box(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0.0]])


def _circle(x: float, y: float, radius: float) -> np.ndarray:
    return np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]])


def _read(
    shapes: Sequence[np.ndarray],
    on: Sequence[str],
    types: Sequence[str] = (),
    **select: tuple[str, ...],
) -> Drawing:
    rows = enumerate(zip(shapes, on, types or ("",) * len(shapes), strict=True))
    pieces = [
        Piece(shape, True, layer, "#000000", f"PATH {k}", kind) for k, (shape, layer, kind) in rows
    ]
    return assemble(
        pieces,
        file="test.dxf",
        units=Units("mm", 1.0, "in a test"),
        used={},
        skipped=[],
        findings=[],
        options=ReadOptions(select=Selection(**select)),
    )


def _sides(drawing: Drawing, job: Job) -> dict[str, bool]:
    """By the name of each chosen contour: whether the tool runs outside."""
    sides = Sides.of(drawing, job, 1.0)
    found = {}
    for operation in job.operations:
        chosen = choose(drawing, operation, sides)
        found |= dict(zip(chosen.names, chosen.rim.tolist(), strict=True))
    return found


def _profiles(*layers: str, **more: object) -> tuple[Operation, ...]:
    tool = Tool(D)
    return tuple(
        Operation(name=f"of {each}", layers=(each,), tool=tool, **more) for each in layers
    )


@st.composite
def _nests(draw: st.DrawFn) -> list[np.ndarray]:
    """Boxes and circles, each within one before it or beside all, none of which cross."""
    cells = [(0.0, 0.0, 1000.0)]  # squares that are free: lower left corner and side
    shapes = []
    for _ in range(draw(st.integers(1, 12))):
        x, y, side = cells.pop(draw(st.integers(0, len(cells) - 1)))
        round_one = draw(st.booleans())
        low, high = 0.05 * side, 0.95 * side
        shapes.append(
            _circle(x + 0.5 * side, y + 0.5 * side, 0.42 * side)
            if round_one
            else _box(x + low, y + low, x + high, y + high)
        )
        half = (0.275 if round_one else 0.4) * side
        begin = 0.5 * side - half
        cells += [
            (x + begin + i * half, y + begin + j * half, half) for i in (0, 1) for j in (0, 1)
        ]
    return shapes


@examples(20, 1000)
@given(_nests(), st.data())
def test_no_choice_changes_a_side(shapes: list[np.ndarray], data: st.DataObject) -> None:
    layers = data.draw(
        st.lists(st.sampled_from(LAYERS), min_size=len(shapes), max_size=len(shapes))
    )
    turned = data.draw(st.lists(st.booleans(), min_size=len(shapes), max_size=len(shapes)))
    drawn = [
        np.column_stack([np.roll(s[::-1, :2], 0, axis=0), -np.roll(s[::-1, 2], -1)]) if t else s
        for s, t in zip(shapes, turned, strict=True)
    ]
    # The oracle: shapely counts which polygons hold a point of the contour.
    polygons = [shapely.Polygon(sample(Polyline(s, True), 0.5)) for s in drawn]
    outer = {
        f"{layer}/PATH {k}": sum(
            other.contains(polygons[k]) for n, other in enumerate(polygons) if n != k
        )
        % 2
        == 0
        for k, layer in enumerate(layers)
    }
    there = sorted(set(layers))
    wanted = data.draw(st.lists(st.sampled_from(there), min_size=1, unique=True))
    expected = {name: side for name, side in outer.items() if name.split("/")[0] in wanted}
    one = job_of(tool_diameter_mm=D)
    each = Job(operations=_profiles(*wanted))
    away = tuple(layer for layer in there if layer not in wanted)
    assert _sides(_read(drawn, layers, layers=tuple(wanted)), one) == expected
    assert _sides(_read(drawn, layers, exclude_layers=away), one) == expected
    assert _sides(_read(drawn, layers, layers=tuple(wanted)), each) == expected
    assert _sides(_read(drawn, layers), each) == expected


def _rims(drawing: Drawing, job: Job, machine: Machine) -> list[float]:
    """The widths of the lines of the tool's centre, in the order of the drawing's paths."""
    plan = planned(drawing, job, machine)
    items = [step.items[k] for step in plan.steps for k in np.unique(step.owner).tolist()]
    assert all(isinstance(item, Contour) for item in items)
    rows = sorted(items, key=lambda item: item.source)
    return [float(np.ptp(extents(Polylines.of([row.path]))[0])) for row in rows]


def _noticed(drawing: Drawing, job: Job, machine: Machine, code: Code) -> list[Finding]:
    return [each for each in planned(drawing, job, machine).toolpath.findings if each.code == code]


def _amount(gouge: Finding) -> float:
    """Return the depth of a gouge, mm, from its message."""
    return float(gouge.message.split(" cuts ")[1].split(" mm")[0])


PLATE = (_box(0, 0, 6, 4), _box(1, 1, 3, 3), _circle(4.5, 2, 1))


def test_a_window_of_its_own_layer_is_cut_inside(machine: Machine) -> None:
    drawing = _read(PLATE, ("RIM", "HOLES", "HOLES"))
    for order in (("RIM", "HOLES"), ("HOLES", "RIM")):
        job = Job(operations=_profiles(*order))
        assert _rims(drawing, job, machine) == pytest.approx([6 + D, 2 - D, 2 - D])
        assert _noticed(drawing, job, machine, PlanningCode.SIDE_BY_UNCUT) == []


def test_a_side_by_what_nobody_cuts_is_told(machine: Machine) -> None:
    drawing = _read(PLATE, ("RIM", "HOLES", "HOLES"), layers=("HOLES",))
    job = job_of(tool_diameter_mm=D)
    assert _rims(drawing, job, machine) == pytest.approx([2 - D, 2 - D])
    (finding,) = _noticed(drawing, job, machine, PlanningCode.SIDE_BY_UNCUT)
    assert (finding.severity, finding.measured) == (Severity.WARNING, 2.0)
    assert "RIM/PATH 0" in finding.message
    for said in ({"side": "outside"}, {"frames": ("RIM",)}):
        wide = _rims(drawing, job_of(tool_diameter_mm=D, **said), machine)
        assert wide == pytest.approx([2 + D, 2 + D])


def test_a_frame_turns_nothing_inside_out(machine: Machine) -> None:
    framed = (*PLATE, _box(-2, -2, 9, 7))
    for name, severity, widths in (
        ("Sheet border", Severity.INFO, [6 + D, 2 - D, 2 - D]),
        ("SHEET", Severity.WARNING, [6 - D, 2 + D, 2 + D]),
    ):
        drawing = _read(framed, ("CUT", "CUT", "CUT", name), layers=("CUT",))
        job = job_of(tool_diameter_mm=D)
        assert _rims(drawing, job, machine) == pytest.approx(widths)
        (finding,) = _noticed(drawing, job, machine, PlanningCode.SIDE_BY_UNCUT)
        assert finding.severity == severity
        assert f"{name}/PATH 3" in finding.message
    # Where a frame is cut it is a part like another.
    drawing = _read(framed, ("CUT", "CUT", "CUT", "BORDER"))
    assert _rims(drawing, job, machine) == pytest.approx([6 - D, 2 + D, 2 + D, 11 + D])


@pytest.mark.parametrize("kind", ["CENTER2", "DASHED", "Phantom"])
def test_centre_lines_and_hidden_edges_hold_nothing(machine: Machine, kind: str) -> None:
    # A flange: its pitch circle lies around the bore.
    shapes = (_circle(0, 0, 5), _circle(0, 0, 1), _circle(0, 0, 3))
    for select in ({"layers": ("CUT",)}, {"line_types": ("CONTINUOUS",)}):
        drawing = _read(shapes, ("CUT", "CUT", "AXES"), ("", "Continuous", kind), **select)
        assert _rims(drawing, job_of(tool_diameter_mm=D), machine) == pytest.approx(
            [10 + D, 2 - D]
        )


def test_what_is_drawn_again_elsewhere_holds_nothing(machine: Machine) -> None:
    again = PLATE[0] + np.array([0.004, -0.003, 0.0])
    drawing = _read((*PLATE, again), ("CUT", "CUT", "CUT", "OLD"), layers=("CUT",))
    assert _rims(drawing, job_of(tool_diameter_mm=D), machine) == pytest.approx(
        [6 + D, 2 - D, 2 - D]
    )


def test_what_nobody_cuts_counts_once_however_often_it_is_drawn(machine: Machine) -> None:
    again = PLATE[0] + np.array([0.002, 0.001, 0.0])
    drawing = _read((*PLATE, again), ("RIM", "CUT", "CUT", "OLD"), layers=("CUT",))
    assert _rims(drawing, job_of(tool_diameter_mm=D), machine) == pytest.approx([2 - D, 2 - D])


def test_engraving_holds_nothing_and_a_pocket_holds_what_is_no_deeper(machine: Machine) -> None:
    shapes = (_box(-5, -5, 5, 5), _circle(0, 0, 3), _circle(0, 0, 1))
    drawing = _read(shapes, ("RIM", "RING", "BORE"))
    tool = Tool(D)

    def bore(ring: Operation) -> bool:
        through = Operation(layers=("RIM",), tool=tool, depth_mm=0.05)
        hole = Operation(layers=("BORE",), tool=tool, depth_mm=0.05)
        return _sides(drawing, Job(operations=(ring, hole, through)))["BORE/PATH 2"]

    assert bore(Operation(kind="profile", layers=("RING",), tool=tool))  # an island in a window
    assert not bore(Operation(kind="engrave", layers=("RING",), tool=tool))
    assert not bore(Operation(kind="pocket", layers=("RING",), tool=tool, depth_mm=0.02))
    assert bore(Operation(kind="pocket", layers=("RING",), tool=tool, depth_mm=0.05))


def test_a_cut_into_what_another_operation_keeps_is_an_error(machine: Machine) -> None:
    drawing = _read((_box(0, 0, 2, 2), _box(2.2, 0, 4, 2)), ("A", "B"))
    job = Job(operations=_profiles("A", "B"))
    found = _noticed(drawing, job, machine, ProgramCode.GOUGE)
    assert [(each.severity, _amount(each)) for each in found] == [
        (Severity.ERROR, pytest.approx(0.3))
    ] * 2
    assert "B/PATH 1" in found[0].message
    assert "A/PATH 0" in found[0].where
    wide = Job(operations=_profiles("A", "B", side="outside"))
    assert _noticed(drawing, wide, machine, ProgramCode.GOUGE) == found
    # Of one operation, one line runs round both; where nobody cuts the neighbour, who knows.
    assert _noticed(drawing, job_of(tool_diameter_mm=D), machine, ProgramCode.GOUGE) == []
    alone = _read((_box(0, 0, 2, 2), _box(2.2, 0, 4, 2)), ("A", "B"), layers=("A",))
    (finding,) = _noticed(alone, job_of(tool_diameter_mm=D), machine, ProgramCode.GOUGE)
    assert finding.severity == Severity.WARNING
    assert "which is not cut itself" in finding.message


@examples(25)
@given(
    st.floats(-1.0, 1.5).filter(lambda gap: abs(gap) > 0.01 and abs(gap - D) > 0.01),
    st.floats(-1.0, 1.0),
    st.booleans(),
)
def test_gouges_are_as_deep_as_shapely_says(
    machine: Machine, gap: float, up: float, round_one: bool
) -> None:
    other = (
        _circle(3 + gap + 1.5, 1.5 + up, 1.5) if round_one else _box(3 + gap, up, 6 + gap, 3 + up)
    )
    drawing = _read((_box(0, 0, 3, 3), other), ("A", "B"))
    job = Job(operations=_profiles("A", "B", side="auto"))
    mine, wall = (
        shapely.Polygon(sample(Polyline(s, True), 0.01)) for s in (_box(0, 0, 3, 3), other)
    )
    swept = mine.buffer(D, 64).difference(mine).intersection(wall)
    found = [
        each
        for each in _noticed(drawing, job, machine, ProgramCode.GOUGE)
        if "A/PATH 0" in each.where
    ]
    assert bool(found) == (swept.area > 1e-6)
    # The deepest place of the sweep is on its edge, or or where the tool's centre goes.
    edge = shapely.get_coordinates(shapely.segmentize(swept, 0.01))
    deepest = max((shapely.Point(p).distance(wall.exterior) for p in edge), default=0.0)
    for each in found:
        assert each.severity == Severity.ERROR
        if gap > 0.0:
            assert _amount(each) == pytest.approx(deepest, abs=1e-3)
        else:
            assert _amount(each) >= deepest - 0.1


def test_a_notch_drawn_beyond_an_edge_may_be_cut_by_saying_inside(machine: Machine) -> None:
    drawing = _read((_box(0, 0, 6, 4), _box(2, -1, 4, 1)), ("RIM", "NOTCH"))
    rim, notch = _profiles("RIM", "NOTCH")
    (auto, _) = _noticed(drawing, Job(operations=(notch, rim)), machine, ProgramCode.GOUGE)
    assert auto.severity == Severity.ERROR
    said = Operation(layers=("NOTCH",), tool=Tool(D), side="inside")
    found = _noticed(drawing, Job(operations=(said, rim)), machine, ProgramCode.GOUGE)
    assert found[0].severity == Severity.WARNING


def test_the_edge_of_the_stock_may_be_cut_over(machine: Machine) -> None:
    drawing = _read(
        (_box(0, 0, 4, 4), _box(-0.1, -0.1, 4.1, 4.1)), ("CUT", "BLANK"), layers=("CUT",)
    )
    job = job_of(tool_diameter_mm=D, side="outside")
    assert _noticed(drawing, job, machine, ProgramCode.GOUGE) == []


def test_a_pocket_that_clears_away_what_is_kept_is_an_error(machine: Machine) -> None:
    shapes = (_box(0, 0, 8, 8), _box(1, 1, 7, 7), _box(3, 3, 5, 5))
    drawing = _read(shapes, ("RIM", "POCKET", "BOSS"))
    tool = Tool(D)

    def found(pocket: tuple[str, ...], side: str, deep: float) -> list[Finding]:
        operations = (
            Operation(kind="pocket", layers=pocket, tool=tool, depth_mm=0.02),
            Operation(layers=("BOSS",), tool=tool, side=side, depth_mm=deep),
            Operation(layers=("RIM",), tool=tool, depth_mm=deep),
        )
        return _noticed(drawing, Job(operations=operations), machine, ProgramCode.GOUGE)

    (finding,) = found(("POCKET",), "auto", 0.02)
    assert finding.severity == Severity.ERROR
    assert "BOSS/PATH 2" in finding.message
    assert found(("POCKET", "BOSS"), "auto", 0.02) == []  # it is an island of the pocket
    assert found(("POCKET",), "inside", 0.02) == []
    assert found(("POCKET",), "outside", 0.04) == []  # a lower boss, cut free deeper


def test_what_is_not_chosen_joins_nothing_that_is() -> None:
    half = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0]])
    rest = np.array([[4.0, 4, 0], [0, 4, 0], [0, 0, 0]])
    pieces = [
        Piece(half, False, "CUT", "#000000", "LINE 0"),
        Piece(rest, False, "CUT", "#ff0000", "LINE 1"),
        Piece(_box(-2, -2, 8, 8)[:3], False, "CUT", "#ff0000", "LINE 2"),
    ]

    def read(**more: object) -> Drawing:
        return assemble(
            pieces,
            file="test.dxf",
            units=Units("mm", 1.0, "in a test"),
            used={},
            skipped=[],
            findings=[],
            options=ReadOptions(**more),
        )

    black = read(select=Selection(colours=("#000000",)))
    assert black.paths.closed.tolist() == [False]
    assert len(black.unchosen.paths) == 0
    assert read().paths.closed.tolist() == [True, False]


def test_copies_take_what_was_not_chosen_with_them(machine: Machine) -> None:
    drawing = _read(PLATE, ("RIM", "HOLES", "HOLES"), layers=("HOLES",))
    job = job_of(tool_diameter_mm=D, copies=(2, 1), pitch_mm=(10.0, 0.0), scale=0.5, mirror="x")
    assert _rims(drawing, job, machine) == pytest.approx([1 - D] * 4)
    plan = planned(drawing, job, machine)
    assert isinstance(plan.placed.unchosen, Unchosen)
    assert plan.placed.unchosen.sources == ("PATH 0", "PATH 0 copy 2")


def test_a_stock_is_no_contour() -> None:
    drawing = _read(PLATE, ("CUT",) * 3)
    job = Job(operations=_profiles("CUT"), stock=Stock(3.0, (-5.0, -5.0), (20.0, 20.0)))
    assert _sides(drawing, job) == {"CUT/PATH 0": True, "CUT/PATH 1": False, "CUT/PATH 2": False}


# Contours that enclose something else when ends that branch are joined in another way.

FRAME = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0), (0.0, 0.0)]


def _single_lines(*chains: Sequence[tuple[float, float]], gap_mm: float = 0.01) -> Drawing:
    """A drawing of single lines, those of each chain end to end."""
    ends = [pair for chain in chains for pair in itertools.pairwise(chain)]
    pieces = [
        Piece(np.array([(*a, 0.0), (*b, 0.0)]), False, "A", "#000000", f"LINE {k}", "")
        for k, (a, b) in enumerate(ends)
    ]
    return assemble(
        pieces,
        file="test.dxf",
        units=Units("mm", 1.0, "in a test"),
        used={},
        skipped=[],
        findings=[],
        options=ReadOptions(gap_mm=gap_mm),
    )


def _refused(drawing: Drawing, machine: Machine, **more: object) -> list[Finding]:
    operation = Operation(tool=Tool(D), depth_mm=0.1, layers=("A",), **more)  # type: ignore[arg-type]
    found = planned(drawing, Job((operation,)), machine).toolpath.findings
    return [each for each in found if each.code == ContourCode.BRANCHED]


DIVIDED = [
    [(8.0, 0.0), (20.0, 0.0), (20.0, 10.0), (8.0, 10.0), (0.0, 10.0), (0.0, 0.0), (8.0, 0.0)],
    [(8.0, 0.0), (11.0, 5.0), (8.0, 10.0)],
]

CHOICES = {
    "exact": _single_lines(*DIVIDED),
    # Three ends some micrometres apart at two corners.
    "bridged": _single_lines(
        [(8.002, 0.0), (20.0, 0.0), (20.0, 10.0), (8.0, 10.002)],
        [(7.999, 10.0), (0.0, 10.0), (0.0, 0.0), (7.999, 0.001)],
        [(8.0, 0.006), (11.0, 5.0), (8.001, 9.995)],
    ),
    # A stroke that ends 3 µm beside an exact corner.
    "beside": _single_lines(FRAME, [(20.002, 10.002), (24.0, 13.0)]),
}


@pytest.mark.parametrize("name", ["exact", "bridged"])
@pytest.mark.parametrize("kind", ["pocket", "profile"])
def test_no_region_is_cut_that_depends_on_how_ends_are_joined(
    name: str, kind: str, machine: Machine
) -> None:
    drawing = CHOICES[name]
    rings = np.flatnonzero(drawing.paths.closed).tolist()
    assert len(rings) == 1
    if kind == "pocket":  # which takes no open path
        branches = [replace(each, paths=(0,)) for each in drawing.healing.branches]
        drawing = Drawing(
            drawing.paths.select(rings),
            ("A",),
            ("",),
            ("LINE",),
            "test.dxf",
            drawing.units,
            healing=replace(drawing.healing, branches=tuple(branches)),
        )
    found = _refused(drawing, machine, kind=kind)
    assert [each.severity for each in found] == [Severity.ERROR] * 2
    assert not _refused(drawing, machine, kind="profile", side="on")
    assert not _refused(drawing, machine, kind="engrave")


def test_a_stroke_beside_a_corner_makes_the_contour_doubtful(machine: Machine) -> None:
    (finding,) = _refused(CHOICES["beside"], machine)
    assert finding.severity == Severity.ERROR
    assert finding.measured == 3
    apart = _single_lines(FRAME, [(20.002, 10.002), (24.0, 13.0)], gap_mm=0.001)
    assert not _refused(apart, machine)


def test_branches_that_leave_no_choice_are_cut(machine: Machine) -> None:
    corners = [(20.0, 10.0), (30.0, 10.0), (30.0, 20.0), (20.0, 20.0), (20.0, 10.0)]
    touching = _single_lines(FRAME, corners)
    assert [each.ends for each in touching.healing.branches] == [4]
    assert touching.paths.closed.tolist() == [True, True]
    assert not _refused(touching, machine)
    assert not _refused(touching, machine, kind="pocket")
    # A centre line that begins at a corner and ends nowhere.
    stroke = _single_lines(FRAME, [(20.0, 10.0), (16.0, 7.0)])
    assert [each.ends for each in stroke.healing.branches] == [3]
    assert not _refused(stroke, machine)
