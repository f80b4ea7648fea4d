"""Every printed figure of random jobs against the program itself: in the summary, JSON, Markdown,
HTML and the picture."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

from camtool.records import replace
from tests.cli.conftest import Done, Run
from tests.oracles.part_sizes import Ball, left_of, polygon, removed, size_of
from tests.oracles.printed_figures import (
    Form,
    contradictions,
    gouges_mm,
    numbers,
    read_html,
    read_markdown,
    read_picture,
    read_summary,
    wrong_lines,
    wrong_picture,
    wrong_tables,
)
from tests.oracles.program_figures import Axis, Program
from tests.oracles.stock import Cutter, Walls
from tests.oracles.stock import Path as Line
from tests.oracles.stock_jobs import Asked, circle, described, moved, random_job, rectangle

DEFAULT_JOBS = (0, 1, 2, 5, 6, 11, 13, 25, 48, 58, 110)
"""Small ones of all kinds."""
SLOW_JOBS = 300
FAST = 1e6
"""mm/s²: a machine that is at its feed at once."""
RAPID_MM_MIN = 1828.8
EXACT = (
    "--set", "dialect.path=exact-path",
    *(part for axis in "xyz" for part in ("--set", f"axes.{axis}.acceleration_mm_s2={FAST}")),
)  # fmt: skip
AXES = [Axis(), Axis(), Axis(), Axis(1.0005), Axis(0.999, 0.03), Axis(1.0, 0.05)]


@dataclass(frozen=True)
class Case:
    """A job, its axes, and what its kind is called when it is not that of the stock jobs."""

    asked: Asked
    x: Axis
    y: Axis
    finish: float = 0.0
    ball: bool = False


def case_of(seed: int) -> Case:
    rng = np.random.default_rng([7, seed])
    kind = int(rng.integers(8))
    if kind == 0:
        asked = _bores(rng)
    elif kind == 1:
        asked = _chamfers(rng)
    else:
        asked = random_job(rng)
    settings = dict(asked.settings)
    if asked.kind == "profile" and settings.get("tabs") is not None and settings["tabs"].ramped:
        settings["tabs"] = replace(settings["tabs"], ramped=False)
    asked = replace(asked, settings=settings)
    x, y = (AXES[int(k)] for k in rng.integers(len(AXES), size=2))
    beside = asked.kind in ("profile", "pocket") and asked.side != "on"
    finish = 0.2 * asked.cutter.radius if beside and rng.random() < 0.25 else 0.0
    ball = beside and not finish and bool(rng.random() < 0.2)
    return Case(asked, x, y, finish, ball)


def _bores(rng: np.random.Generator) -> Asked:
    radius = [float(each) for each in rng.uniform(2.2, 9.0, 3)]
    paths = tuple(
        circle(20.0 * k, round(float(rng.uniform(0, 9)), 3), round(r, 3))
        for k, r in enumerate(radius)
    )
    return Asked("bore", paths, Cutter(2.0), 4.0, step=float(rng.choice([0.5, 1.0, 3.0])))


def _chamfers(rng: np.random.Generator) -> Asked:
    asked = replace(random_job(np.random.default_rng(int(rng.integers(1 << 30)))), kind="chamfer")
    return Asked("chamfer", asked.paths, Cutter(6.0, 1.0), 0.0, side="outside")


def toml_of(case: Case) -> str:
    """The job file."""
    asked, lines = case.asked, []
    cutter, own = asked.cutter, asked.settings
    lines += [f'kind = "{asked.kind}"', f"tool_diameter = {2.0 * cutter.radius}"]
    if cutter.slope:
        angle = math.degrees(2.0 * math.atan(cutter.slope))
        lines += ['tool_kind = "v"', f"tool_tip_angle = {angle}"]
        lines += [f"tool_tip_diameter = {2.0 * cutter.tip}"] if cutter.tip else []
    elif asked.kind == "drill":
        lines += ['tool_kind = "drill"', "tool_tip_angle = 118"]
    if case.ball:
        lines += ['tool_kind = "ball"']
    if asked.kind == "chamfer":
        lines += ["chamfer = 0.5"]
    else:
        lines += [f"depth = {asked.depth}"]
    if asked.step is not None:
        lines += [f"step_down = {asked.step}"]
    if asked.kind in ("profile", "chamfer"):
        lines += [f'side = "{asked.side}"']
    if asked.kind in ("profile", "pocket"):
        lines += [f"allowance = {asked.allowance}"]
    if case.finish and "finish_mm" not in own:
        lines += [f"finish = {case.finish}"]
    lines += [line for key, value in own.items() for line in _key(key, value)]
    return "\n".join(lines) + "\n"


def _key(key: str, value: Any) -> Iterator[str]:
    if key in ("lead_in", "lead_out"):
        yield f'{key} = {{ kind = "{value.kind}", length = {value.length_mm} }}'
    elif key == "entry":
        yield f'entry = {{ kind = "{value.kind}", angle = "{math.degrees(value.angle_rad)}deg" }}'
    elif key == "tabs":
        sizes = f"width = {value.width_mm}, height = {value.height_mm}"
        yield f"tabs = {{ count = {value.count}, {sizes} }}"
    elif key == "angle_rad":
        yield f"angle = {math.degrees(value)}"
    elif isinstance(value, str):
        yield f'{key} = "{value}"'
    else:
        yield f"{key.removesuffix('_mm')} = {value}"


def draw(paths: tuple[Line, ...], folder: Path, layers: tuple[str, ...] = ()) -> None:
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    for path, layer in zip(paths, layers or ("0",) * len(paths), strict=True):
        document.modelspace().add_lwpolyline(
            path, format="xyb", close=True, dxfattribs={"layer": layer}
        )
    document.saveas(folder / "a.dxf")


@dataclass(frozen=True)
class Made:
    """The results of a job: the report, its printed forms, and the program."""

    report: dict[str, Any]
    forms: dict[str, tuple[Form, int]]
    picture: str
    program: Program


def made_of(case: Case, camtool: Run, folder: Path) -> Made | None:
    """All forms of a job; None where it is refused."""
    draw(case.asked.paths, folder)
    (folder / "a.toml").write_text(toml_of(case))
    return posted(case.x, case.y, camtool, folder)


def posted(x: Axis, y: Axis, camtool: Run, folder: Path) -> Made | None:
    """All forms of the job that lies in the folder."""
    axes = [
        part
        for name, axis in (("x", x), ("y", y))
        for part in (
            "--set", f"axes.{name}.real_step_mm={0.005 * axis.scale}",
            "--set", f"axes.{name}.backlash_mm={axis.play}",
        )
    ]  # fmt: skip
    base = ("post", "a.dxf", "--job", "a.toml", "-t", "linuxcnc", *EXACT, *axes, "-o", "a.ngc")
    first = camtool(*base, "--json", "a.json", "--report", "a.md", "--preview", "a.svg")
    if first.returncode == 1:
        return None
    assert first.returncode == 0, first.stderr
    second = camtool(*base, "--report", "a.html", "-q")
    assert second.returncode == 0, second.stderr
    return Made(
        json.loads((folder / "a.json").read_text()),
        {
            "summary": (read_summary(_shown(first)), 0),
            "markdown": (read_markdown((folder / "a.md").read_text()), 12),
            "html": (read_html((folder / "a.html").read_text()), 500),
        },
        (folder / "a.svg").read_text(),
        Program((folder / "a.ngc").read_text(), x, y),
    )


def _shown(done: Done) -> str:
    return (done.stdout + done.stderr).decode()


# ----- the program against the report ----------------------------------------------------------


def printed(made: Made) -> Iterator[str]:
    """Return the printed figures that differ from the report, and the report's contradictions."""
    for name, (form, most) in made.forms.items():
        yield from (f"{name}: {each}" for each in wrong_lines(made.report, form))
        if most:
            yield from (f"{name}: {each}" for each in wrong_tables(made.report, form, most))
    yield from wrong_picture(made.report, read_picture(made.picture))
    yield from contradictions(made.report)


