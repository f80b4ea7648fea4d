"""What `camtool job new` chooses for a drawing; the jobs that it writes can be planned."""

import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Severity
from camtool.geometry.drawing import Branch, Drawing, Healing, Units, is_text
from camtool.geometry.polylines import Polyline, Polylines
from camtool.jobs.build import job_of_file
from camtool.jobs.template import Proposal, job_template, proposed
from camtool.jobs.widths import crowded, is_slot
from camtool.pipeline import post_drawing
from camtool.planning.job import Tool
from camtool.planning.plan import plan, planned
from camtool.records import replace
from camtool.target.registry import load_target
from tests.oracles.run_sweep import dense
from tests.strategies import examples

MILL_MM = 3.0

FINE = Tool(1.0, name="fine")

BIT = Tool(6.0, "v", math.radians(60.0), name="bit")

DRILL = Tool(4.2, "drill", math.radians(118.0), name="drill-42")

LIBRARY = (Tool(MILL_MM, name="mill"), BIT, DRILL)


def test_tools_without_presets_for_the_material_are_not_chosen() -> None:
    """They would cut with the spindle off; where no material is known, all tools are."""
    fit = replace(DRILL, name="fit", materials=("pine", "oak"))
    library = (*LIBRARY, fit)
    for materials, material, names in (
        ((), "", ["drill-42", "fit"]),
        (("oak", "brass"), "", ["fit"]),
        (("oak", "brass"), "brass", []),
        (("steel",), "", []),
    ):
        proposal = Proposal(MILL_MM, 3.0, "mill", materials, material, library)
        assert [tool.name for tool in proposal.tools("drill")] == names
        assert proposal.has_drill(4.2) == bool(names)


TOOLS = """
[tools.mill]
number = 1
diameter = "3mm"
[tools.fine]
number = 2
diameter = "1mm"
[tools.bit]
number = 3
diameter = "6mm"
tip_angle = "60deg"
[tools.drill-42]
number = 4
diameter = "4.2mm"
kind = "drill"
tip_angle = "118deg"
"""


def box(x: float, y: float, wide: float, high: float) -> Polyline:
    corners = [[x, y, 0], [x + wide, y, 0], [x + wide, y + high, 0], [x, y + high, 0.0]]
    return Polyline(np.array(corners), True)


def circle(x: float, y: float, diameter: float) -> Polyline:
    radius = 0.5 * diameter
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), True)


def slot(x: float, y: float, length: float, width: float) -> Polyline:
    """An obround from x, y to the right; its ends are half circles."""
    low, high = y - 0.5 * width, y + 0.5 * width
    rows = [[x, low, 0], [x + length, low, 1], [x + length, high, 0], [x, high, 1.0]]
    return Polyline(np.array(rows), True)


def stroke(*points: tuple[float, float]) -> Polyline:
    return Polyline(np.array([(*point, 0.0) for point in points]))


def moved(path: Polyline, turn_rad: float, mirrored: bool) -> Polyline:
    """The path turned about the origin, and before that mirrored in x."""
    vertices = path.vertices.copy()
    if mirrored:
        vertices[:, 0] *= -1.0
        vertices[:, 2] *= -1.0
    turn = np.array([[math.cos(turn_rad), math.sin(turn_rad)],
                     [-math.sin(turn_rad), math.cos(turn_rad)]])  # fmt: skip
    vertices[:, :2] = vertices[:, :2] @ turn
    return Polyline(vertices, path.closed)


def drawn(
    *paths: Polyline, layer: str = "0", layers: tuple[str, ...] = (), **more: object
) -> Drawing:
    """A drawing of these paths, each an entity of its own."""
    count = len(paths)
    names = tuple(f"PATH {row}" for row in range(count))
    return Drawing(Polylines.of(paths), (layer,) * count, ("",) * count, names, "part.dxf",
                   Units("mm", 1.0, "said by the test"), **more)  # type: ignore[arg-type]  # fmt: skip


def with_mill(*library: Tool, thickness_mm: float = 3.0) -> Proposal:
    return Proposal(MILL_MM, thickness_mm, "mill", library=(LIBRARY[0], *library))


