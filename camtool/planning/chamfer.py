"""Chamfers: the edges of closed contours are broken by the flank of a V bit.

         w              stock top
       ├───┤
    ───╮   ┊  ╱
    part╲  ┊ ╱          the bevel ends at the drawn line, where the bit is r(o) wide;
         ╲ ┊╱           its tip runs o below that, beside the wall
         │╲╱

The axis of the bit runs r(o) away from the line, on the side of the waste, as the tool of a
profile of that radius would: so a chamfer is one, whose depth its width makes
(`Operation.chamfered`).
Round an outer corner the cone rolls about the corner, and the bevels meet in a mitre there; in an
inner one it leaves its own round. All passes run along the same line, each deeper than the one
before.
"""

from __future__ import annotations

import numpy as np

from camtool.findings import Finding
from camtool.planning.drill import named
from camtool.planning.findings import NOT_CHAMFERED, NOTHING_DRAWN_TO_CHAMFER
from camtool.planning.items import Chosen, Setting, Work
from camtool.planning.naming import operation_name
from camtool.planning.profile import profile
from camtool.records import replace


def chamfer(chosen: Chosen, setting: Setting) -> Work:
    """The contours of an operation of the kind chamfer; open paths are named in a finding."""
    closed = np.flatnonzero(chosen.lines.closed)
    opens = [chosen.names[k] for k in np.flatnonzero(~chosen.lines.closed).tolist()]
    findings = list[Finding]()
    if opens:
        findings.append(NOT_CHAMFERED(where=named(opens), measured=len(opens)))
    if not len(closed):
        findings.append(NOTHING_DRAWN_TO_CHAMFER(where=operation_name(setting.operation)))
    edges = replace(
        chosen,
        nesting=chosen.nesting.among(closed),
        source=chosen.source[closed],
        names=tuple(chosen.names[k] for k in closed.tolist()),
        rim=chosen.rim[closed],
    )
    work = profile(edges, setting)
    return Work(work.items, (*findings, *work.findings))
