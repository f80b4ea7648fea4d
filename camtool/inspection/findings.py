"""Codes and sentences of inspection: dimensions, their limits and their verdicts."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING, Code


class InspectionCode(Code):
    """Codes of findings about dimensions."""

    NO_GENERAL_TOLERANCE = (
        118,
        WARNING,
        "the general tolerance has no value for a dimension, which therefore has no limits: ISO "
        "2768-1 ends below 0.5 mm and above 2000 or 4000 mm, its class v begins over 3 mm, and "
        "form and position have none in it",
        "give the dimension limits of its own",
    )
    DIMENSION_UNBOUND = (
        501,
        (WARNING, ERROR),
        "a dimension fits no feature of the drawing, or several that differ: it is not inspected; "
        "an error with `--require`, if it is to have limits",
        "name a place on the feature in tolerances.toml (`at`, `from`, `to`)",
    )
    DIMENSION_NOT_CUT = (
        502,
        (WARNING, ERROR),
        "the program does not cut a feature of a dimension, or cuts little of it, so that it "
        "cannot be inspected; an error with `--require`, if it is to have limits",
        "cut it in the same program, name a place on the floor (`at`), give the job a stock, or "
        "take the dimension out of tolerances.toml",
    )
    DIMENSION_NOT_IN = (
        503,
        (WARNING, ERROR),
        "a dimension is out of its limits, or it is undecided whether it is (ISO 14253-1, 95 %); "
        "an error where `--require` asks for more",
        "look at what contributes most to its uncertainty in the report, and measure that; say in "
        "`[uncertainty]` of the machine file what is known (`camtool calibrate` does); or change "
        "the job: allowance, compensation, order, direction",
    )
    CALLOUT_TEXT = (
        520,
        (WARNING, ERROR),
        "the text of a dimension is none that camtool reads (a size with limits, such as `Ø6 H7` "
        "or `20 ±0.05`); it is not inspected; an error with `--require`",
        "correct the text, or name the dimension in tolerances.toml",
    )
    DIMENSION_DIFFERS = (
        521,
        (ERROR, WARNING),
        "the nominal size of a dimension is not what is drawn; a warning for dimensions of a view "
        "of another scale, which are not inspected",
        "correct the drawing, or the size in its text or in tolerances.toml",
    )
    DIMENSION_TWICE = (
        522,
        (INFO, WARNING),
        "two dimensions measure the same: the one of tolerances.toml holds, else the first with "
        "limits; a warning where two of the drawing have different limits",
        "none, or delete one of them",
    )
    COUNT_DIFFERS = (
        523,
        WARNING,
        "a dimension counts equal features (`4x Ø5`), and another number of them is drawn: only "
        "the one at which it stands is inspected",
        "correct the count, or name each in tolerances.toml",
    )
    NOTHING_REQUIRED = (
        524,
        ERROR,
        "`--require` asks something of every dimension with limits, and none of them has any: "
        "nothing would be judged",
        "give limits in the drawing or in tolerances.toml (`camtool tolerances new` begins one), "
        "or drop `--require`",
    )


NO_GENERAL_TOLERANCE = InspectionCode.NO_GENERAL_TOLERANCE.says(
    "{general} has no value for a {kind} of {measured:.4g} mm: it has no limits", "mm"
)
DIMENSION_UNBOUND = InspectionCode.DIMENSION_UNBOUND.says(
    "{name} is not inspected: {measured:nothing that is drawn fits|one fits|# features fit}",
    severity=WARNING,
)
DIMENSION_NOT_CUT = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: the program does not cut its {what}", severity=WARNING
)
DIMENSION_NOT_CUT_ACROSS = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: its {what} is cut in set-up {other!r}, and what is cut there lies "
    "{beside} beside what is cut here (flip_error)",
    severity=WARNING,
)
DIMENSION_NOT_CUT_THERE = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: the slides leave what is drawn by too much, or may leave it",
    severity=WARNING,
)
DIMENSION_NOT_CUT_NO_FLOOR = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: the job cuts no floor at its place", severity=WARNING
)
DIMENSION_NOT_CUT_THROUGH = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: the cut at its place goes through the stock, {measured:.4g} mm deep "
    "in {limit:.4g} mm",
    "mm",
    WARNING,
)
DIMENSION_NOT_CUT_NARROW = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: no depth is measured within {measured:.4g} mm of walls, and its "
    "floor has no other place",
    "mm",
    WARNING,
)
DIMENSION_NOT_CUT_NO_STOCK = InspectionCode.DIMENSION_NOT_CUT.says(
    "{name} is not inspected: the job does not say how thick its stock is", severity=WARNING
)
CALLOUT_TEXT = InspectionCode.CALLOUT_TEXT.says(
    "the text {text!r} is not understood: this dimension is not inspected", severity=WARNING
)
DIMENSION_DIFFERS = InspectionCode.DIMENSION_DIFFERS.says(
    "{name} is to be {limit:.6g} mm, but {measured:.6g} mm are drawn", "mm", ERROR
)
DIMENSION_DIFFERS_VIEW = InspectionCode.DIMENSION_DIFFERS.says(
    "says {limit:.6g} mm where {measured:.6g} mm are drawn, by the scale of its view (DIMLFAC, or "
    "that of its block): it is not inspected",
    "mm",
    WARNING,
)
DIMENSION_TWICE = InspectionCode.DIMENSION_TWICE.says(
    "measures the same as {holds}, which holds", severity=INFO
)
DIMENSION_TWICE_DIFFERS = InspectionCode.DIMENSION_TWICE.says(
    "measures the same as {holds} with other limits ({limits}, there {others}), which hold",
    severity=WARNING,
)
COUNT_DIFFERS = InspectionCode.COUNT_DIFFERS.says(
    "{name} counts {limit:.0f} equal features, but {measured:.0f} of this size are drawn: only "
    "this one is inspected"
)
NOTHING_REQUIRED = InspectionCode.NOTHING_REQUIRED.says(
    "no dimension with limits was inspected, so that nothing is known of what --require asks"
)
DIMENSION_NOT_IN_OUT = InspectionCode.DIMENSION_NOT_IN.says(
    "{name} is out: {measured:.4f} mm at worst, where {limit:.4f} mm is the limit", "mm"
)
DIMENSION_NOT_IN_UNDECIDED = InspectionCode.DIMENSION_NOT_IN.says(
    "{name} is undecided: {measured:.4f} mm at worst, where {limit:.4f} mm is the limit; {why}",
    "mm",
)