def chosen(drawing: Drawing, proposal: Proposal) -> dict[int, tuple[str, str]]:
    """Kind and tool by the row of each path; each path is taken once, but for holes that are
    countersunk too."""
    found: dict[int, tuple[str, str]] = {}
    for each in proposed(drawing, proposal):
        if each.part.is_shared:
            continue
        for row in each.part.rows:
            assert row not in found
            found[row] = (each.part.kind, each.part.tool or proposal.tool)
        assert each.part.why
    return found


def errors_of(drawing: Drawing, proposal: Proposal, folder: Path) -> list[str]:
    """The errors of the plan of the job that is written."""
    (folder / "tools.toml").write_text(TOOLS, encoding="utf-8")
    text = 'tool_library = "tools.toml"\n' + job_template(drawing, None, proposal)
    (folder / "made.toml").write_text(text, encoding="utf-8")
    made = plan(drawing, job_of_file(folder / "made.toml"), load_target("linuxcnc").machine)
    return [str(each) for each in made.findings if each.severity is Severity.ERROR]


PLATE = (
    box(0, 0, 100, 60),
    box(60, 25, 30, 20),  # a window, held by tabs
    box(10, 40, 12, 11.9),  # so small that it is cleared, though its diagonal is larger
    slot(12, 10, 20, MILL_MM),
    circle(50, 10, 4.2),  # a drill is as wide
    circle(60, 10, 3.1),  # hardly wider than the mill
    circle(75, 12, 10),
    stroke((5, 55), (40, 55)),
)

CHOSEN = {
    0: ("profile", "mill"),
    1: ("profile", "mill"),
    2: ("pocket", "mill"),
    3: ("profile", "mill"),
    4: ("drill", "drill-42"),
    5: ("bore", "mill"),
    6: ("bore", "mill"),
    7: ("engrave", "bit"),
}


def test_each_shape_of_a_plate_is_cut_as_a_machinist_would(tmp_path: Path) -> None:
    drawing, proposal = drawn(*PLATE), with_mill(BIT, DRILL)
    assert chosen(drawing, proposal) == CHOSEN
    assert errors_of(drawing, proposal, tmp_path) == []
    text = (tmp_path / "made.toml").read_text(encoding="utf-8")
    assert "# circles as wide as the drill drill-42 are drilled" in text
    assert 'spoilboard = "1.6mm"' in text  # the point of the drill, ½·4.2/tan 59°, and 0.3 mm
    assert "1 of them hardly wider: plunged in pecks" in text
    assert text.count("\ntabs = ") == 2
    made = plan(drawing, job_of_file(tmp_path / "made.toml"), load_target("linuxcnc").machine)
    assert "LOOSE_PIECE" not in {each.code.name for each in made.findings}


@examples(25)
@given(st.floats(0.0, 2.0 * math.pi), st.booleans(), st.permutations(range(len(PLATE))))
def test_turned_mirrored_and_shuffled_drawings_are_cut_alike(
    turn_rad: float, mirrored: bool, order: list[int]
) -> None:
    paths = [moved(PLATE[row], turn_rad, mirrored) for row in order]
    found = chosen(drawn(*paths), with_mill(BIT, DRILL))
    expected = {row: CHOSEN[was] for row, was in enumerate(order)}
    assert found == expected


@examples(25)
@given(st.floats(0.5, 40.0), st.floats(-0.05, 0.05), st.floats(0.0, math.pi))
def test_a_slot_is_as_wide_as_the_mill_or_not(
    length: float, wider: float, turn_rad: float
) -> None:
    path = moved(slot(0, 0, length, MILL_MM + wider), turn_rad, False)
    if abs(abs(wider) - 0.02) < 1e-6:
        return
    assert bool(is_slot(Polylines.of([path]), MILL_MM)[0]) == (abs(wider) < 0.02)


def test_a_slot_as_wide_as_the_mill_is_cut_along_its_middle(tmp_path: Path) -> None:
    drawing, proposal = drawn(box(0, 0, 60, 20), slot(10, 10, 30, MILL_MM)), with_mill()
    assert errors_of(drawing, proposal, tmp_path) == []
    made = plan(drawing, job_of_file(tmp_path / "made.toml"), load_target("linuxcnc").machine)
    assert "UNREACHED" not in {each.code.name for each in made.findings}
    cut = made.end[made.end[:, 2] < 0.0]
    within = cut[(cut[:, 0] > 5) & (cut[:, 0] < 55) & (cut[:, 1] > 2) & (cut[:, 1] < 18)]
    assert len(within)
    # Origin of the job: the lower left corner of the outline, as drawn.
    assert np.abs(within[:, 1] - 10.0).max() <= 0.011