def complaints(case: Case, made: Made) -> Iterator[str]:
    yield from printed(made)
    yield from _counts(made)
    yield from _times(made)
    yield from _depths(case, made)
    yield from _sizes(case, made)
    yield from _errors(case, made)
    yield from _shapes(case, made)
    yield from _blank(case, made)
    yield from _clamps(case, made)


def _counts(made: Made) -> Iterator[str]:
    report, program = made.report, made.program
    pairs = {
        "moves": (report["moves"], len(program.moves)),
        "blocks": (report["blocks"], program.blocks),
        "bytes": (report["bytes"], len(program.text.encode())),
        "contours": (report["contours"], program.contours()),
    }
    every, cutting = program.reversals()
    for k, axis in enumerate("xyz"):
        pairs[f"reversals {axis}"] = (report["reversals"][axis], every[k])
        pairs[f"cutting reversals {axis}"] = (report["reversals"]["cutting"][axis], cutting[k])
    for name, (said, seen) in pairs.items():
        if said != seen:
            yield f"{name}: {said} are {seen}"
    for axis, seen in zip("xyz", program.extents(), strict=True):
        said = report["extents_mm"][axis]
        if said != pytest.approx(list(seen), abs=1.5e-3):
            yield f"travel {axis}: {said} is {seen}"
    rapid = report["planned"]["rapid_mm"]
    if rapid != pytest.approx(program.rapid_mm(), abs=0.002 * len(program.moves) + 0.01):
        yield f"rapids: {rapid} mm are {program.rapid_mm()}"
    for axis, way in zip("xyz", program.way(), strict=True):
        if abs(report["steps"][axis] - way / 0.005) > 1.0 + len(program.moves):
            yield f"steps {axis}: {report['steps'][axis]} are {way / 0.005:.0f}"


