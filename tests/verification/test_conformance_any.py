"""Any program is as asked when it is camtool's own, or makes the same cuts from other starts."""

from random import Random

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import CamtoolError
from camtool.findings import Finding, Severity
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import Polyline
from camtool.inspection.findings import InspectionCode
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import Job, Placement, job_of
from camtool.records import replace
from camtool.run import Run
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.findings import VerificationCode
from camtool.verification.verify import Verification
from tests.drawings import drawing_of
from tests.paths import moved, scaled
from tests.strategies import contours, examples, open_contours
from tests.verification.test_damage import CASES, NAMES, sound

AGAINST = (
    VerificationCode.CONTOUR_MISSING,
    VerificationCode.EXTRA_CUT,
    *InspectionCode,
    *(c for c in VerificationCode if c >= VerificationCode.FEED_DIFFERS),
)


@st.composite
def jobs(draw: st.DrawFn, name: str) -> Job:
    """Jobs of one operation, of every kind that these drawings take."""
    scale, _, said = CASES[name]
    flags = {NAMES[key]: value for key, value in said.items() if draw(st.booleans())}
    kind = draw(st.sampled_from(("profile", "profile", "engrave", "pocket")))
    width = 0.7 if kind == "pocket" else draw(st.sampled_from((0.0, 0.3, 0.7)))
    side = draw(st.sampled_from(("on", "outside", "inside", "auto"))) if width else "auto"
    twice = {"copies": (2, 1), "pitch_mm": (45.0 * scale, 0.0)} if draw(st.booleans()) else {}
    return job_of(
        kind=kind,
        tool_diameter_mm=scale * width,
        side=side if kind == "profile" else "auto",
        direction=draw(st.sampled_from(("drawn", "climb", "conventional"))),
        minimise=draw(st.sampled_from(("rapids", "rapids", "reversals"))),
        approach=draw(st.booleans()),
        placement=Placement("lower-left", **twice),
        **flags,
    )


@st.composite
def drawings(draw: st.DrawFn, scale: float) -> Drawing:
    """A closed and an open path beside each other."""
    paths: list[Polyline] = [draw(contours(6)), moved(draw(open_contours(5)), 22.0, 0.0)]
    return drawing_of([scaled(path, scale) for path in paths])


def post(name: str, drawing: Drawing, job: Job) -> Run:
    """The program; another example where the target cannot make it."""
    try:
        made = post_drawing(drawing, job, sound(name)[0].target, check=False)
    except CamtoolError:
        assume(False)
        raise
    assume(not made.failed)
    return made


def judged(name: str, data: bytes, drawing: Drawing, job: Job) -> Verification:
    target = sound(name)[0].target
    run = verify_program(data, target, source="a", drawing=drawing, job=job)
    return run.verification


def against(verification: Verification) -> list[Finding]:
    """Return the findings about differences of the program from its job."""
    return [
        each
        for each in verification.findings
        if each.code in AGAINST and each.severity is Severity.ERROR
    ]


def rearranged(path: Toolpath, random: Random) -> Toolpath:
    """The same cuts of a plan without ramps and passes: contours in another order, closed ones
    begun at another of their corners."""
    deep = path.is_feed & (path.end[:, 2] < 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], deep.astype(int), [0]])))
    stays = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    random.shuffle(stays)
    safe = float(path.end[:, 2].max())
    made = ToolpathBuilder().rapid(z=safe)
    for row in np.flatnonzero(path.kind == Kind.SPINDLE_CW).tolist():
        made.event(Kind.SPINDLE_CW, float(path.value[row]))
    for plunge, after in stays:
        rows = list(range(plunge + 1, after))
        if np.allclose(path.starts[plunge + 1], path.end[after - 1]):
            first = random.randrange(len(rows))
            rows = rows[first:] + rows[:first]
        x, y, _ = path.starts[rows[0]].tolist()
        made.rapid(x, y).line(z=float(path.end[plunge, 2]), feed=float(path.feed[plunge]))
        for row in rows:
            (x, y, _), feed = path.end[row].tolist(), float(path.feed[row])
            if path.is_arc[row]:
                centre, ccw = tuple(path.centre[row].tolist()), path.kind[row] == Kind.ARC_CCW
                made.arc(x, y, centre=centre, ccw=ccw, feed=feed)
            else:
                made.line(x, y, feed=feed)
        made.rapid(z=safe)
    return made.rapid(0.0, 0.0).event(Kind.END).finish()


def check_own(name: str, data: st.DataObject) -> None:
    """Post, and verify with the same flags."""
    drawing, job = data.draw(drawings(CASES[name][0])), data.draw(jobs(name))
    job = replace(job, compensate=data.draw(st.booleans()))
    made = post(name, drawing, job)
    assert made.program is not None
    verification = judged(name, made.program.data, drawing, job)
    assert against(verification) == []
    asked = verification.report.asked
    assert asked is not None
    assert asked.alike == asked.moves


def check_rearranged(name: str, data: st.DataObject) -> None:
    """Post, cut the same in another order and from other starts, and verify."""
    drawing, job = data.draw(drawings(CASES[name][0])), data.draw(jobs(name))
    job = replace(job, minimise="rapids", approach=False)
    assume(job.operations[0].kind != "pocket")
    made = post(name, drawing, job)
    target = sound(name)[0].target
    other = rearranged(made.wanted, data.draw(st.randoms(use_true_random=False)))
    program = target.target.write(other, target.machine)
    assert against(judged(name, program.data, drawing, job)) == []


@pytest.mark.parametrize("name", CASES)
@examples(4)
@given(data=st.data())
def test_the_own_program_is_as_asked(name: str, data: st.DataObject) -> None:
    check_own(name, data)


@pytest.mark.parametrize("name", CASES)
@examples(4)
@given(data=st.data())
def test_other_starts_and_another_order_are_as_asked(name: str, data: st.DataObject) -> None:
    check_rearranged(name, data)


@pytest.mark.slow
@pytest.mark.parametrize("check", [check_own, check_rearranged])
@pytest.mark.parametrize("name", CASES)
@examples(40)
@given(data=st.data())
def test_many_more(name: str, check: object, data: st.DataObject) -> None:
    assert callable(check)
    check(name, data)