@examples(40)
@given(st.lists(st.tuples(st.floats(0, 60), st.floats(0, 60), st.floats(1, 12), st.floats(1, 12)),
                min_size=1, max_size=8))  # fmt: skip
def test_crowded_parts_are_those_whose_buffers_meet(
    rows: list[tuple[float, float, float, float]],
) -> None:
    """Of boxes that lie apart, those are crowded that are nearer than the tool is wide."""
    kept: list[tuple[float, float, float, float]] = []
    for row in rows:
        shape = shapely.box(row[0], row[1], row[0] + row[2], row[1] + row[3])
        if all(shape.distance(shapely.box(x, y, x + w, y + h)) > 1e-3 for x, y, w, h in kept):
            kept.append(row)
    shapes = [shapely.box(x, y, x + w, y + h) for x, y, w, h in kept]
    gaps = np.array([[one.distance(other) for other in shapes] for one in shapes])
    np.fill_diagonal(gaps, np.inf)
    if (np.abs(gaps - MILL_MM) < 1e-3).any():
        return
    expected = frozenset(np.flatnonzero((gaps < MILL_MM).any(axis=1)).tolist())
    assert crowded(drawn(*(box(*row) for row in kept)), MILL_MM) == expected


def test_letters_are_engraved_with_their_counters(tmp_path: Path) -> None:
    letter = (box(10, 10, 6, 8), box(12, 12, 2, 4))
    near = (box(17, 10, 6, 8), box(19, 12, 2, 4))
    drawing = drawn(box(0, 0, 60, 30), box(5, 5, 50, 20), *letter, *near)
    found = chosen(drawing, with_mill(BIT))
    assert [found[row] for row in range(2, 6)] == [("engrave", "bit")] * 4
    assert found[0] == found[1] == ("profile", "mill")
    assert errors_of(drawing, with_mill(BIT), tmp_path) == []


def test_parts_too_near_for_the_mill_get_a_finer_one(tmp_path: Path) -> None:
    drawing = drawn(box(0, 0, 40, 40), box(42, 0, 40, 40), box(100, 0, 40, 40))
    assert chosen(drawing, with_mill(FINE)) == {
        0: ("profile", "fine"),
        1: ("profile", "fine"),
        2: ("profile", "mill"),
    }
    assert errors_of(drawing, with_mill(FINE), tmp_path) == []
    assert chosen(drawing, with_mill(BIT))[0] == ("engrave", "bit")


def test_a_circle_that_holds_a_part_is_no_bore(tmp_path: Path) -> None:
    drawing = drawn(box(0, 0, 60, 60), circle(30, 30, 40), circle(33, 30, 20))
    assert chosen(drawing, with_mill())[1] == ("profile", "mill")
    assert errors_of(drawing, with_mill(), tmp_path) == []


def test_circles_about_one_centre_are_a_counterbore(tmp_path: Path) -> None:
    drawing = drawn(box(0, 0, 60, 30), circle(15, 15, 12), circle(15, 15, 6))
    made = {each.part.rows: each.part for each in proposed(drawing, with_mill())}
    assert [made[row,].kind for row in (1, 2)] == ["bore", "bore"]
    assert made[1,].keys[0][:2] == ("depth", '"1.5mm"')
    assert errors_of(drawing, with_mill(), tmp_path) == []
    cut = plan(drawing, job_of_file(tmp_path / "made.toml"), load_target("linuxcnc").machine).end
    away = np.hypot(cut[:, 0] - 15.0, cut[:, 1] - 15.0)
    assert cut[away < 1.6, 2].min() == pytest.approx(-3.3)
    within = (away > 1.6) & (away < 7.0)
    assert cut[within, 2].min() == pytest.approx(-1.5)
    assert away[within].max() == pytest.approx(4.5, abs=1e-3)


