"""Codes and sentences of drawings: units, gaps, what was left out or repaired."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Code
from camtool.geometry.findings import ContourCode


class DrawingCode(Code):
    """Codes of findings about drawings."""

    UNITLESS = (
        101,
        WARNING,
        "the file names no unit; a guess was made and is shown with the size",
        "give `--units`",
    )
    IMPLAUSIBLE_SIZE = (
        102,
        WARNING,
        "the drawing is smaller or larger than anything these machines make: probably wrong units",
        "give `--units`",
    )
    ENTITY_SKIPPED = (
        103,
        (WARNING, INFO),
        "entities that are no lines or curves, or lie on hidden layers, were left out; kind, "
        "count and reason are listed; a remark for what has no length",
        "convert them to curves in CAD if they are to be cut",
    )
    GAP_OPEN = (
        104,
        WARNING,
        "an open end lies near another one: perhaps meant closed; place and size are given",
        "close it in the drawing, or raise `--gap`",
    )
    FILE_REPAIRED = (
        105,
        WARNING,
        "the file was damaged and could be read after repairs",
        "check the picture with `camtool preview`",
    )
    GAP_CLOSED = (
        106,
        INFO,
        "ends nearer than `--gap` were joined; place and size are given",
        "none, or lower `--gap`",
    )
    DRAWN_TWICE = (
        110,
        INFO,
        "lines that lie on others, wholly or in part, were left out; count and length are given",
        "none",
    )
    TINY_MERGED = (
        111,
        INFO,
        "segments too short to matter were merged into their neighbours",
        "none",
    )
    ARCS_RECOGNISED = (
        112,
        INFO,
        "chords on one circle became arcs again, as `--recognise-arcs` asks",
        "none",
    )
    FONT_SUBSTITUTED = (
        113,
        WARNING,
        "the font of a text is not installed; another one stands for it",
        "install the font, or turn the text into curves in CAD",
    )
    SECTION_CHOSEN = (
        114,
        INFO,
        "which face or section of a solid became the drawing",
        "give `--section-z`",
    )
    NOT_APPLIED = (
        115,
        WARNING,
        "something that changes how the drawing looks was left out (a clip path, a mask, a "
        "width), so more or less is cut than is shown",
        "apply it in the program that made the drawing",
    )
    UNIT_GUESSED = (
        116,
        (INFO, WARNING),
        "the unit was taken from a hint of the file, because it names none; a warning where "
        "a wrong guess would change the size",
        "compare the size that is shown, or give `--units` (`--dpi`)",
    )
    CALLOUT_NOT_READ = (
        119,
        INFO,
        "dimensions of the drawing that are not inspected, counted, with the reason: they measure "
        "angles, ordinates or lengths of arcs, or lack what they measure; a drawing without "
        "`--tolerances` is made all the same",
        "give their limits in `tolerances.toml` where they matter",
    )


UNITLESS = DrawingCode.UNITLESS.says(
    "the file names no unit ({said}): read as mm; if that is wrong, give --units"
)
UNITLESS_PX = DrawingCode.UNITLESS.says(
    "{why}: read as px, {px_an_inch:g} an inch; if that is wrong, name the unit of a user unit "
    "with --units, or give --dpi"
)
IMPLAUSIBLE_SIZE = DrawingCode.IMPLAUSIBLE_SIZE.says(
    "the drawing is {width:.6g} x {height:.6g} mm with unit {drawn_in} ({why}); if that is "
    "wrong, name the unit with --units",
    "mm",
)
ENTITY_SKIPPED = DrawingCode.ENTITY_SKIPPED.says("{measured} {kind} left out: {reason}")
GAP_OPEN = DrawingCode.GAP_OPEN.says(
    "two open ends are {size_um:.4g} µm apart and stay open", "mm"
)
GAP_OPEN_MORE = DrawingCode.GAP_OPEN.says(
    "{count:# more gap stays|# more gaps stay} open, of {least_um:.4g} to {most_um:.4g} µm", "mm"
)
FILE_REPAIRED = DrawingCode.FILE_REPAIRED.says(
    "the file is faulty and was repaired ({measured}): {repairs}{more:|; and # more|; and # more}"
)
FILE_REPAIRED_BODIES = DrawingCode.FILE_REPAIRED.says(
    "{measured} of {bodies:# body|# bodies} {measured:has|have} faces or edges that do not fit "
    "together"
)
FILE_REPAIRED_IN_PART = DrawingCode.FILE_REPAIRED.says(
    "the file is damaged, something may be missing: {complaint}"
)
GAP_CLOSED = DrawingCode.GAP_CLOSED.says("a gap of {size_um:.4g} µm was closed", "mm")
GAP_CLOSED_MORE = DrawingCode.GAP_CLOSED.says(
    "{count:# more gap was|# more gaps were} closed, of {least_um:.4g} to {most_um:.4g} µm", "mm"
)
SELF_CROSSING = ContourCode.SELF_CROSSING.says(
    "a closed contour crosses itself{measured:| at # places}", severity=WARNING
)
SELF_CROSSING_MORE = ContourCode.SELF_CROSSING.says(
    "{measured:# more closed contour crosses itself|# more closed contours cross themselves}",
    severity=WARNING,
)
BRANCHED = ContourCode.BRANCHED.says(
    "{measured} ends meet; the straightest were joined", severity=WARNING
)
BRANCHED_MORE = ContourCode.BRANCHED.says(
    "more than two ends meet at {measured:# more place|# more places}", severity=WARNING
)
DRAWN_TWICE = DrawingCode.DRAWN_TWICE.says(
    "{doubles} drawn twice and {overlaps} lying on others in whole or in part: {measured:.6g} mm "
    "left out",
    "mm",
)
TINY_MERGED = DrawingCode.TINY_MERGED.says(
    "{measured:# segment|# segments} too short to matter {measured:was|were} merged"
)
ARCS_RECOGNISED = DrawingCode.ARCS_RECOGNISED.says("chords became {measured:# arc|# arcs}")
FONT_SUBSTITUTED = DrawingCode.FONT_SUBSTITUTED.says("{measured:# text|# texts}: {what}")
SECTION_CHOSEN = DrawingCode.SECTION_CHOSEN.says(
    "the section at z = {heights} mm is drawn; the model spans z = {bottom:.6g} to {top:.6g} mm; "
    "--section-z chooses another height",
    "mm",
)
SECTION_CHOSEN_FACES = DrawingCode.SECTION_CHOSEN.says(
    "the highest level face of each solid at z = {heights} mm is drawn; the model spans z = "
    "{bottom:.6g} to {top:.6g} mm; --section-z chooses another height",
    "mm",
)
NOT_APPLIED = DrawingCode.NOT_APPLIED.says("{measured} {what} {why}")
NOT_APPLIED_TO_ENTITY = DrawingCode.NOT_APPLIED.says("{measured} {kind}: {what} is not applied")
CALLOUT_NOT_READ = DrawingCode.CALLOUT_NOT_READ.says(
    "{measured} {kind} cannot be inspected: {reason}"
)
UNIT_GUESSED = DrawingCode.UNIT_GUESSED.says(
    "the file names no unit ({why}): read as {taken}; if that is wrong, name the unit with --units"
)
UNIT_GUESSED_BY_PROGRAM = DrawingCode.UNIT_GUESSED.says(
    "{program} wrote the file, which took {px_an_inch:g} px an inch, and it was read so; if it "
    "comes out too large, give --dpi {usual:g}",
    severity=WARNING,
)
