"""Engraving: the tool centre runs on the line itself.

Open paths stay open and may be cut from either end; closed ones keep the direction in which they
are drawn and may begin anywhere. The material stays on both sides.
"""

from __future__ import annotations

from camtool.errors import OptionError
from camtool.planning.items import Chosen, Contours, Setting, Work
from camtool.planning.naming import key_of


def engrave(chosen: Chosen, setting: Setting) -> Work:
    """A contour for each path, as it is drawn.

    Climb and conventional are sides of a wall, and a groove has two of them: OptionError for a
    direction other than "drawn".
    """
    operation = setting.operation
    if operation.direction != "drawn":
        raise OptionError(
            f"a tool on the line cannot run {operation.direction}: it cuts on both sides",
            where=key_of(operation, "direction"),
            mend='leave it out, or write "drawn"',
        )
    return Work(Contours.along(chosen.lines, setting, chosen.names, chosen.source))
