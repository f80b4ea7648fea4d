"""Where no picture is wanted the path of the slides is not kept, and nothing else changes."""

from __future__ import annotations

import msgspec
import pytest

from camtool.importers.read import read_drawing
from camtool.pipeline import Judging, post_drawing, verify_program
from camtool.planning.job import job_of
from camtool.target.registry import load_target
from tests.cli.conftest import ROOT

LOGO = ROOT / "samples" / "logo.dxf"


@pytest.mark.parametrize("target", ["linuxcnc", "grbl", "pic-mmh", "flashcut", "valcnc"])
@pytest.mark.parametrize("wide_mm", [0.0, 0.1])
def test_the_report_is_the_same(target: str, wide_mm: float) -> None:
    loaded = load_target(target)
    job = job_of(tool_diameter_mm=wide_mm)
    drawing = read_drawing(LOGO)
    kept, bare = (post_drawing(drawing, job, loaded, trace_points=points) for points in (None, 0))
    assert kept.report is not None
    assert msgspec.json.encode(kept.report) == msgspec.json.encode(bare.report)
    assert kept.findings == bare.findings
    assert kept.verification is not None
    assert bare.verification is not None
    assert len(kept.verification.trace.points) > 100
    program = kept.program
    assert program is not None
    for points in (None, 0):
        judging = Judging(trace_points=points)
        again = verify_program(program.data, loaded, source="a", judging=judging)
        assert again.verification is not None
        assert (len(again.verification.trace.points) == 1) == (points == 0)
