"""Profiles: the tool runs beside closed contours, outside of parts and inside of holes."""

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, WALL_KEYS, OperationKind
from camtool.planning.strategies import LIMIT_KEYS, SLOT_KEYS

PROFILE = OperationKind(
    name="profile",
    work="camtool.operations.profile.work:profile",
    propose="camtool.operations.profile.proposal:propose",
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        *WALL_KEYS,
        "side",
        "depth",
        "breakthrough",
        "step_down",
        "last_pass",
        "entry",
        "lead_in",
        "lead_out",
        "overlap",
        "start",
        "tabs",
        "corners",
        "joins",
        "mitre_limit",
    ),
    own=LIMIT_KEYS | SLOT_KEYS,
    settle="camtool.operations.profile.slots:checked",
    rank=1,
    proposal_rank=5,
    cuts="beside",
    leaves_walls=True,
)
