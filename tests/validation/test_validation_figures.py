"""The figures that the theses print, made again through the real pipeline.

Each row of the page's table: what a thesis prints and in which lines (Lnnn), which comes out here
too, and the test that holds it in more detail.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from camtool.importers.read import read_drawing
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.postprocessors.i8751.machines import STEP_MM as STEP_8751_MM
from tests.postprocessors.i8751.machines import loaded
from tests.targets import simulate
from tests.validation.page import check, signed
from tests.validation.pieces import ROOT


def program_of(path: Toolpath, target: LoadedTarget) -> bytes:
    return bytes(target.target.write(path, target.machine).data)


def run(path: Toolpath, target: LoadedTarget) -> list[RowMotion]:
    """Write, read and simulate a toolpath, and return its motion row by row."""
    decoded = target.target.read(program_of(path, target), target.machine)
    return rows_of(simulate(decoded, target.machine))


class Figure(NamedTuple):
    thesis: str
    what: str
    lines: str
    printed: str
    found: str
    test: str


def table_3_8() -> Iterator[Figure]:
    for half_period, printed in ((20, 2763), (30, 2719), (40, 2697)):
        settings = [f"controller.half_period_ms={half_period}"]
        target = load_target("flashcut", settings=settings)
        steps = np.sum([row.steps for row in run(line(10.0, 5.0), target)], axis=0)
        yield Figure(
            "parallel port",
            f"Tabla 3.8: steps for 10 × 5 mm at {half_period} ms",
            "L1208-1214",
            f"5263 × {printed}",
            f"{steps[0]} × {steps[1]}",
            "postprocessors/flashcut/test_thesis.py::test_the_shorter_axis_of_table_3_8",
        )


def line(x: float, y: float) -> Toolpath:
    return ToolpathBuilder().line(x, y, feed=14.1).finish()


STAR = (
    "249 230 55 240 314 101 106 288 214 67",
    "179 179 345 208 3 357 354 20 237 342",
    "480 480 -77 480 -480 -136 -144 -480 433 -94",
    "345 -374 480 416 5 480 -480 33 -480 -480",
)
"""lxy, velxy, L3196-3228."""
DRIFT = ("0, −1, −1, 0, 0, 0, 1, 1, 1, 1, 2", "0, −1, 0, −1, −1, −2, −3, −3, −3, −2, −2")
"""Tenths of a millimetre at each vertex, which follow from L5589-5600."""


def the_star() -> Iterator[Figure]:
    fine = ["dialect.grid_mm=0.1", "dialect.bend_tolerance_mm=9"]
    target = load_target("matlab-router", settings=fine)
    star = ROOT / "samples" / "star.csv"
    posted = post_drawing(read_drawing(star), job_of(), target, check=False)
    assert posted.program is not None
    lines = posted.program.data.decode("ascii").splitlines()
    at = lines.index("lxy = ["), lines.index("velxy = [")
    arrays = [" ".join(lines[k].split()) for k in (at[0] + 1, at[0] + 2, at[1] + 1, at[1] + 2)]
    names = ("lxy, X", "lxy, Y", "velxy, X", "velxy, Y")
    for name, printed, found in zip(names, STAR, arrays, strict=True):
        yield Figure(
            "Matlab router", f"the star's {name}", "L3196-3228", printed, found,
            "postprocessors/matlab_router/test_controller.py::test_the_star_s_arrays_are_what_the_slaves_get",
        )  # fmt: skip
    assert posted.decoded is not None
    cut = posted.decoded.is_feed & (posted.decoded.end[:, 2] < 0.0)
    reached = np.rint(posted.decoded.end[cut, :2] * 10.0)
    wanted = np.rint(np.loadtxt(star, delimiter=",", skiprows=3) * 10.0)
    drift = (reached - reached[0]) - (wanted - wanted[0])
    for axis, printed in enumerate(DRIFT):
        found = ", ".join(signed(value, 0).replace("+", "") for value in drift[:, axis])
        yield Figure(
            "Matlab router", f"its drift in {'XY'[axis]}, 0.1 mm (derived)", "L5589-5600", printed,
            found,
            "postprocessors/matlab_router/test_controller.py::test_the_star_s_drift_by_odd_distances",
        )  # fmt: skip


def table_8() -> Iterator[Figure]:
    """The places of X and Y after each pass."""
    target = load_target("valcnc", settings=["dialect.coord_scale=1"])
    row = run(ToolpathBuilder().rapid(0.28, 0.12).finish(), target)[0]
    places = np.rint(row.commanded[:, :2] / 0.04).astype(int).tolist()
    yield Figure(
        "ValCNC", "Tabla 8: places of 7 × 3 steps", "L1239-1250",
        "(1, 0) (2, 0) (3, 1) (4, 1) (5, 2) (6, 2) (7, 3)",
        " ".join(f"({x}, {y})" for x, y in places),
        "postprocessors/valcnc/test_controller.py::test_table_8",
    )  # fmt: skip


def leads() -> Iterator[Figure]:
    """A tenth of the last reading, and of where a program of ten turns leads."""
    target = load_target("valcnc")
    for table, axis, printed, lines in (
        (16, "x", 8.076, "L1676-1682"),
        (15, "y", 8.086, "L1662-1668"),
        (14, "z", 8.060, "L1649-1655"),
    ):
        path = ToolpathBuilder()
        for turn in range(1, 11):
            path.rapid(**{axis: 8.0 * turn})
        end = [row for row in run(path.finish(), target) if len(row.slide)][-1].slide[-1]
        yield Figure(
            "ValCNC", f"Tabla {table}: lead of {axis.upper()} over ten turns, mm", lines,
            f"{printed:.3f}", f"{end['xyz'.index(axis)] / 10.0:.3f}",
            "postprocessors/valcnc/test_controller.py::test_the_effective_leads_of_tables_14_to_16",
        )  # fmt: skip


def dog_legs() -> Iterator[Figure]:
    """The rule is the thesis's (L416-426, L4683-4705), the figures follow from it."""
    # Else lines are cut into shorter records.
    target = loaded("tolerance_mm=9", "long_runs=true")
    for dx, dy in ((100, 50), (100, 41), (300, 100)):
        path = ToolpathBuilder().line(z=-STEP_8751_MM, feed=9.0)
        path.line(dx * STEP_8751_MM, dy * STEP_8751_MM, feed=9.0)
        program = target.target.write(path.finish(), target.machine)
        longest = max(run_bytes(program.data, target), key=lambda each: len(each.commanded))
        row = longest.commanded[:, :2] / STEP_8751_MM
        off = np.abs(row[:, 0] * dy - row[:, 1] * dx).max() / math.hypot(dx, dy)
        yield Figure(
            "8751", f"dog-leg of {dx} × {dy}: error, steps (derived)", "L416-426",
            f"{dy * (dx - dy) / math.hypot(dx, dy):.2f}", f"{off:.2f}",
            "postprocessors/i8751/test_controller.py::test_the_error_of_the_dog_leg",
        )  # fmt: skip


