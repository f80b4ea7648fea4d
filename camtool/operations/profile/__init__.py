"""Profiles: the tool runs beside closed contours, outside of parts and inside of holes."""

from __future__ import annotations

from camtool.planning.job import Operation, Stock
from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, WALL_KEYS, OperationKind
from camtool.planning.strategies import LIMIT_KEYS, SLOT_KEYS, STRATEGIES


def checked(operation: Operation, stock: Stock | None) -> Operation:
    """Return the operation unchanged; OptionError for a slot that cannot be cut. The planner of
    slots is imported only for operations with a slot, since it needs numpy."""
    if operation.own_value("strategy") == STRATEGIES[0]:
        return operation
    from camtool.operations.profile.slots import checked_slot

    return checked_slot(operation, stock)


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
    settle="camtool.operations.profile:checked",
    rank=1,
    proposal_rank=5,
    cuts="beside",
    leaves_walls=True,
)
