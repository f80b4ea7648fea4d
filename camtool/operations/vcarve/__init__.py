"""Carving with a V bit: the wider a place, the deeper the tip."""

from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

VCARVE = OperationKind(
    name="vcarve",
    work="camtool.operations.vcarve.work:vcarve",
    keys=(*COMMON_KEYS, *SELECTING_KEYS, "depth", "step_down", "last_pass"),
    rank=6,
    cuts="within",
    rest="floor",
    path_error_mm=0.0005,
    descent="slopes",
    needs_v_bit=True,
    cut_name="carving",
    reason="it is carved",
)
