"""Bores: circles wider than the tool are cut by a helix."""

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, WALL_KEYS, OperationKind

BORE = OperationKind(
    name="bore",
    work="camtool.operations.bore.work:bore",
    propose="camtool.operations.bore.proposal:propose",
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        *WALL_KEYS,
        "depth",
        "breakthrough",
        "step_down",
        "entry",
        "step_over",
    ),
    rank=3,
    proposal_rank=3,
    takes="circles",
    cuts="within",
    leaves_walls=True,
    descent="helix",
    reason="it is bored, if it is a circle wider than the tool",
)
