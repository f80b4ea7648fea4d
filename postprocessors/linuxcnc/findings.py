"""The findings that only programs for LinuxCNC have."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING, TargetCode
from camtool.toolpath.findings import ProgramCode

from ..gcode.findings import simulated_as_chords

NOT_SIMULATED = TargetCode(
    "linuxcnc.NOT_SIMULATED",
    (WARNING, INFO),
    "the program asks for something that is not simulated, or not as the machine does it: other "
    "axes than X, Y and Z, moves that follow the spindle, blocks that a switch may leave out",
    "none, if that is meant",
)
PLACE_UNKNOWN = TargetCode(
    "linuxcnc.PLACE_UNKNOWN",
    (WARNING, ERROR),
    "the program goes to a place that only the machine remembers: a second work frame (error), or "
    "that of G28 and G30 (warning); it is simulated as if that were machine zero",
    "give its place: `dialect.work_offsets_mm`, `dialect.homes_mm`",
)
VALUE_UNKNOWN = TargetCode(
    "linuxcnc.VALUE_UNKNOWN",
    (WARNING,),
    "the program reads a numbered parameter that it has not set: it is taken as 0, and LinuxCNC "
    "takes what its parameter file has, if it is one of those",
    "set it in the program",
)
TOOL_LENGTH = TargetCode(
    "linuxcnc.TOOL_LENGTH",
    (WARNING, ERROR),
    "several tools cut, and one of them without its own length in force: with lengths in the tool "
    "table it cuts too deep, or air (error where `dialect.tools` says the lengths)",
    "write G43 behind each M6; the post does so unless `dialect.tool_lengths` is false",
)
NO_END = TargetCode(
    "linuxcnc.NO_END",
    (ERROR,),
    "the file ends without an end of the program: LinuxCNC reports an error when it reads so far, "
    "and may stop within the last moves; all of them are judged",
    "end with M2, or put a line of % before and behind the program",
)
CODES = (NO_END, NOT_SIMULATED, PLACE_UNKNOWN, VALUE_UNKNOWN, TOOL_LENGTH)

NO_END_OF_FILE = NO_END.says(
    "the file ends without an end of the program, which LinuxCNC reports as an error; end with "
    "M2, or put a line of % before and behind the program",
    severity=ERROR,
)
WORDS_PASSED_OVER_OUTPUT = ProgramCode.WORDS_PASSED_OVER.says(
    "{count:# block switches|# blocks switch} an output of the machine (M62 to M68), which moves "
    "nothing and is skipped"
)
NOT_SIMULATED_SPINDLE = NOT_SIMULATED.says(
    "{count:# block follows|# blocks follow} the spindle (G33, G74, G76, G84): its moves are "
    "simulated at the feed that the programmed speed makes of them, or at the F in force",
    severity=WARNING,
)
NOT_SIMULATED_INPUT = NOT_SIMULATED.says(
    "{count:# block reads|# blocks read} an input of the machine (M66): it is taken to come at "
    "once, and #5399 to be 0; what the program does when it does not come is not simulated",
    severity=WARNING,
)
NOT_SIMULATED_AGAIN = NOT_SIMULATED.says(
    "M99 begins the program again and again: it is simulated once", severity=WARNING
)
NOT_SIMULATED_TAP = NOT_SIMULATED.says(
    "{count:# move|# moves} of G74 or G84 in the plane of G18 or G19: LinuxCNC 2.9 takes the axes "
    "there for each other, and goes where nobody wants it to; write G17",
    severity=WARNING,
)
NOT_SIMULATED_AXES = NOT_SIMULATED.says(
    "the program moves {axes}, which a machine of X, Y and Z refuses; only X, Y and Z are read",
    severity=WARNING,
)
NOT_SIMULATED_DELETED = NOT_SIMULATED.says(
    "{count:# line begins|# lines begin} with /, which a switch of the operator's leaves out; "
    "{count:it is|they are} {how} here (dialect.block_delete)",
    severity=WARNING,
)
NOT_SIMULATED_CHORDS = simulated_as_chords(NOT_SIMULATED)
PLACE_UNKNOWN_FRAME = PLACE_UNKNOWN.says(
    "the program changes to the work frame {frame}, whose place only the machine knows: what it "
    "cuts there is simulated as if both frames were one; give it: --set "
    "'dialect.work_offsets_mm={{G54=[0,0,0], \"{frame}\"=[…]}}'",
    severity=ERROR,
)
PLACE_UNKNOWN_HOME = PLACE_UNKNOWN.says(
    "{home} goes to a place that only the machine remembers, and is simulated as machine zero; "
    "give it: --set 'dialect.homes_mm={{{home}=[…]}}'",
    severity=WARNING,
)
VALUE_UNKNOWN_PARAMETER = VALUE_UNKNOWN.says(
    "{count:# parameter is|# parameters are} read before the program sets {count:it|them}, first "
    "#{first:g}: taken as 0"
)
TOOL_LENGTH_WRONG = TOOL_LENGTH.says(
    "tool {tool} cuts {measured:.4g} mm higher or lower than the others, by its length in "
    "dialect.tools: another length is in force, or none; write G43 H{tool} behind its M6",
    "mm",
    ERROR,
)
TOOL_LENGTH_NOT_USED = TOOL_LENGTH.says(
    "several tools cut, and no length of their own is in force (G43) for {tools}: that is right "
    "only where the machine measures each tool at M6; write G43 behind each M6, or give the "
    "lengths: --set dialect.tools.1.length_mm=…",
    severity=WARNING,
)
