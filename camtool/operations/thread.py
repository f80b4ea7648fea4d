"""Threads of a lathe: passes that follow the turns of the spindle, each deeper."""

from camtool.keys import LENGTH, Key
from camtool.planning.kinds import COMMON_KEYS, OperationKind

THREAD = OperationKind(
    name="thread",
    work="camtool.operations.turn.work:thread",
    settle="camtool.operations.turn.work:checked_thread",
    keys=(*COMMON_KEYS, "depth", "step_down"),
    own={
        "thread_pitch": Key("thread_pitch_mm", LENGTH, "From thread to thread.", '"0.2mm"'),
        "thread_major": Key("thread_major_mm", LENGTH, "Outer diameter of a thread.", '"0.8mm"'),
        "thread_begin": Key(
            "thread_begin_mm", LENGTH, "X of the end where a thread begins.", default=0.0
        ),
        "thread_length": Key("thread_length_mm", LENGTH, "Length of a thread.", '"2mm"'),
    },
    rank=21,
    takes="nothing",
    cuts="over",
    tool_shape="threading",
    turns_work=True,
    follows_spindle=True,
    cut_name="thread",
    reason="it is a thread about the axis",
)
