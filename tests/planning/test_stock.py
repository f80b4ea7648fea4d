"""Random jobs of all operations, cut in a block of stock and held against what was asked for."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.findings import Finding, Severity
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Entry, Job, Lead, Operation, Tabs, Tool
from camtool.planning.plan import plan
from camtool.records import replace
from camtool.stock.findings import StockCode
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.findings import ProgramCode
from tests.drawings import drawing_of
from tests.oracles.contours import closed
from tests.oracles.stock import Cutter, Path, moves_of
from tests.oracles.stock_jobs import (
    GOUGE_MM,
    Asked,
    circle,
    complaints,
    described,
    ell,
    moved,
    random_job,
    rectangle,
    rounded,
    star,
)

DEFAULT_JOBS, SLOW_JOBS = 60, 1000
VERIFIED_EACH = 6
"""Of so many jobs one goes the whole way, through the verifier too."""


@cache
def linuxcnc() -> LoadedTarget:
    return load_target("linuxcnc")


def operation_of(asked: Asked) -> Operation:
    cutter = asked.cutter
    tool = Tool(2.0 * cutter.radius)
    if cutter.slope:
        angle = 2.0 * math.atan(cutter.slope)
        tool = Tool(2.0 * cutter.radius, "v", angle, 2.0 * cutter.tip)
    elif asked.kind == "drill":
        tool = Tool(2.0 * cutter.radius, "drill", 2.0)
    own: dict[str, Any] = dict(asked.settings)
    if asked.kind == "profile":
        own["side"] = asked.side
    if asked.kind in ("profile", "pocket"):
        own["allowance_mm"] = asked.allowance
    return Operation(
        kind=asked.kind, tool=tool, depth_mm=asked.depth, step_down_mm=asked.step, **own
    )


def program_of(asked: Asked) -> tuple[str, tuple[Finding, ...]]:
    """The program and what planning says; "" when that holds an error."""
    target = linuxcnc()
    drawing = drawing_of([closed(*path) for path in asked.paths])
    toolpath = plan(drawing, Job((operation_of(asked),)), target.machine)
    if any(finding.severity is Severity.ERROR for finding in toolpath.findings):
        return "", toolpath.findings
    return target.target.write(toolpath, target.machine).data.decode(), toolpath.findings


def judged(asked: Asked) -> list[str]:
    program, findings = program_of(asked)
    if not program:
        return [str(finding) for finding in findings if finding.severity is Severity.ERROR]
    return complaints(asked, moves_of(program), [finding.code.name for finding in findings])


def job_of(seed: int) -> Asked:
    return random_job(np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(DEFAULT_JOBS))
def test_random_jobs_do_what_is_asked_and_nothing_else(seed: int) -> None:
    asked = job_of(seed)
    assert judged(asked) == [], described(asked)


@pytest.mark.parametrize("seed", range(0, DEFAULT_JOBS, VERIFIED_EACH))
def test_random_jobs_cut_so_far_beyond_the_line(seed: int) -> None:
    asked = job_of(seed)
    if asked.kind in ("profile", "pocket") and asked.side != "on":
        asked = replace(asked, allowance=-0.1)
        assert judged(asked) == [], described(asked)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(DEFAULT_JOBS, DEFAULT_JOBS + SLOW_JOBS, 50))
def test_many_random_jobs(first: int) -> None:
    for asked in map(job_of, range(first, first + 50)):
        assert judged(asked) == [], described(asked)


@pytest.mark.parametrize("seed", range(0, DEFAULT_JOBS, VERIFIED_EACH))
def test_their_programs_are_accepted_by_their_own_verifier(seed: int) -> None:
    asked = job_of(seed)
    drawing = drawing_of([closed(*path) for path in asked.paths])
    posted = post_drawing(drawing, Job((operation_of(asked),)), linuxcnc())
    errors = [each for each in posted.findings if each.severity is Severity.ERROR]
    assert errors == [], described(asked)
    assert posted.verification is not None
    shape = posted.verification.report.shape
    gouges = any(each.code is ProgramCode.GOUGE for each in posted.findings)
    if shape is not None and not gouges:
        assert shape.overcut_um <= 1000.0 * GOUGE_MM


def test_the_report_sees_a_gouge_that_is_a_warning() -> None:
    """Two parts nearer than the tool: the oracle's figure is the report's."""
    gap, diameter = 2.0, 3.0
    paths = (rectangle(20.0, 20.0), moved(rectangle(20.0, 20.0), 20.0 + gap, 0.0))
    asked = profile(paths, diameter, 1.0)
    posted = post_drawing(
        drawing_of([closed(*path) for path in paths]), Job((operation_of(asked),)), linuxcnc()
    )
    assert {ProgramCode.GOUGE, StockCode.CUT_TOO_DEEP} == {
        f.code for f in posted.findings if f.severity > Severity.INFO
    } - {PlanningCode.CUT_DOUBTFUL}
    assert posted.verification is not None
    shape = posted.verification.report.shape
    assert shape is not None
    assert shape.overcut_um == pytest.approx(1000.0 * (diameter - gap), abs=5.0)


# ----- past failures -------------------------------------------------------------------------

PART = (tuple(rectangle(40.0, 30.0)),)
MILL = Cutter(3.0)


def profile(paths: tuple[Path, ...], diameter: float, depth: float, **rest: Any) -> Asked:
    """A profile round the outside; what Asked does not know goes to camtool's operation."""
    own = {
        key: rest.pop(key) for key in ("step", "tabs", "leads", "side", "allowance") if key in rest
    }
    own.setdefault("side", "outside")
    return Asked("profile", paths, Cutter(0.5 * diameter), depth, settings=rest, **own)


