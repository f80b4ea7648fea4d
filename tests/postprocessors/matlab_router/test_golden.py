"""Programs for the Matlab router, byte for byte (`--bless` writes them anew)."""

import re

import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.golden import GOLDEN, compare_golden
from tests.postprocessors.matlab_router.parts import ROOT, posted, router

STARS = {
    "matlab-router-star.m": (),
    "matlab-router-star-thesis.m": ("grid_mm=0.1",),
    "matlab-router-star-listing.stream": ("profile=listing", "format=stream"),
    "matlab-router-star-mended.stream": ("grid_mm=0.1", "format=stream"),
    "matlab-router-star-text.m": ("profile=text",),
}


def part() -> Toolpath:
    """Three strokes: a circle, a line nearly along X, a stroke that begins at home; all events."""
    path = ToolpathBuilder().event(Kind.TOOL_CHANGE, 1).event(Kind.SPINDLE_CW, 9000).rapid(z=9)
    path.rapid(20, 10).line(z=-1, feed=100)
    path.arc(20, 10, centre=(15, 10), ccw=True, feed=225).rapid(z=9)
    path.rapid(10, 40).line(z=-1, feed=100).line(190, 40.4, feed=90).rapid(z=9)
    path.rapid(0, 0).line(z=-1, feed=100).line(10, 0, feed=225).line(10, 0.05, feed=225)
    path.line(0, 10, feed=225).rapid(z=9).event(Kind.SPINDLE_OFF).rapid(0, 0)
    return path.event(Kind.END).finish()


@pytest.mark.parametrize("name", STARS)
def test_star(name: str, bless: bool) -> None:
    compare_golden(GOLDEN / name, posted("star.csv", router(*STARS[name])), bless=bless)


def test_part(bless: bool) -> None:
    target = router()
    data = target.target.write(part(), target.machine).data
    compare_golden(GOLDEN / "matlab-router-part.m", data, bless=bless)


def test_the_worked_examples_of_the_page_are_what_is_sent() -> None:
    page = (ROOT / "docs" / "dialects" / "matlab-router.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```matlab\n(.+?)```", page, re.DOTALL)
    assert example == (GOLDEN / "matlab-router-star.m").read_text(encoding="ascii")
    (stream,) = re.findall(r"```stream\n(.+?)\n```", page, re.DOTALL)
    sent = (GOLDEN / "matlab-router-star-listing.stream").read_bytes().decode("ascii")
    assert stream.split() == sent.split("\r")[:-1]
