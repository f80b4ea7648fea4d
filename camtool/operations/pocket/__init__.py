"""Pockets: all within closed contours is cleared, except islands."""

from __future__ import annotations

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, WALL_KEYS, OperationKind
from camtool.planning.strategies import LIMIT_KEYS

POCKET = OperationKind(
    name="pocket",
    work="camtool.operations.pocket.work:pocket",
    propose="camtool.operations.pocket.proposal:propose",
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        *WALL_KEYS,
        "depth",
        "breakthrough",
        "step_down",
        "last_pass",
        "entry",
        "pattern",
        "rest",
        "step_over",
        "angle",
    ),
    own=LIMIT_KEYS,
    settle="camtool.operations.pocket.work:checked",
    rank=2,
    proposal_rank=4,
    cuts="within",
    leaves_walls=True,
    rest="corners",
    cut_name="pocket",
    reason="it is cleared as a pocket",
)
