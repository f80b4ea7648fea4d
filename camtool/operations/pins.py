"""Pins: the holes of alignment pins, which the set-ups of a job name, drilled through the stock
into the board below."""

from camtool.planning.kinds import COMMON_KEYS, OperationKind

PINS = OperationKind(
    name="pins",
    work="camtool.operations.drill.work:drill",
    keys=(*COMMON_KEYS, "depth", "breakthrough", "peck", "dwell"),
    rank=9,
    takes="pins",
    cuts="at",
    descent="pecks",
    cut_name="hole",
)