def _times(made: Made) -> Iterator[str]:
    total, cutting = made.program.seconds(made.program.feeds(), RAPID_MM_MIN / 60.0)
    split = made.report["time_split_s"]
    slack = 0.003 * len(made.program.moves) + 0.01
    if not total - slack <= made.report["time_s"] - split["dwell"] <= 1.005 * total + slack:
        yield f"time: {made.report['time_s']} s are {total}"
    if not cutting - slack <= split["cutting"] <= 1.005 * cutting + slack:
        yield f"cutting: {split['cutting']} s are {cutting}"


def _depths(case: Case, made: Made) -> Iterator[str]:
    operations = made.report["planned"]["operations"]
    deepest = max(each["depth_mm"] for each in operations)
    if deepest != pytest.approx(made.program.deepest(), abs=1e-3):
        yield f"depth: {deepest} mm are {made.program.deepest()}"
    levels = made.program.levels()
    plain = case.asked.tabs is None and case.asked.kind in ("profile", "pocket", "engrave")
    if not plain or "entry" in case.asked.settings:
        return
    passes = operations[0]["passes"]  # a finishing pass goes down at once
    if passes != len(levels):
        yield f"passes: {passes} are {len(levels)} at {levels}"
    most = operations[0]["deepest_pass_mm"]
    steps = -np.diff([0.0, *levels])
    if most != pytest.approx(steps.max(), abs=2e-3):
        yield f"deepest pass: {most} mm are {steps.max()}"


def _cutter(case: Case) -> Cutter:
    return Ball(case.asked.cutter.radius) if case.ball else case.asked.cutter


