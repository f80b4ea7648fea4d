"""Turning: the half section of a part is cut out of a bar, level by level, and finished."""

from camtool.keys import ANGLE, LENGTH, Key
from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

TURN = OperationKind(
    name="turn",
    work="camtool.operations.turn.work:turn",
    settle="camtool.operations.turn.work:checked",
    keys=(*COMMON_KEYS, *SELECTING_KEYS, "step_down", "allowance"),
    own={
        "bar": Key("bar_mm", LENGTH, "Diameter of the bar that is turned.", '"3.2mm"'),
        "face": Key(
            "face_mm",
            LENGTH,
            "How far the bar stands out before the part's end.",
            '"0.2mm"',
            default=0.0,
        ),
        "lead_angle": Key(
            "lead_angle_rad",
            ANGLE,
            "Angle of the insert's leading flank from the axis.",
            '"93deg"',
            default=1.6231562043547265,
        ),
        "trail_angle": Key(
            "trail_angle_rad",
            ANGLE,
            "Angle of the insert's trailing flank from the axis.",
            '"32deg"',
            default=0.5585053606381855,
        ),
    },
    rank=20,
    cuts="along",
    tool_shape="insert",
    turns_work=True,
    cut_name="section",
    reason="it is a half section, whose axis is Y 0",
)
