"""A Run: what it holds at each stage, how it prints, and what its picture is of."""

import numpy as np
import pytest

from camtool.errors import PostError
from camtool.geometry.polylines import Polyline
from camtool.pipeline import convert_program, post_drawing, read_program, verify_program
from camtool.planning.job import Job, job_of
from camtool.records import replace
from camtool.run import Run
from camtool.target.registry import LoadedTarget, load_target
from tests.drawings import drawing_of

CORNERS = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [0.0, 3.0, 0.0]])
DRAWING = drawing_of([Polyline(CORNERS, True)])
GRBL = load_target("grbl")


def posted(job: Job, target: LoadedTarget = GRBL, **how: bool) -> Run:
    return post_drawing(DRAWING, job, target, **how)


def test_a_program_made_knows_all_stages() -> None:
    run = posted(job_of())
    assert (run.drawing, run.target, run.source) == (DRAWING, GRBL, DRAWING.file)
    assert run.wanted is not None
    assert run.program is not None
    assert run.data == run.program.data
    assert run.report is not None
    assert str(run) == run.report.to_text()
    assert run.before is None
    scene = run.scene()
    assert (scene.toolpath, scene.title) == (run.decoded, DRAWING.file)
    assert run.scene("mine").title == "mine"


def test_without_a_verdict_it_prints_as_a_line() -> None:
    run = posted(job_of(), check=False)
    assert run.verification is run.report is None
    assert str(run) == repr(run)
    assert "at most" not in repr(run)
    assert run.scene().trace_points is None


def test_what_must_not_be_run_gives_no_bytes() -> None:
    run = posted(job_of(tool_diameter_mm=50.0, side="inside"))
    assert run.failed
    assert run.program is run.decoded is None
    assert "no program" in repr(run)
    assert run.scene().toolpath is run.wanted
    with pytest.raises(PostError, match="must not be run"):
        _ = run.data


def test_before_is_the_job_without_what_it_does_against_backlash() -> None:
    run = posted(job_of(minimise="reversals"), load_target("pic-mmh"))
    assert run.before is not None
    assert run.before.job is not None
    assert run.before.job.minimise == "rapids"
    assert run.before.before is None


def test_programs_of_others() -> None:
    data = posted(job_of()).data
    read = read_program(data, GRBL, source="a.nc")
    judged = verify_program(data, GRBL, source="a.nc")
    against = verify_program(data, GRBL, source="a.nc", drawing=DRAWING, job=job_of())
    moved = convert_program(data, GRBL, load_target("linuxcnc"), file="a.nc")
    assert read.report is None
    assert [run.source for run in (read, judged, against, moved)] == ["a.nc"] * 4
    assert judged.wanted is None
    assert against.wanted is not None
    assert against.drawing is DRAWING
    assert moved.wanted is not None
    assert moved.target.machine.target.name == "linuxcnc"
    for run in (read, judged, against):
        assert run.data == data
        assert run.listing is not None
        lines = run.listing()
        assert lines is not None
        assert lines.blocks[-1] == "M2"


def test_a_listing_that_does_not_fit_is_none() -> None:
    run = posted(job_of())
    assert run.decoded is not None
    late = replace(run, decoded=replace(run.decoded, block=run.decoded.block + 10_000))
    assert late.listing is not None
    assert late.listing() is None
    assert replace(run, program=None).listing is None
