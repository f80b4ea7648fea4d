"""Chamfers: the flank of a V bit breaks the edges of closed contours."""

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

CHAMFER = OperationKind(
    name="chamfer",
    work="camtool.operations.chamfer.work:chamfer",
    propose="camtool.operations.chamfer.proposal:propose",
    proposal_rank=0,
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        "side",
        "direction",
        "chamfer",
        "tip_offset",
        "step_down",
        "last_pass",
        "entry",
        "lead_in",
        "lead_out",
        "overlap",
        "start",
    ),
    rank=7,
    settle="camtool.operations.chamfer.work:chamfered",
    cuts="beside",
    needs_v_bit=True,
    cut_name="edge",
)
