"""Drilling: single points and small circles become holes."""

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

DRILL = OperationKind(
    name="drill",
    work="camtool.operations.drill.work:drill",
    propose="camtool.operations.drill.proposal:propose",
    keys=(*COMMON_KEYS, *SELECTING_KEYS, "depth", "breakthrough", "peck", "dwell", "max_hole"),
    rank=5,
    proposal_rank=2,
    takes="holes",
    cuts="at",
    descent="pecks",
)
