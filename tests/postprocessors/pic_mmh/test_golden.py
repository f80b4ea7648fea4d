"""A program of every kind of row, byte for byte, in both forms (`--bless` writes it anew)."""

import pytest

from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.golden import GOLDEN, compare_golden


def part() -> Toolpath:
    """Every kind of row: a slot and a full circle, an engraved line, and all events."""
    path = ToolpathBuilder().event(Kind.TOOL_CHANGE, 1).event(Kind.SPINDLE_CW, 1200)
    path.event(Kind.DWELL, 2).rapid(z=0.2).rapid(1.0, 0.75).line(z=-0.02, feed=0.4)
    path.line(2.0, 0.75, feed=0.8).arc(2.0, 1.25, centre=(2.0, 1.0), ccw=True, feed=0.8)
    path.line(1.0, 1.25, feed=0.8).arc(1.0, 0.75, centre=(1.0, 1.0), ccw=True, feed=0.8)
    path.rapid(z=0.2).event(Kind.SPINDLE_OFF).event(Kind.SPINDLE_CCW, 800)
    path.rapid(-1.2, -0.3).line(z=-0.02, feed=0.4)
    path.arc(-1.2, -0.3, centre=(-1.5, -0.4), ccw=False, feed=0.8)
    path.arc(-1.58662, -0.70414, centre=(-1.5, -0.4), ccw=False, feed=0.8)  # needs a mend
    path.rapid(z=0.2).message("remove the part").event(Kind.SPINDLE_OFF)
    path.set_position(-1.58662, -0.70414, 0.0).event(Kind.HOME_Z).set_position(0, 0, 0).event(
        Kind.HOME_XY
    )
    return path.event(Kind.END).finish()


@pytest.mark.parametrize("form", ["example", "annex"])
def test_program(form: str, bless: bool) -> None:
    target = load_target("pic-mmh", settings=[f"dialect.form={form}"])
    data = target.target.write(part(), target.machine).data
    compare_golden(GOLDEN / f"pic-mmh-{form}.pic", data, bless=bless)
