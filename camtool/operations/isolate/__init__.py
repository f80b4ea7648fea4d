"""Isolation: the copper of each net of a board is cut free of all others."""

from camtool.keys import LENGTH, Key
from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

ISOLATE = OperationKind(
    name="isolate",
    work="camtool.operations.isolate.work:isolate",
    settle="camtool.operations.isolate.work:isolated",
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        "direction",
        "depth",
        "step_down",
        "last_pass",
        "entry",
        "lead_in",
        "lead_out",
        "overlap",
        "start",
    ),
    own={
        "isolation": Key(
            "isolation_mm",
            LENGTH,
            "Isolated this far from the copper; by default one cut.",
            '"0.4mm"',
        ),
        "copper": Key(
            "copper_mm",
            LENGTH,
            "Thickness of the copper, which is to be cut through.",
            '"0.035mm"',
            default=0.035,
        ),
    },
    rank=8,
    cuts="beside",
    frees_nets=True,
    cut_name="groove",
)
