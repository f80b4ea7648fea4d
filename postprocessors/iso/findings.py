"""The findings of programs in a dialect that a machine file describes."""

from __future__ import annotations

from camtool.findings import INFO, TargetCode
from camtool.toolpath.findings import ProgramCode

from ..gcode.findings import simulated_as_chords

NOT_SIMULATED = TargetCode(
    "iso.NOT_SIMULATED",
    (INFO,),
    "the program has something that is simulated otherwise than the controller does it",
    "none",
)
NOT_SIMULATED_CHORDS = simulated_as_chords(NOT_SIMULATED)
ARC_MENDED_AS_LINES = ProgramCode.ARC_MENDED.says(
    "{measured:# arc is|# arcs are} written as lines within {tolerance:g} mm, since the dialect "
    "has no such arcs",
    "arcs",
    INFO,
)
WORDS_PASSED_OVER_CODES = ProgramCode.WORDS_PASSED_OVER.says(
    "{count:# block has|# blocks have} words that the machine file passes over ({words}), which "
    "move nothing here"
)
WORDS_PASSED_OVER_OFFSETS = ProgramCode.WORDS_PASSED_OVER.says(
    "{count:# block counts|# blocks count} a tool's length or radius (G41 to G44), which is taken "
    "for 0"
)

CODES = (NOT_SIMULATED,)
