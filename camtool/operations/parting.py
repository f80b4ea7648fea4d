"""Parting on a lathe: a blade goes straight to the axis beside the part."""

from camtool.keys import LENGTH, Key
from camtool.planning.kinds import COMMON_KEYS, OperationKind

PARTING = OperationKind(
    name="parting",
    work="camtool.operations.turn.work:part_off",
    settle="camtool.operations.turn.work:checked_parting",
    keys=COMMON_KEYS,
    own={
        "bar": Key("bar_mm", LENGTH, "Diameter of the bar that is turned.", '"3.2mm"'),
        "part_at": Key("part_at_mm", LENGTH, "X of the part's end, beside which the blade cuts."),
    },
    rank=22,
    takes="nothing",
    cuts="over",
    tool_shape="blade",
    turns_work=True,
    cut_name="part",
    reason="it cuts the part off",
)
