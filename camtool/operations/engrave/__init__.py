"""Engraving: the tool runs on the lines themselves."""

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

ENGRAVE = OperationKind(
    name="engrave",
    work="camtool.operations.engrave.work:engrave",
    propose="camtool.operations.engrave.proposal:propose",
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        "depth",
        "step_down",
        "last_pass",
        "entry",
        "overlap",
        "start",
    ),
    rank=4,
    proposal_rank=1,
    cuts="along",
    cut_name="line",
    reason="it is engraved",
)
