"""The findings that only programs for grbl have."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING, TargetCode
from camtool.toolpath.findings import ProgramCode

from ..gcode.findings import simulated_as_chords

NOT_SIMULATED = TargetCode(
    "grbl.NOT_SIMULATED",
    (WARNING, INFO),
    "the program asks for something that is not simulated, or that grbl does otherwise than it "
    "looks: jogs, lines with /, signs that grbl obeys within comments, arcs in XZ and YZ",
    "none, if that is meant",
)
PLACE_UNKNOWN = TargetCode(
    "grbl.PLACE_UNKNOWN",
    (WARNING, ERROR),
    "the program goes to a place that only the controller remembers: a second work frame (error), "
    "or that of G28 and G30 (warning); it is simulated as if that were machine zero",
    "give its place: `dialect.work_offsets_mm`, `dialect.homes_mm`",
)
CODES = (NOT_SIMULATED, PLACE_UNKNOWN)

NOT_SIMULATED_JOG = NOT_SIMULATED.says(
    "{count:# line jogs|# lines jog} ($J=), which grbl refuses while a program moves (error:8)",
    severity=WARNING,
)
NOT_SIMULATED_SLASH = NOT_SIMULATED.says(
    "{count:# line has|# lines have} a /, for which grbl has no switch: it is always executed",
    severity=WARNING,
)
NOT_SIMULATED_REALTIME = NOT_SIMULATED.says(
    "{count:# line has|# lines have} one of the signs ! ? ~ in a comment, which grbl obeys there "
    "too: ! stops the machine",
    severity=WARNING,
)
NOT_SIMULATED_CHORDS = simulated_as_chords(NOT_SIMULATED)
PLACE_UNKNOWN_FRAME = PLACE_UNKNOWN.says(
    "the program changes to the work frame {frame}, whose place only the controller knows: what "
    "it cuts there is simulated as if both frames were one; give it: --set "
    "'dialect.work_offsets_mm={{G54=[0,0,0], {frame}=[…]}}'",
    severity=ERROR,
)
PLACE_UNKNOWN_HOME = PLACE_UNKNOWN.says(
    "{home} goes to a place that only the controller remembers, and is simulated as machine zero; "
    "give it: --set 'dialect.homes_mm={{{home}=[…]}}'",
    severity=WARNING,
)

EVENT_LEFT_OUT = ProgramCode.EVENT_LEFT_OUT.says(
    "the program names no tool, because grbl has no tool change: mount it before the program",
    severity=INFO,
)
TOOL_BY_HAND = ProgramCode.TOOL_BY_HAND.says(
    "the program stops {measured:# time|# times} for another tool ({tools}): mount it so that its "
    "tip is where that of the last one was, or set Z zero again; grbl does not jog while it "
    "stops, so either your sender holds M0 back, or write a program for each tool with --split "
    "tool",
    "stops",
    WARNING,
)
FEED_TOO_SLOW = ProgramCode.FEED_TOO_SLOW.says(
    "{count:# cut is|# cuts are} slower than the controller can step (it makes no less than "
    "{least_hz:g} steps a second): F{measured:g} runs at {limit:.3g} mm/min, and is simulated so",
    "mm_min",
)