def ramps() -> Iterator[Figure]:
    """Delays of the pulses of a run of 200, as the motion takes them."""
    times = {steps: ramp_s(steps) for steps in (1, 89, 90, 91, 200, 201)}
    test = "postprocessors/i8751/test_pulses.py::test_the_ramp_of_the_thesis"
    for what, lines, printed, found in (
        ("start, Hz", "L3150-3183", "8.0", f"{1.0 / times[1]:.1f}"),
        ("run of 89 pulses, s: no ramp", "L3095-3111", f"{89 / 8:.3f}", f"{times[89]:.3f}"),
        (
            "delay in the cruise, ms, as coded: 11H (derived)",
            "L3241-3245",
            "9.58",
            f"{(times[201] - times[200]) * 1e3:.2f}",
        ),
        (
            "cruise, Hz, as declared",
            "L3187-3191",
            "70.0",
            f"{1.0 / (ramp_s(201, 'cruise=declared') - ramp_s(200, 'cruise=declared')):.1f}",
        ),
        ("run of 90 pulses, s (derived)", "L3197-3245", "6.17", f"{times[90]:.2f}"),
    ):
        yield Figure("8751", what, lines, printed, found, test)


def ramp_s(steps: int, *settings: str) -> float:
    """Seconds of a run along X, from its bytes."""
    target = loaded(*settings)
    path = ToolpathBuilder().line(steps * STEP_8751_MM, feed=9.0).finish()
    return sum(row.duration_s for row in run_bytes(program_of(path, target), target))


def run_bytes(data: bytes, target: LoadedTarget) -> list[RowMotion]:
    decoded = target.target.read(data, target.machine)
    return rows_of(simulate(decoded, target.machine, Options(effects=IDEAL)))


FIGURES: tuple[Callable[[], Iterator[Figure]], ...] = (
    table_3_8, the_star, table_8, leads, dog_legs, ramps,
)  # fmt: skip


def figures() -> list[Figure]:
    return [figure for make in FIGURES for figure in make()]


def test_printed_figures_come_out(bless: bool) -> None:
    rows = []
    for each in figures():
        assert each.printed == each.found, each
        rows.append([each.thesis, each.what, each.lines, each.printed, f"`{each.test}`"])
    heads = ["thesis", "figure", "lines", "printed, and found", "test, in `tests/`"]
    check("figures", heads, rows, bless)


def test_the_tests_that_the_page_names_exist() -> None:
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w/]+\.py)::(\w+)`", page))
    assert len(named) > 12
    for file, name in named:
        tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
        assert name in {n.name for n in tree.body if isinstance(n, ast.FunctionDef)}, (file, name)