def _sizes(case: Case, made: Made) -> Iterator[str]:
    asked, part = case.asked, made.report["dimensions"][:2]
    if asked.kind in ("drill", "chamfer"):
        if part:
            yield f"a {asked.kind} has the sizes {part}"
        return
    of = "centre" if asked.kind == "engrave" or asked.side == "on" else "edge"
    if {each["of"] for each in part} != {of}:
        yield f"sizes are of {[each['of'] for each in part]} instead of {of}"
    drawn = shapely.union_all([polygon(path) for path in asked.paths]).bounds
    nominal = [each["nominal_mm"] for each in part]
    if nominal != pytest.approx(size_of(drawn), abs=1.5e-3):
        yield f"nominal size: {nominal} is {size_of(drawn)}"
    if asked.settings.get("corners", "none") != "none":
        return
    if case.ball and asked.tabs is not None:  # a nose is narrower above its tabs
        return
    if of == "centre":
        if max(asked.leads) == 0.0:
            places, _ = made.program.cut_slides()
            places = places[places[:, 2] < 1e-3 - made.program.deepest()]
            seen = places[:, :2].max(axis=0) - places[:, :2].min(axis=0)
        else:
            return
    else:
        area = made.program.removed(_cutter(case))
        if asked.kind == "profile" and asked.side != "inside":
            area = left_of(area, asked.paths)
        seen = size_of(area.bounds)
    predicted = [each["predicted_mm"] for each in part]
    # The last pass counts; play is taken up in the passes before it.
    slack = 2.5e-3 + (max(case.x.play, case.y.play) if of == "edge" else 0.0)
    slack *= 2.0 if asked.kind == "vcarve" else 1.0  # it goes along its corners there and back
    if predicted != pytest.approx(list(seen), abs=slack):
        yield f"size: {predicted} is {list(seen)}"


def _blank(case: Case, made: Made) -> Iterator[str]:
    """Check the size of the blank, which reaches as far as the tool cuts."""
    if case.asked.kind in ("drill", "chamfer", "vcarve") or case.ball:
        return
    low_x, low_y, high_x, high_y = made.program.exact.removed(case.asked.cutter).bounds
    ends = [low_x, high_x, low_y, high_y]
    sides = [high_x - low_x, high_y - low_y]
    for words in made.forms["html"][0].values("blank"):
        said = [number for number, _ in numbers(words)]
        # A side lies between two ends, each of which is the chord of an arc here.
        if said[2:] != pytest.approx(ends, abs=3e-3) or said[:2] != pytest.approx(sides, abs=6e-3):
            yield f"blank: {words} is {sides}, {ends}"


def _clamps(case: Case, made: Made) -> Iterator[str]:
    """Check the box outside of which no tool passes: the axes with half the tool on both sides."""
    radius = case.asked.cutter.radius
    reach = made.program.extents()[:2]
    wanted = [limit for low, high in reach for limit in (low - radius, high + radius)]
    for words in made.forms["html"][0].values("clamps"):
        said = [number for number, _ in numbers(words)]
        if said != pytest.approx(wanted, abs=3e-3):
            yield f"clamps: {words} is {wanted}"


def _shapes(case: Case, made: Made) -> Iterator[str]:
    """Check over- and undercut by the path of the slides."""
    shape = made.report["shape"]
    codes = {each["code"] for each in made.report["findings"]}
    if shape is None or codes & {"GOUGE", "OVERCUT"}:  # what must stay is never wanted
        return
    cutter, program = _cutter(case), made.program
    if shape["tool_diameter_mm"] != 2.0 * cutter.radius:
        yield f"shape: of a tool of {shape['tool_diameter_mm']} mm"
    exact, seen = program.exact.removed(cutter), program.removed(cutter)
    for name, one, other in (("overcut", seen, exact), ("undercut", exact, seen)):
        rest = shapely.difference(one, other)
        dense = shapely.points(shapely.get_coordinates(shapely.segmentize(rest, 0.05)))
        deep = 1000.0 * float(shapely.distance(dense, other).max(initial=0.0))
        said = shape[f"{name}_um"]
        if not deep - 3.0 <= said <= deep + 3.0:
            yield f"shape: {name} {said} µm is {deep:.2f}"
        slack = 0.003 * shapely.length(exact)
        if not rest.area - slack <= shape[f"{name}_mm2"] <= rest.area + slack:
            yield f"shape: {name} {shape[f'{name}_mm2']} mm² is {rest.area:.4f}"


