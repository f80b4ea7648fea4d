"""Which tool changes an operator can make before the program starts."""

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, mounted_before


def test_changes_before_the_first_feed_are_made_by_hand() -> None:
    path = ToolpathBuilder().rapid(z=1.0).event(Kind.TOOL_CHANGE, 1).event(Kind.SPINDLE_CW, 9)
    path.rapid(1.0).line(z=-1.0, feed=9.0).event(Kind.TOOL_CHANGE, 2)
    assert mounted_before(path.finish()).tolist() == [False, True, False, False, False, False]
    assert mounted_before(ToolpathBuilder().finish()).tolist() == []