def tabbed(paths: tuple[Path, ...], diameter: float, depth: float, tabs: Tabs) -> Asked:
    assert tabs.count is not None
    wanted = (tabs.count, tabs.width_mm, tabs.height_mm)
    asked = profile(paths, diameter, depth, tabs=wanted)
    return replace(asked, settings={"tabs": tabs})


def led(kind: str, length: float, depth: float, step: float, **rest: Any) -> Asked:
    leads = {"lead_in": Lead(kind, length), "lead_out": Lead(kind, length)}
    return profile(PART, 6.0, depth, step=step, leads=(length, length), **leads, **rest)


SQUARES = tuple(moved(rectangle(30.0, 30.0), 33.2 * k, 0.0) for k in range(3))
CIRCLES = tuple(circle(27.2 * i, 27.2 * j, 12.0) for j in range(3) for i in range(3))
NARROW = (rounded(rectangle(40.0, 5.0)),)
FAILED = {
    "a lead-out through uncut stock at full depth": led("arc", 10.0, 12.0, 2.0),
    "the same with lines": led("line", 10.0, 6.0, 2.0),
    "the same behind a ramp": led("arc", 5.0, 6.0, 2.0, entry=Entry("ramp", 0.1)),
    "a lead-out alone behind a steep ramp of several laps": profile(
        PART, 6.0, 12.0, step=5.0, leads=(0.0, 4.0), lead_out=Lead("arc", 4.0),
        entry=Entry("ramp", 0.03), overlap_mm=2.0,
    ),
    "tabs of squares nearer than one and a half tools": tabbed(
        SQUARES, 3.0, 3.0, Tabs(count=4, width_mm=3.0, height_mm=1.0)
    ),
    "tabs of circles side by side": tabbed(
        CIRCLES, 3.0, 3.0, Tabs(count=3, width_mm=3.0, height_mm=1.0)
    ),
    "tabs in a narrow window": replace(
        tabbed(NARROW, 3.0, 3.0, Tabs(count=4, width_mm=2.0, height_mm=1.0)), side="inside"
    ),
    "ramped tabs of neighbours": tabbed(
        SQUARES, 3.0, 3.0, Tabs(count=4, width_mm=3.0, height_mm=1.0, ramped=True)
    ),
    "allowance of a neighbour": profile(SQUARES, 2.6, 2.0, allowance=0.4),
    "an overcut before a finishing pass": profile(
        (ell(12.0, 10.0, 5.0),), 1.0, 6.0, corners="overcut", finish_mm=0.2
    ),
    "sharp joins at needles": profile(
        (star(5, 2.0, 20.0),), 3.0, 1.0, joins="sharp",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FAILED)
def test_past_failures(name: str) -> None:
    assert judged(FAILED[name]) == []


WHOLE: dict[str, dict[str, Any]] = {
    "tabs": {"tabs": Tabs(count=2, width_mm=3.0, height_mm=0.5)},
    "ramped tabs": {"tabs": Tabs(count=3, width_mm=3.0, height_mm=0.5, ramped=True)},
    "ramp": {"entry": Entry("ramp", math.radians(3.0))},
    "leads": {"lead_in": Lead("arc", 2.0), "lead_out": Lead("arc", 2.0)},
    "none": {},
}
"""What a contour is not divided for, whatever is done against reversals."""


@pytest.mark.parametrize(
    ("kind", "name"), [*(("profile", name) for name in WHOLE), ("engrave", "ramp")]
)
def test_what_is_done_against_reversals_is_accepted(kind: str, name: str) -> None:
    play = ("axes.x.backlash_mm=0.05", "axes.y.backlash_mm=0.03")
    target = load_target("linuxcnc", settings=play)
    first = Operation(kind=kind, tool=Tool(3.0), depth_mm=1.0, **WHOLE[name])
    # The first operation ends elsewhere when it is divided, and the second begins from there.
    job = Job((Operation(tool=Tool(3.0), depth_mm=0.5), first), minimise="reversals")
    drawing = drawing_of([closed(*star(5, 5.0, 12.0))])
    posted = post_drawing(drawing, job, target)
    assert not posted.failed, [str(finding) for finding in posted.findings]
    assert posted.program is not None
    run = verify_program(posted.program.data, target, source="x.ngc", drawing=drawing, job=job)
    errors = [each for each in run.findings if each.severity is Severity.ERROR]
    assert errors == []


ROUNDED = [(8.78, 8.265, 1.0), (16.15, 15.585, 0.5), (10.0, 8.0, 1.0), (4.244, 7.383, 1.5)]


@pytest.mark.parametrize("start", [0, 2, 5])
@pytest.mark.parametrize(("w", "h", "r"), ROUNDED)
@pytest.mark.parametrize("step", [None, 0.3])
def test_carved_rounded_rectangles(
    w: float, h: float, r: float, start: int, step: float | None
) -> None:
    path = rounded(moved(rectangle(2.0 * w, 2.0 * h, r), -w, -h))
    path = [*path[start:], *path[:start]]
    asked = Asked("vcarve", (path,), Cutter(3.0, math.tan(math.pi / 4.0)), 2.0, step=step)
    assert judged(asked) == []


def test_what_a_join_does_far_away_is_said() -> None:
    needle = FAILED["sharp joins at needles"]
    assert "CORNER_FAR" in {finding.code.name for finding in program_of(needle)[1]}
    tame = replace(needle, settings={"joins": "mitre"})
    assert "CORNER_FAR" not in {finding.code.name for finding in program_of(tame)[1]}


# ----- the judge can tell ---------------------------------------------------------------------

PLAIN = profile(PART, 6.0, 3.0, step=1.0)
WITH_TABS = tabbed(PART, 6.0, 3.0, Tabs(count=4, width_mm=3.0, height_mm=1.0))
POCKET = Asked("pocket", PART, Cutter(1.5), 2.0, step=1.0)
CARVED = Asked("vcarve", PART, Cutter(3.0, 1.0), 2.0)


def deeper(program: str) -> str:
    return program.replace("Z-1.000", "Z-1.500", 1)


def without_last_pass(program: str) -> str:
    return program.replace("Z-3.000", "Z-2.500")


def nearer(program: str) -> str:
    """The longest side of the contour 30 µm too near."""
    return re.sub(r"Y-3\.000", "Y-2.970", program)


def flattened(program: str) -> str:
    return program.replace("Z-2.000", "Z-3.000", 1)


def rapid_down(program: str) -> str:
    return program.replace("G1 Z-1.000", "G0 Z-1.000\nG1", 1)


def one_ring_less(program: str) -> str:
    lines = program.splitlines()
    rings = [k for k, line in enumerate(lines) if line.startswith(("X", "Y"))]
    at = rings[len(rings) // 2]
    return "\n".join([*lines[: at - 2], *lines[at + 3 :]])


def carved_deeper(program: str) -> str:
    return program.replace("Z-2.000", "Z-2.100")


TAMPERED: list[tuple[Asked, Callable[[str], str], str]] = [
    (PLAIN, deeper, "step"),
    (PLAIN, without_last_pass, "left"),
    (PLAIN, nearer, "gouge"),
    (PLAIN, rapid_down, "rapid"),
    (WITH_TABS, flattened, "tabs"),
    (POCKET, one_ring_less, "left"),
    (CARVED, carved_deeper, "gouge"),
]


@pytest.mark.parametrize(("asked", "tamper", "word"), TAMPERED)
def test_the_judge_sees_a_program_that_was_tampered_with(
    asked: Asked, tamper: Callable[[str], str], word: str
) -> None:
    program, findings = program_of(asked)
    said = [finding.code.name for finding in findings]
    assert complaints(asked, moves_of(program), said) == []
    spoilt = tamper(program)
    assert spoilt != program
    found = complaints(asked, moves_of(spoilt), said)
    assert any(each.startswith(word) for each in found), found


def test_the_random_jobs_are_of_all_kinds_and_few_are_refused() -> None:
    jobs = [job_of(seed) for seed in range(DEFAULT_JOBS)]
    assert {job.kind for job in jobs} == {"profile", "pocket", "engrave", "drill", "vcarve"}
    assert {job.side for job in jobs} >= {"auto", "outside", "inside", "on"}
    assert any(job.tabs for job in jobs)
    assert any(job.leads[1] for job in jobs)
    for job in jobs:
        try:
            program, _ = program_of(job)
        except OptionError as error:
            pytest.fail(f"{described(job)}: {error}")
        assert program