def _errors(case: Case, made: Made) -> Iterator[str]:
    """The headline is no smaller than what is seen, by the edges of the tool."""
    asked, claimed = case.asked, made.report["error_um"]["total"]["max"]
    if asked.kind in ("drill", "chamfer", "vcarve"):
        return
    codes = {each["code"] for each in made.report["findings"]}
    walls = Walls.of(asked.paths)
    places, _ = made.program.cut_slides()
    flat = places[:, :2]
    if asked.kind == "engrave" or asked.side == "on":
        true = 0.0 if max(asked.leads) else float(walls.distance(flat).max())
    elif "GOUGE" in codes or asked.settings.get("corners", "none") != "none":
        return
    else:
        within = walls.within(flat)
        stays = within if asked.kind == "profile" and asked.side != "inside" else ~within
        free = np.where(stays, -1.0, 1.0) * walls.distance(flat)
        true = float((asked.away - free).max())
    # Gouges are told with one or two digits, and what the machine adds stands before them.
    gouges = 1000.0 * gouges_mm(made.forms["summary"][0])
    if 1000.0 * true > claimed + 1.25 * gouges + 1.0:  # an arc's ends are rounded to 0.5 µm
        yield f"error: {claimed} µm at most, and {1000.0 * true:.2f} are seen"
    bound = 1000.0 * sum(
        axis.play + abs(axis.scale - 1.0) * max(abs(flat).max(), 1.0) for axis in (case.x, case.y)
    )
    if claimed > bound + 10.0:
        yield f"error: {claimed} µm where the machine makes {bound:.2f}"


@pytest.mark.parametrize("seed", DEFAULT_JOBS)
def test_every_printed_figure_is_that_of_the_program(
    seed: int, camtool: Run, tmp_path: Path
) -> None:
    case = case_of(seed)
    made = made_of(case, camtool, tmp_path)
    if made is not None:
        assert list(complaints(case, made)) == [], described(case.asked)


SEVERAL = """
feed = 300
[tools.mill]
number = 2
diameter = 3
[tools.thin]
number = 5
diameter = 1
[tools.bit]
kind = "v"
number = 4
diameter = 6
tip_angle = 60
[[operations]]
name = "rough"
kind = "pocket"
layers = ["POCKET"]
tool = "mill"
depth = {depth}
step_down = 0.7
feed = 400
[[operations]]
name = "rest"
kind = "pocket"
layers = ["POCKET"]
tool = "thin"
rest = "rough"
depth = {depth}
step_down = 0.5
[[operations]]
kind = "vcarve"
layers = ["SIGN"]
tool = "bit"
depth = 2
[[operations]]
kind = "chamfer"
layers = ["PLATE"]
side = "outside"
tool = "bit"
chamfer = 0.3
[[operations]]
name = "out"
layers = ["PLATE"]
tool = "mill"
depth = 3
step_down = 1
finish = 0.2
"""