def test_the_hole_of_a_counterbore_is_drilled_where_there_is_a_drill(tmp_path: Path) -> None:
    drawing = drawn(box(0, 0, 60, 30), circle(15, 15, 9), circle(15, 15, 4.2))
    found = chosen(drawing, with_mill(DRILL))
    assert (found[1], found[2]) == (("bore", "mill"), ("drill", "drill-42"))
    assert errors_of(drawing, with_mill(DRILL), tmp_path) == []


SINKER = Tool(6.0, "v", math.radians(90.0), name="sinker")

SUNK = (box(0, 0, 60, 30), circle(15, 15, 8.6), circle(15, 15, 4.5))
"""A plate with a hole for a countersunk screw M4."""


def sunk(drawing: Drawing, proposal: Proposal) -> list[tuple[tuple[int, ...], str]]:
    """The rows of the holes that are countersunk, and the bits."""
    made = proposed(drawing, proposal)
    return [(each.part.rows, each.part.tool) for each in made if each.part.kind == "chamfer"]


@pytest.mark.parametrize(
    ("drawing", "tools", "thickness_mm", "is_sunk"),
    [
        (drawn(*SUNK), (SINKER,), 6.0, True),
        (drawn(*SUNK), (BIT,), 6.0, False),  # 60 degrees
        (drawn(*SUNK), (replace(SINKER, tip_angle_rad=math.radians(82.0)),), 6.0, True),
        (drawn(*SUNK), (replace(SINKER, diameter_mm=4.0),), 6.0, False),  # too narrow
        (drawn(*SUNK), (SINKER,), 2.0, False),  # the slope would be 2.15 mm deep
        (drawn(*SUNK[::2], circle(15, 15, 11)), (SINKER,), 6.0, False),  # 2.4 times as wide
        (drawn(*SUNK[::2], circle(15, 15, 7)), (SINKER,), 6.0, False),  # 1.6 times
        (drawn(*SUNK[::2], circle(15.1, 15, 8.6)), (SINKER,), 6.0, False),  # beside each other
    ],
)
def test_countersinks_are_told_by_their_widths_and_the_bits(
    drawing: Drawing, tools: tuple[Tool, ...], thickness_mm: float, is_sunk: bool
) -> None:
    proposal = with_mill(*tools, thickness_mm=thickness_mm)
    assert bool(sunk(drawing, proposal)) == is_sunk


@pytest.mark.parametrize("layer", ["COUNTERSINK M4", "Senkung 90", "csk"])
@pytest.mark.parametrize("which", [(1,), (2,), (1, 2)])
def test_layers_called_countersink_are_countersunk(
    layer: str, which: tuple[int, ...], tmp_path: Path
) -> None:
    """Whatever the widths, with any V bit; the name may be that of either circle."""
    drawing = drawn(box(0, 0, 60, 30), circle(15, 15, 8), circle(15, 15, 5))
    layers = tuple(layer if row in which else "0" for row in range(3))
    drawing = replace(drawing, layers=layers)
    assert sunk(drawing, with_mill(BIT, thickness_mm=6.0)) == [((2,), "bit")]
    assert chosen(drawing, with_mill(BIT, thickness_mm=6.0)) == {
        0: ("profile", "mill"),
        2: ("bore", "mill"),
    }
    assert errors_of(drawing, with_mill(BIT, thickness_mm=6.0), tmp_path) == []