@pytest.mark.parametrize("depth", [1.0, 1.6])
def test_every_figure_of_several_operations_is_that_of_the_program(
    depth: float, camtool: Run, tmp_path: Path
) -> None:
    """The plate is as large as its outline, whatever else is cut; each operation has its own."""
    plate, pocket = rectangle(60.0, 40.0, 4.0), moved(rectangle(15.0, 12.0), 5.0, 5.0)
    sign = moved(circle(0.0, 0.0, 4.0), 40.0, 20.0)
    layers = {"PLATE": plate, "POCKET": pocket, "SIGN": sign}
    draw(tuple(layers.values()), tmp_path, tuple(layers))
    (tmp_path / "a.toml").write_text(SEVERAL.format(depth=depth))
    made = posted(Axis(), Axis(), camtool, tmp_path)
    assert made is not None
    found = [*printed(made), *_counts(made), *_times(made)]
    assert found == []
    part = made.report["dimensions"][:2]
    outline = [each["predicted_mm"] for each in part]
    mill = [k for k in made.program.cuts if made.program.tool_of(k) == 2]
    area = removed([made.program.moves[k] for k in mill], Cutter(1.5))
    assert outline == pytest.approx(list(size_of(left_of(area, [plate]).bounds)), abs=2e-3)
    assert {each["of"] for each in part} == {"edge"}
    said = {each["name"] or each["kind"]: each for each in made.report["planned"]["operations"]}
    deep = {name: operation["depth_mm"] for name, operation in said.items()}
    tools = {name: made.report["planned"]["tools"][each["tool"]]["number"]
             for name, each in said.items()}  # fmt: skip
    assert tools == {
        "rough": 2,
        "rest": 5,
        "vcarve 3": 4,
        "chamfer 4": 4,
        "out": 2,
        "out finish": 2,
    }
    for number in (2, 4, 5):
        moves = [move for k, move in enumerate(made.program.moves)
                 if made.program.tool_of(k) == number]  # fmt: skip
        deepest = max(deep[name] for name, tool in tools.items() if tool == number)
        assert -min(move.b[2] for move in moves) == pytest.approx(deepest, abs=1e-3)
    assert said["rough"]["passes"] == math.ceil(depth / 0.7)
    assert said["rest"]["passes"] == math.ceil(depth / 0.5)


TAMPERED: list[tuple[tuple[str | int, ...], float]] = [
    (("moves",), 1), (("blocks",), 1), (("bytes",), -1), (("contours",), 1), (("time_s",), 1.5),
    (("time_split_s", "cutting"), 1.5), (("steps", "x"), 3000), (("reversals", "y"), 1),
    (("extents_mm", "z", 0), -0.01), (("dimensions", 0, "predicted_mm"), 0.01),
    (("dimensions", 1, "error_percent"), 0.1), (("error_um", "total", "max"), -9.0),
    (("error_um", "fit", "max"), 0.02), (("planned", "rapid_mm"), 2.0),
    (("planned", "operations", 0, "depth_mm"), 0.1), (("planned", "operations", 0, "passes"), 1),
    (("planned", "operations", 0, "feed_mm_min"), 1.0), (("worst", 0, "total_um"), 1.0),
    (("contour_errors", 0, "rms_um"), 0.02), (("shape", "overcut_um"), 9.0),
    (("shape", "undercut_mm2"), 3.0), (("closure_um",), 0.02),
]  # fmt: skip


def test_a_figure_that_was_tampered_with_is_seen(camtool: Run, tmp_path: Path) -> None:
    """In the report and its forms alike where the program alone tells."""
    path = (rectangle(30.0, 20.0, 3.0),)
    asked = Asked("pocket", path, Cutter(1.5), 2.0, step=1.0)
    case = Case(asked, Axis(1.0005), Axis(1.0, 0.05))
    made = made_of(case, camtool, tmp_path)
    assert made is not None
    assert list(complaints(case, made)) == []
    for keys, more in TAMPERED:
        report = copy.deepcopy(made.report)
        *way, last = keys
        inside: Any = report
        for key in way:
            inside = inside[key]
        inside[last] += more
        found = list(complaints(case, replace(made, report=report)))
        assert found, keys
        if keys[0] in ("moves", "blocks", "bytes", "contours", "steps", "extents_mm", "planned"):
            assert any(not each.startswith(tuple(made.forms)) for each in found) or last in (
                "feed_mm_min",
            ), found


def test_the_small_jobs_are_of_all_kinds() -> None:
    kinds = {case_of(seed).asked.kind for seed in DEFAULT_JOBS}
    assert kinds == {"profile", "pocket", "bore", "engrave", "drill", "vcarve", "chamfer"}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(SLOW_JOBS))
def test_every_printed_figure_of_many_jobs(seed: int, camtool: Run, tmp_path: Path) -> None:
    case = case_of(seed)
    made = made_of(case, camtool, tmp_path)
    if made is not None:
        assert list(complaints(case, made)) == [], described(case.asked)