@examples(20)
@given(hole=st.floats(3.2, 5.4), share=st.floats(1.8, 2.1), degrees=st.sampled_from([82.0, 90.0]))
def test_a_countersink_is_as_wide_as_drawn(
    hole: float, share: float, degrees: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The cone of the bit, along the planned path, cuts to the wider circle at the stock's top,
    and from there down to the hole at its own angle."""
    folder = tmp_path_factory.mktemp("sunk")
    bit = replace(SINKER, diameter_mm=10.0, tip_angle_rad=math.radians(degrees))
    drawing = drawn(box(0, 0, 60, 30), circle(15, 15, share * hole), circle(15, 15, hole))
    tools = f'[tools.sinker]\nnumber = 5\ndiameter = "10mm"\ntip_angle = "{degrees:g}deg"\n'
    (folder / "tools.toml").write_text(TOOLS + tools, encoding="utf-8")
    text = job_template(drawing, None, with_mill(bit, thickness_mm=8.0))
    (folder / "made.toml").write_text('tool_library = "tools.toml"\n' + text, encoding="utf-8")
    job, machine = job_of_file(folder / "made.toml"), load_target("linuxcnc").machine
    made = planned(drawing, job, machine)
    assert [each for each in made.toolpath.findings if each.severity is Severity.ERROR] == []
    (step,) = (step for step in made.steps if step.operation.kind == "chamfer")
    tips = np.concatenate([dense(run, 400) for run in step.runs])
    radii = np.linspace(0.5 * hole + 0.01, 0.6 * share * hole, 60)
    away = np.hypot(15.0 + radii - tips[:, :1], 15.0 - tips[:, 1:2])
    slope = math.tan(math.radians(0.5 * degrees))
    lowest = np.minimum((tips[:, 2:3] + away / slope).min(axis=0), 0.0)
    wanted = np.minimum((radii - 0.5 * share * hole) / slope, 0.0)
    # The job says the width in micrometres; chords of the path's arcs leave the rest.
    assert lowest == pytest.approx(wanted, abs=0.002)


def test_a_countersink_in_doubt_may_be_a_counterbore() -> None:
    drawing, proposal = drawn(*SUNK), with_mill(SINKER, thickness_mm=6.0)
    (made,) = (each for each in proposed(drawing, proposal) if each.part.kind == "chamfer")
    assert made.part.others == ("bore",)
    assert "a counterbore would take more away" in made.part.why
    bored = made.of_kind("bore").part
    assert bored.rows == (1,)
    assert ("depth", '"3mm"') in [key[:2] for key in bored.keys]


def test_a_ring_of_countersinks_is_one_operation(tmp_path: Path) -> None:
    drawing = drawn(
        box(0, 0, 90, 30),
        *(circle(15 + 20 * row, 15, d) for row in range(3) for d in (8.4, 4.2)),
        *(circle(75, 15, d) for d in (6.4, 3.4)),
    )
    proposal = with_mill(SINKER, DRILL, thickness_mm=6.0)
    assert sunk(drawing, proposal) == [((2, 4, 6), "sinker"), ((8,), "sinker")]
    found = chosen(drawing, proposal)
    assert [found[row] for row in (2, 4, 6)] == [("drill", "drill-42")] * 3
    assert found[8] == ("bore", "mill")
    kinds = [each.part.kind for each in proposed(drawing, proposal)]
    assert kinds == ["drill", "chamfer", "chamfer", "bore", "profile"]


def test_entities_of_one_name_are_told_apart_by_their_size(tmp_path: Path) -> None:
    """In a file of one line the outline and both windows are `rect at line 1`."""
    drawing = drawn(box(0, 0, 100, 60), box(50, 10, 30, 30), box(10, 10, 8, 8))
    drawing = replace(drawing, sources=("rect at line 1",) * 3)
    assert chosen(drawing, with_mill()) == {
        0: ("profile", "mill"),
        1: ("profile", "mill"),
        2: ("pocket", "mill"),
    }
    assert errors_of(drawing, with_mill(), tmp_path) == []
    text = (tmp_path / "made.toml").read_text(encoding="utf-8")
    assert [line for line in text.splitlines() if line.startswith("select_")] == [
        'select_size = "8..8mm"',
        'select_size = "30..30mm"',
    ]


def test_contours_that_cross_are_marked(tmp_path: Path) -> None:
    drawing = drawn(circle(20, 20, 20), circle(30, 20, 20))
    assert set(chosen(drawing, with_mill(BIT)).values()) == {("engrave", "bit")}
    assert errors_of(drawing, with_mill(BIT), tmp_path) == []


def test_branched_contours_are_marked() -> None:
    branch = Healing(branches=(Branch((0.0, 0.0), 3, "0", (0,)),))
    drawing = drawn(box(0, 0, 40, 40), box(60, 0, 40, 40), healing=branch)
    found = chosen(drawing, with_mill(BIT))
    assert found == {0: ("engrave", "bit"), 1: ("profile", "mill")}


@pytest.mark.parametrize(
    ("layer", "kind", "key"),
    [
        ("ENGRAVE", "engrave", 'depth = "0.2mm"'),
        ("Etching 0,5 mm", "engrave", 'depth = "0.5mm"'),
        ("POCKET 2mm", "pocket", 'depth = "2mm"'),
        ("Pocket d=1.5", "pocket", 'depth = "1.5mm"'),
        ("POCKET", "pocket", 'depth = "1.5mm"'),
        ("CUT", "profile", "breakthrough"),
        ("anything 9mm", "profile", "breakthrough"),  # deeper than the stock
        ("anything 2.5mm", "profile", 'depth = "2.5mm"'),
    ],
)
def test_layers_are_named_by_habit(layer: str, kind: str, key: str) -> None:
    drawing, proposal = drawn(box(0, 0, 40, 40), layer=layer), with_mill(BIT)
    assert chosen(drawing, proposal)[0][0] == kind
    lines = job_template(drawing, None, proposal).splitlines()
    assert any(line.startswith(key) for line in lines)


def polygon(x: float, y: float, diameter: float, sides: int = 64) -> Polyline:
    """A circle as programs without arcs draw it."""
    turn = np.arange(sides) * (2.0 * math.pi / sides)
    rows = [
        (x + 0.5 * diameter * math.cos(t), y + 0.5 * diameter * math.sin(t), 0.0) for t in turn
    ]
    return Polyline(np.array(rows), True)


def test_washers_in_a_ring_are_cut_and_judged_as_parts(tmp_path: Path) -> None:
    """The outlines of both are one operation, the window between them another: what the first
    cuts around the washer is no fault. All are entities of one name, as a path of SVG has them."""
    drawing = drawn(*(polygon(30, 30, each) for each in (60, 50, 24, 14)))
    drawing = replace(drawing, sources=("path ring",) * 4)
    proposal = with_mill()
    kinds = {0: "profile", 1: "profile", 2: "profile", 3: "profile"}
    assert {row: each[0] for row, each in chosen(drawing, proposal).items()} == kinds
    (tmp_path / "tools.toml").write_text(TOOLS, encoding="utf-8")
    text = 'tool_library = "tools.toml"\n' + job_template(drawing, None, proposal)
    (tmp_path / "made.toml").write_text(text, encoding="utf-8")
    run = post_drawing(drawing, job_of_file(tmp_path / "made.toml"), load_target("linuxcnc"))
    told = {each.code.name for each in run.findings if each.severity >= Severity.WARNING}
    assert not told & {"CUT_TOO_DEEP", "OVERCUT", "MATERIAL_LEFT", "LOOSE_PIECE", "TAB_LEFT_OUT"}
    assert not run.failed


def test_windows_of_a_part_that_is_only_marked_are_cut_within(tmp_path: Path) -> None:
    """Two plates 1 mm apart are marked: the mill has no room. Their windows are still windows, and
    what stands in one is still a part."""
    plates = box(0, 0, 100, 60), box(101, 0, 100, 60)
    within = box(20, 15, 30, 30), box(130, 10, 40, 40), box(140, 20, 20, 20), circle(80, 30, 8)
    drawing, proposal = drawn(*plates, *within), with_mill(BIT)
    found = chosen(drawing, proposal)
    assert [found[row][0] for row in range(6)] == ["engrave"] * 2 + ["profile"] * 3 + ["bore"]
    assert errors_of(drawing, proposal, tmp_path) == []
    made = plan(drawing, job_of_file(tmp_path / "made.toml"), load_target("linuxcnc").machine)
    deep = made.end[made.end[:, 2] < -1.0]
    wall = shapely.unary_union([shapely.LinearRing(path.vertices[:, :2]) for path in within[:3]])
    waste = shapely.unary_union(
        [
            shapely.box(20, 15, 50, 45),
            shapely.box(130, 10, 170, 50).difference(shapely.box(140, 20, 160, 40)),
            shapely.Point(80, 30).buffer(4.0),
        ]
    )
    for x, y in deep[:, :2].tolist():
        assert waste.buffer(1e-3).contains(shapely.Point(x, y))
        if x < 60.0 or x > 120.0:
            assert wall.distance(shapely.Point(x, y)) >= 0.5 * MILL_MM - 1e-3


def test_holes_without_a_drill_say_what_to_add() -> None:
    drawing = drawn(box(0, 0, 60, 40), circle(10, 10, 2.5), circle(20, 10, 2.5), circle(30, 10, 1))
    (made,) = (each.part for each in proposed(drawing, with_mill(BIT)) if each.part.others)
    assert (made.kind, made.rows) == ("engrave", (1, 2, 3))
    assert "no drill of 1, 2.5 mm with presets for the material; add one" in made.why


def test_text_beside_parts_is_not_cut(tmp_path: Path) -> None:
    """Notes beside a part, and text across its edge, are left; what lies within is engraved, and
    so is all on a layer for it, and text without parts."""
    plate, label = box(0, 0, 60, 40), stroke((10, 10), (20, 10), (20, 14))
    note, across = stroke((70, 5), (90, 5)), stroke((50, 30), (66, 30))
    drawing = drawn(plate, label, note, across)
    names = ("LWPOLYLINE 1", "TEXT 2", "TEXT 3", "MTEXT 4")
    assert all(is_text(name) for name in names[1:])
    drawing = replace(drawing, sources=names)
    made = proposed(drawing, with_mill(BIT))
    assert {each.part.rows: each.part.is_left for each in made if each.part.kind == "engrave"} == {
        (1,): False,
        (2, 3): True,
    }
    assert errors_of(drawing, with_mill(BIT), tmp_path) == []
    text = (tmp_path / "made.toml").read_text(encoding="utf-8")
    assert "# 0 text beside parts is not cut: it does not lie within a part" in text
    assert text.count("[[operations]]") == 2
    cut = plan(drawing, job_of_file(tmp_path / "made.toml"), load_target("linuxcnc").machine).end
    assert cut[cut[:, 2] < 0.0, 0].max() <= 60.0 + 0.5 * MILL_MM + 1e-6
    (left,) = (each for each in made if each.part.is_left)
    assert not left.cut().part.is_left
    on_layer = replace(drawing, layers=("0", *("ENGRAVE",) * 3))
    assert not any(each.part.is_left for each in proposed(on_layer, with_mill(BIT)))
    alone = replace(drawn(label, note, across), sources=names[1:])
    assert not any(each.part.is_left for each in proposed(alone, with_mill(BIT)))


def test_each_size_of_outline_has_as_many_tabs_as_it_has_room_for() -> None:
    """A small part beside a large one does not take its tabs."""
    drawing = drawn(
        box(0, 0, 200, 100),
        *(polygon(230 + 30 * row, 20, 9 + 4 * row) for row in (0, 1)),
        box(260, 60, 60, 30),
    )
    found = {
        each.part.rows: {key: value for key, value, _ in each.part.keys}.get("tabs")
        for each in proposed(drawing, with_mill())
        if each.part.kind == "profile"
    }
    assert found == {(1, 2): '"2:6mm:1.3mm"', (0, 3): '"4:6mm:1.3mm"'}


def test_circles_of_a_layer_for_holes_are_holes() -> None:
    drawing = drawn(circle(10, 10, 4.2), circle(30, 10, 8), layer="DRILL 4.2mm")
    found = chosen(drawing, with_mill(DRILL))
    assert found == {0: ("drill", "drill-42"), 1: ("bore", "mill")}


def test_red_is_cut_and_blue_is_marked() -> None:
    drawing = drawn(box(0, 0, 40, 40), box(60, 0, 40, 40))
    colours = ("#ff0000", "#0000ff")
    drawing = replace(drawing, colours=colours)
    assert chosen(drawing, with_mill(BIT)) == {0: ("profile", "mill"), 1: ("engrave", "bit")}


def test_a_hole_too_small_for_the_mill_is_drilled_where_there_is_a_drill() -> None:
    small = Tool(2.0, "drill", math.radians(118.0), name="drill-2")
    drawing = drawn(box(0, 0, 40, 40), circle(10, 10, 2), circle(20, 20, 2.5))
    assert chosen(drawing, with_mill(BIT, small)) == {
        0: ("profile", "mill"),
        1: ("drill", "drill-2"),
        2: ("engrave", "bit"),
    }
