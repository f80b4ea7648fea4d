"""The catalogue of findings: every code with its severity and explanation, and every sentence that
is said of one.

Findings are collected, never raised at the first. Whoever finds something calls a sentence with
the numbers (`yield HOLE_SIZE(where=…, measured=…, limit=…)`); how they are written stands here.
Sentences that only one machine says stand in that machine's own `findings.py`; a plug-in adds
codes of its own there too (`TargetCode`). docs/findings.md is made from all of them. Numbers are
stable: add, never renumber. Hundreds: 1xx drawing, 2xx planning, 3xx program, 4xx motion and
result, 5xx inspection.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from string import Formatter
from typing import Any, Final, Protocol, Self, TypeVar

from camtool.plain import one_line


class Severity(IntEnum):
    """How grave: an ERROR makes a command exit with 1 and write nothing."""

    INFO = 0
    WARNING = 1
    ERROR = 2


INFO: Final = Severity.INFO
WARNING: Final = Severity.WARNING
ERROR: Final = Severity.ERROR


class Code(IntEnum):
    """A code: number, severity (of several the usual one first), what it means, what to do."""

    severities: tuple[Severity, ...]
    means: str
    mend: str

    def __new__(
        cls, number: int, severity: Severity | tuple[Severity, ...], means: str, mend: str
    ) -> Self:
        """A code is its number, and carries what is known of it."""
        code = int.__new__(cls, number)
        code._value_ = number
        code.severities = severity if isinstance(severity, tuple) else (severity,)
        code.means, code.mend = means, mend
        return code

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
    NOTHING_DRAWN = (
        107,
        ERROR,
        "nothing in the drawing can be cut",
        "look at what was not used: `camtool check`",
    )
    SELF_CROSSING = (
        108,
        (WARNING, ERROR),
        "a contour crosses itself: inside and outside are not clear there; places are given; "
        "an error where it is to be carved (`vcarve`), there also for contours that cross each "
        "other",
        "correct the drawing, or cut it with `--side on`",
    )
    BRANCHED = (
        109,
        (WARNING, ERROR),
        "more than two ends meet at a point, so that lines could be joined in several ways; "
        "the straightest was taken; an error where a contour is cleared, carved or offset that "
        "encloses something else when they are joined in another way",
        "look at the picture of `camtool check --preview`; correct the drawing, lower `--gap`, or "
        "cut it with `--side on`",
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
    POINTS_MERGED = (
        117,
        (INFO, WARNING),
        "the scale brings points together that were apart in the drawing: they became one; a "
        "warning where whole paths became a point and are left out",
        "none, or a larger scale",
    )
    NO_GENERAL_TOLERANCE = (
        118,
        WARNING,
        "the general tolerance has no value for a dimension, which therefore has no limits: ISO "
        "2768-1 ends below 0.5 mm and above 2000 or 4000 mm, its class v begins over 3 mm, and "
        "form and position have none in it",
        "give the dimension limits of its own",
    )
    CALLOUT_NOT_READ = (
        119,
        INFO,
        "dimensions of the drawing that are not inspected, counted, with the reason: they measure "
        "angles, ordinates or lengths of arcs, or lack what they measure; a drawing without "
        "`--tolerances` is made all the same",
        "give their limits in `tolerances.toml` where they matter",
    )

    CONTOUR_TOO_SMALL = (
        201,
        WARNING,
        "the tool does not fit into a contour, which is left uncut; place and area are given",
        "use a smaller tool",
    )
    OPEN_CONTOUR_ON_LINE = (
        202,
        WARNING,
        "an open contour has no inside: it is cut on the line",
        "close it, or give `--side on`",
    )
    GOUGE = (
        203,
        (WARNING, ERROR),
        "the tool beside one contour cuts into another one, or into the allowance that is left "
        "on it, or a pocket clears away what another operation keeps, or an allowance below 0 "
        "takes more of what is to stay than there is; place and amount are given. A warning where "
        "the other contour is not cut, for what an allowance below 0 takes, and, where the job "
        "names the side, for contours of the same operation and contours that cross",
        'use a smaller tool, `side = "auto"`, or the right side; draw islands on a layer of '
        "the pocket",
    )
    OUT_OF_TRAVEL = (
        204,
        ERROR,
        "the path, part zero included, spans more than an axis can travel",
        "what the message names: `--origin lower-left`, `--rotate 90`, a lower `safe_z` or a "
        "smaller drawing; or set the travel of your machine (`--set axes.x.travel_mm=…`)",
    )
    UNREACHED = (
        205,
        (INFO, WARNING),
        "part of the shape is narrower than the tool, or is the foot of a corner: it stays "
        "uncut, with its place and area",
        "use a smaller tool, or reliefs (`corners`)",
    )
    OUT_OF_STOCK = (
        206,
        (INFO, WARNING, ERROR),
        "info: a cut goes through the stock into what lies below, as far as `spoilboard` in "
        "`[stock]` allows; error: farther, or a part or an engraving that goes beyond its edge, "
        "or what lies wholly beside it; warning: a pocket, a hole or an open line goes beyond the "
        "edge, or a cut runs wholly beside it",
        "correct `[stock]`, the origin or the depth",
    )
    RAPID_IN_STOCK = (
        207,
        ERROR,
        "a rapid runs through material below the stock top that is not yet cleared",
        "raise `safe_z`",
    )
    SLOT_AS_WIDE = (
        208,
        INFO,
        "a slot is as wide as the tool: it is cut along its middle",
        "none",
    )
    TAB_LEFT_OUT = (
        209,
        WARNING,
        "a tab does not fit where it should stand, or a hole is drilled through it; or "
        "(counted, in one) holes, open paths and contours that are too short get no tabs "
        "although other parts have them",
        "use fewer or narrower tabs, or another operation for what needs its own",
    )
    LEAD_LEFT_OUT = (
        210,
        WARNING,
        "a lead-in or lead-out would cut into material that is wanted, and was shortened or "
        "left out",
        "a shorter lead, or another start",
    )
    ENTRY_CHANGED = (
        211,
        WARNING,
        "a ramp or helix does not fit: it is steeper, smaller, or a plunge",
        "a smaller tool, or a plunge",
    )
    DEPTH_LIMITED = (
        212,
        WARNING,
        "carving with a V bit would go deeper than allowed: the bottom is flat there",
        "a greater depth, or a wider bit",
    )
    REVERSALS_IN_AIR = (
        213,
        INFO,
        "reversals were moved from cuts into the air, with the predicted error before and "
        "after; or contours that turn back stay in one piece, and why",
        "none ([reversals.md](reversals.md))",
    )
    NOT_RELIEVED = (
        214,
        WARNING,
        "an inner corner got no relief because it would cut into material that is wanted",
        "a smaller tool",
    )
    MARKS_NOT_CUT = (
        215,
        WARNING,
        "single points are drawn, and no operation drills them",
        "an operation of the kind `drill`",
    )
    NOT_DRILLED = (
        216,
        WARNING,
        "a path chosen for `drill` is not a circle, or is larger than `max_hole`: it is left out",
        "another operation for it, or a larger `max_hole`",
    )
    HOLE_SIZE = (
        217,
        WARNING,
        "circles are drawn with another diameter than that of the drill",
        "the right drill, or none if that is meant",
    )
    TOOL_NOT_SAID = (
        218,
        ERROR,
        "an operation has another tool than the one before it, and no number of its own by "
        "which the program could ask for it",
        "number the tools, or write a program for each",
    )
    SIDE_BY_UNCUT = (
        219,
        (WARNING, INFO),
        "contours are cut inside, or outside, because they lie in a contour that is not cut; "
        "or (info) although they lie in one on the layer of a frame",
        "name the layers that are no edges of parts (`--frames`), or give the side "
        "([toolpaths.md](toolpaths.md))",
    )
    NO_REST = (
        229,
        INFO,
        "there is nothing in a region that the tool of a `rest` reaches and what was cut before "
        "it has left",
        "none",
    )
    FINISH_IN_PASSES = (
        228,
        INFO,
        "a finishing pass meets more at some places than is left on the wall, because the tool "
        "that roughs does not get so far: it is cut in passes of `step_down` there, not at the "
        "full depth at once",
        "none, or a smaller tool for the roughing",
    )
    NOT_BORED = (
        227,
        (WARNING, INFO),
        "a path chosen for `bore` is not a circle, or has no room for the tool: it is left out; a "
        "remark where it lies within another circle, with which it is bored",
        "`drill` for circles as wide as the tool, a smaller tool for the others",
    )
    NOT_CHAMFERED = (
        230,
        WARNING,
        "a path chosen for `chamfer` is open: it has no side on which an edge would be, and is "
        "left out",
        'choose closed contours (`select = ["closed"]`), or close the path',
    )
    CUT_DOUBTFUL = (
        220,
        WARNING,
        "a setting of the cut looks forgotten or too high, but is used: no spindle speed, a "
        "tool of no width on closed contours, a plunge at the feed of the cut (these "
        "where the program starts the spindle), a pass deeper than the tool is wide, a cut "
        "deeper than its edges are long, a plunge of a tool that does not cut at its centre, "
        "a chip load or a surface speed beyond the tool's limits, walls and floors that a "
        "round nose does not reach, presets without a material, parts cut out of the stock "
        "without tabs",
        "the flag that is named, or none if that is meant",
    )
    TOOL_CHANGE_NOT_STATED = (
        231,
        WARNING,
        "tools are changed in the program, and the machine file does not state where: the tool is "
        "lifted to five times the safe height, as far as the travel of Z allows, and goes to "
        "where the machine parks",
        "`change_mm` and `change_z_mm` in `[defaults]` of the machine file, where the hand and "
        "the longest tool have room ([machines.md](machines.md))",
    )
    LOOSE_PIECE = (
        232,
        WARNING,
        "a closed contour within a part is cut through the stock without tabs, so that the piece "
        "within it comes loose beside the running tool, which may throw it or jam; place and size "
        "are given. What the tool mills away leaves no piece",
        "tabs in an operation of its own, a pocket that clears it, or tape below",
    )
    LINES_RUN_TOGETHER = (
        233,
        WARNING,
        "lines of an engraving are nearer to each other than the tool cuts wide at its depth, so "
        "that what is between them vanishes: the counters of letters, or letters that join; the "
        "narrowest place is given, and the widest tool that fits all",
        "a finer tool, a V bit, or larger letters",
    )
    TEXT_AS_EDGE = (
        234,
        WARNING,
        "outlines of text are cut as edges of parts and holes, and the tool has no room beside "
        "some of them",
        'engrave text: `kind = "engrave"`, `select = ["text"]`; `select = ["not text"]` where '
        "parts are cut",
    )
    TAB_SHARED = (
        225,
        (INFO, WARNING),
        "a cut was raised over the bridge of a tab that it would have cut away: round a "
        "neighbour, on the other side of a narrow contour, on a lead; a warning where the "
        "operation has no tabs itself, because it leaves material there",
        "none, or a wider spacing of the parts",
    )
    CORNER_FAR = (
        226,
        WARNING,
        "sharp or mitred joins take the tool more than five times its distance from the wall "
        "beyond a needle-like corner",
        '`joins = "round"`, or `"mitre"` with a low `mitre_limit`',
    )

    BLOCK_TOO_LONG = (
        301,
        (INFO, WARNING),
        "blocks are longer than the controller's buffer; a remark where that length is not known",
        "for `pic-mmh`: `--set dialect.form=annex`",
    )
    FEED_ROUNDED = (
        302,
        (INFO, WARNING),
        "the dialect cannot express the feed; the next lower one is used, or (a warning) the "
        "machine's only speed",
        "none, or choose a feed that it can express",
    )
    ARC_MENDED = (
        303,
        INFO,
        "arcs that would not have ended where wanted end on a step that the controller passes, "
        "and a short line goes on to the wanted end; in G-code, arcs that the controller would "
        "refuse by their rounded numbers are re-centred, split or become lines",
        "none",
    )
    MOVE_COLLAPSED = (
        304,
        (INFO, WARNING),
        "moves shorter than a step of the machine, or than the last decimal, were left out, "
        "and arcs as flat became lines; a warning where something drawn is not cut at all",
        "none",
    )
    MOVE_SPLIT = (
        305,
        (INFO, WARNING),
        "moves of X, Y and Z at once became small steps, flat and then down or up and then "
        "flat, because the machine moves XY or Z: nowhere deeper than the slope, and higher by "
        "the given step at most",
        "none",
    )
    FEED_ABOVE_LIMIT = (
        306,
        (ERROR, WARNING),
        "a feed that the machine, its link or (on a slope) its Z axis cannot keep up with; a "
        "warning in a program whose controller lowers it to what it can do (which is what "
        "is simulated), where `convert` writes the second machine's highest feed, and where a "
        "job asks for more than the rates of the axes: it is lowered to that",
        "lower the feed, or slope less",
    )
    VALUE_ROUNDED = (
        307,
        INFO,
        "a dwell or a spindle speed was rounded to what the dialect can express",
        "none",
    )
    EVENT_LEFT_OUT = (
        308,
        (WARNING, INFO),
        "the machine cannot switch the spindle (or whatever the message names), so it is not in "
        "the program; a remark where it is a tool or a speed",
        "do it by hand",
    )
    COORDINATES_SCALED = (
        309,
        WARNING,
        "the numbers of the program are millimetres times a scale, because what the machine "
        "makes of a unit is contradictory",
        "measure a move of known length, then set the scale: `--set dialect.coord_scale=…`",
    )
    PLACES_SNAPPED = (
        310,
        WARNING,
        "vertices were moved to the grid that the machine executes; the largest move is given",
        "none if that is fine enough, else scale the drawing up",
    )
    EXECUTED_OTHERWISE = (
        311,
        WARNING,
        "the machine makes something else of the program than its numbers say (distances cut "
        "short, a start that is ignored, lines bent by whole speeds)",
        "look at the predicted error; the message names the option",
    )
    WORDS_PASSED_OVER = (
        312,
        INFO,
        "a program switches coolant or waits for the operator (M0, M1): that moves nothing, "
        "and is left out when the program is converted",
        "none",
    )
    ARC_END_UNSURE = (
        316,
        WARNING,
        "arcs of a foreign program stop on their ends by some readings of the controller's "
        "stop test and not by others; where they end by each is given",
        "post the drawing with camtool, whose arcs end by every reading; or try the arc on the "
        "machine and set `controller.arc_end`",
    )
    SPINDLE_SPEED_NOT_SAID = (
        319,
        WARNING,
        "a program starts the spindle (M3, M4) before any S word: controllers take it, and one "
        "that sets the speed turns the spindle at 0",
        "write S, or set the speed by hand",
    )
    NEVER_READ = (
        320,
        WARNING,
        "lines behind the end of a program (M2, M30, the second `%`), which its controller "
        "never reads",
        "move the end behind them, or take them out",
    )
    FEED_TOO_SLOW = (
        321,
        WARNING,
        "cuts slower than the controller can step: it makes them faster than the program says, "
        "which is what is simulated",
        "a higher feed",
    )
    FEED_HELD = (
        322,
        (INFO, WARNING),
        "cuts that the machine makes slower than the program says, because a timer's shortest "
        "period holds them; a warning where they get less than half of it",
        "another feed, or a shorter period (the message names the option)",
    )
    READ_TWO_WAYS = (
        323,
        WARNING,
        "a program has numbers that can be read in two ways by its machine's thesis, which lead "
        "to different places",
        "post again (what camtool writes means the same in both), or set the option if you know "
        "which is right",
    )

    TOOL_BY_HAND = (
        324,
        WARNING,
        "the program stops for tools that the operator changes, where the controller has no tool "
        "change; what is to be mounted stands in front of each stop",
        "mount each with its tip where that of the last one was, or set Z zero again; or write a "
        "program for each tool with `--split tool`",
    )

    ARC_MISSES_END = (
        401,
        (ERROR, WARNING),
        "the controller never stands on the end of an arc (or of another move): the real "
        "machine would run on; a warning where it would stop beside it",
        "post the drawing again with `camtool post`",
    )
    CONTOUR_MISSING = (
        402,
        ERROR,
        "part of what was wanted is not cut by the program; a contour smaller than a "
        "dialect can express may be a plunge",
        "post again; give `camtool verify` the flags of the post",
    )
    EXTRA_CUT = (
        403,
        ERROR,
        "the program cuts where nothing was wanted",
        "post again; give `camtool verify` the flags of the post",
    )
    MANY_REVERSALS = (
        404,
        WARNING,
        "more reversals than parts of this size were seen to survive (`limits.small_part_mm`); "
        "each leaves an error",
        "cut larger, or simplify the drawing",
    )
    PLAY_NOT_KNOWN = (
        405,
        (INFO, WARNING),
        "an axis that moves has no known backlash, so its error is not predicted; a warning where "
        "fewer reversals were asked for and neither X nor Y has any",
        "measure it: `--set axes.z.backlash_mm=...`",
    )
    NO_MOTION = (
        406,
        WARNING,
        "the program moves nothing",
        "check that it is the right file",
    )
    RETURN_TO_MACHINE_ZERO = (
        407,
        INFO,
        "the program goes to machine zero, whose place is taken from the machine file",
        "set `controller.machine_zero_mm`",
    )
    ABOVE_GATE = (
        408,
        ERROR,
        "the part would come out worse, turn back more often or take longer than "
        "`--max-error`, `--max-reversals` or `--max-time` allow",
        "another machine setting, fewer reversals ([reversals.md](reversals.md)), or a wider "
        "limit",
    )
    END_NOT_REACHED = (
        409,
        (INFO, WARNING),
        "the controller leaves moves beside their programmed ends (as blending does); how "
        "many, and how far at most; a warning when that is far",
        "other settings of the controller ([its page](controllers/path.md)), or the predicted "
        "error is accepted",
    )
    FIT_COARSE = (
        410,
        WARNING,
        "from Python: a drawing was read for a smaller part than the job makes of it, so its "
        "curves were fitted more coarsely than the tolerance asks; how far they lie off is "
        "given, and is in the error",
        "read it with `scale=…`, or give its file instead of the drawing",
    )
    OVERCUT = (
        412,
        ERROR,
        "on the planned path itself, the tool (as wide as it is at its depth) goes beyond the "
        "drawn wall, and no `GOUGE` reports it: a fault in camtool, found before anything is cut",
        "report it with the drawing; try another tool or depth",
    )
    FEED_DIFFERS = (
        414,
        (WARNING, ERROR),
        "moves run at another feed than the job names; a warning where it names none and the "
        "machine's own is meant",
        "post again, or give `camtool verify` the flags of the post",
    )
    SPINDLE_DIFFERS = (
        415,
        (INFO, ERROR),
        "moves cut with the spindle off, turning the other way or at another speed than the "
        "job names; a remark where it names none",
        "post again; give `camtool verify` the flags of the post",
    )
    CUT_OTHER_WAY = (
        416,
        ERROR,
        "a contour is cut the other way round: climb for conventional, or against the way it "
        "is drawn",
        "post again; give `camtool verify` the flags of the post",
    )
    CLEARANCE_LOW = (
        417,
        (WARNING, ERROR),
        "rapids in XY run lower than `safe_z`; an error where the job names it, and on the stock",
        "raise the rapids",
    )
    END_DIFFERS = (
        418,
        (WARNING, ERROR),
        "the program lacks its end, or the tool ends lower than it should; a warning where it "
        "ends at another place in XY",
        "end the program, with the tool up",
    )
    SETTING_DIFFERS = (
        419,
        (INFO, WARNING, ERROR),
        "moves cut with another tool or other coolant than the job asks for, the tool waits less "
        "than it asks for (longer is a warning in the stock, a remark in the air), or corners are "
        "rounded farther than the machine file lets them (`G64 P`)",
        "post again; give `camtool verify` the flags of the post",
    )
    DRAWING_PLACE = (
        420,
        (ERROR, INFO),
        "where a drawing lies under a program that others made: its cuts do not follow the lines "
        "there, or would as well elsewhere (errors); a remark by how much the drawing was moved",
        "`--align` looks for the place, `--origin` gives it; `--scale`, `--mirror`, `--rotate` "
        "and `--units` as the message says",
    )
    TOOL_FOUND = (
        421,
        (ERROR, WARNING),
        "a program that others made keeps to several distances from the drawing, so that its tool "
        "is not known (an error), or to another one than that of the tool that was given",
        "give `--tool-diameter`",
    )
    NOT_CUT = (
        422,
        WARNING,
        "a program that others made does not cut this contour of the drawing, or a part of it",
        "none, if another program does, or tabs shall hold the part",
    )
    CUTS_BESIDE = (
        423,
        INFO,
        "a program that others made cuts where no contour of the drawing asks for it: leads, "
        "clearings of pockets, links",
        "none, if that is meant",
    )
    OFF_DRAWING = (
        424,
        WARNING,
        "a program that others made follows the drawing from afar: its chords or its digits are "
        "coarse",
        "`--max-error` makes an error of more than is allowed",
    )
    CUT_INTO_PART = (
        425,
        WARNING,
        "a program that others made cuts into what one of its contours leaves standing, as the "
        "drawing and the other cuts along that contour have it: a lead on the wrong side, a link "
        "in the stock",
        "lead in from the other side, or lift before the link; none for reliefs of corners",
    )
    MOVES_CHANGED = (
        426,
        WARNING,
        "the program has the blocks that camtool writes, and some of them end elsewhere by less "
        "than the tolerance of this comparison: it was changed after it was posted, or posted by "
        "another version",
        "post again, unless the change is meant",
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
        "cut it in the same program, or take the dimension out of tolerances.toml",
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


@dataclass(frozen=True)
class TargetCode:
    """A code of one target's own findings; its name begins with the target's: `mill.TOO_HOT`."""

    name: str
    severities: tuple[Severity, ...]
    means: str
    mend: str


@dataclass(frozen=True)
class Finding:
    """One thing found, with its place, the measured value and the limit where there are any.

    `unit` belongs to both `measured` and `limit` ("mm", "um", "chars", "mm_min", ...).
    """

    code: Code | TargetCode
    severity: Severity
    message: str
    where: str = ""
    measured: float | None = None
    limit: float | None = None
    unit: str = ""

    def __str__(self) -> str:
        place = f" [{self.where}]" if self.where else ""
        return one_line(f"{self.severity.name.lower()} {self.code.name}{place}: {self.message}")


@dataclass(frozen=True)
class Sentence:
    """What is said of a code; called with the numbers, it makes a finding.

    `text` is a format string. `{measured}` and `{limit}` are those of the finding, both in `unit`
    ("mm", "um", "chars", "mm_min", ...); all other names are given as keywords. A choice by number
    is written `{count:one|many}` or `{count:none|one|many}`, with `#` for the number itself (true
    is one, false none).
    `severity` stands where the code has several and the sentence one; else the caller may say it.

    >>> some = Sentence(Code.HOLE_SIZE, "{measured:# hole is|# holes are} wider than {drill:g} mm")
    >>> print(some(measured=1, drill=3.0, where="layer 0"))
    warning HOLE_SIZE [layer 0]: 1 hole is wider than 3 mm
    """

    code: Code | TargetCode
    text: str
    unit: str = ""
    severity: Severity | None = None

    def __call__(
        self,
        *,
        where: str = "",
        measured: float | None = None,
        limit: float | None = None,
        severity: Severity | None = None,
        **values: float | str,
    ) -> Finding:
        """The finding with its sentence."""
        given = self.severity if severity is None else severity
        return Finding(
            self.code,
            self.code.severities[0] if given is None else given,
            _TEXTS.vformat(self.text, (), {**values, "measured": measured, "limit": limit}),
            where=where,
            measured=None if measured is None else float(measured),
            limit=None if limit is None else float(limit),
            unit=self.unit,
        )

    def words(self, **values: float | str) -> str:
        """The sentence alone, where several make one finding."""
        return _TEXTS.vformat(self.text, (), values)


class _Texts(Formatter):
    """Format strings that know the choice by number."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """One value as the text has it."""
        if "|" not in format_spec:
            return format(value, format_spec)
        *none, one, many = format_spec.split("|")
        words = none[0] if none and value == 0 else one if value == 1 else many
        return words.replace("#", f"{value:.0f}")


_TEXTS: Final = _Texts()


MOST_ALIKE = 3
"""At most this many findings of one code and severity are listed one by one in texts for
people."""


class AnyFinding(Protocol):
    """A finding, here or in a report."""

    @property
    def code(self) -> Code | TargetCode | str:
        """What was found."""

    @property
    def severity(self) -> Severity | str:
        """How grave it is."""


_F = TypeVar("_F", bound=AnyFinding)


def summed(findings: Iterable[_F]) -> list[tuple[_F, int]]:
    """The first findings of each code and severity, in their order; the last of them with the
    number of those that are left out behind it, the others with 0."""
    alike: dict[tuple[object, object], list[_F]] = {}
    order = list(findings)
    for each in order:
        alike.setdefault((each.code, each.severity), []).append(each)
    shown = []
    for group in alike.values():
        shown += [(each, 0) for each in group[:MOST_ALIKE]]
        shown[-1] = (shown[-1][0], max(len(group) - MOST_ALIKE, 0))
    places = {id(each): place for place, each in enumerate(order)}
    return sorted(shown, key=lambda row: places[id(row[0])])


def worst(findings: tuple[Finding, ...] | list[Finding]) -> Severity:
    """The gravest severity present; INFO when there is no finding."""
    return max((f.severity for f in findings), default=Severity.INFO)


def _and_more(noun: str) -> str:
    """The end of a sentence of which only the first are listed; `more` is how many are not."""
    return f"{{more:|; and # more {noun.removesuffix('s')}|; and # more {noun}}}"


# What is said of drawings.

UNITLESS = Sentence(
    Code.UNITLESS,
    "the file names no unit ({said}): read as mm; if that is wrong, give --units",
)
UNITLESS_PX = Sentence(
    Code.UNITLESS,
    "{why}: read as px, {px_an_inch:g} an inch; if that is wrong, name the unit of a user unit "
    "with --units, or give --dpi",
)
IMPLAUSIBLE_SIZE = Sentence(
    Code.IMPLAUSIBLE_SIZE,
    "the drawing is {width:.6g} x {height:.6g} mm with unit {drawn_in} ({why}); if that is "
    "wrong, name the unit with --units",
    "mm",
)
ENTITY_SKIPPED = Sentence(Code.ENTITY_SKIPPED, "{measured} {kind} left out: {reason}")
GAP_OPEN = Sentence(Code.GAP_OPEN, "two open ends are {size_um:.4g} µm apart and stay open", "mm")
GAP_OPEN_MORE = Sentence(
    Code.GAP_OPEN,
    "{count:# more gap stays|# more gaps stay} open, of {least_um:.4g} to {most_um:.4g} µm",
    "mm",
)
FILE_REPAIRED = Sentence(
    Code.FILE_REPAIRED,
    "the file is faulty and was repaired ({measured}): {repairs}{more:|; and # more|; and # more}",
)
FILE_REPAIRED_BODIES = Sentence(
    Code.FILE_REPAIRED,
    "{measured} of {bodies:# body|# bodies} {measured:has|have} faces or edges that do not fit "
    "together",
)
FILE_REPAIRED_IN_PART = Sentence(
    Code.FILE_REPAIRED, "the file is damaged, something may be missing: {complaint}"
)
GAP_CLOSED = Sentence(Code.GAP_CLOSED, "a gap of {size_um:.4g} µm was closed", "mm")
GAP_CLOSED_MORE = Sentence(
    Code.GAP_CLOSED,
    "{count:# more gap was|# more gaps were} closed, of {least_um:.4g} to {most_um:.4g} µm",
    "mm",
)
NOTHING_DRAWN = Sentence(Code.NOTHING_DRAWN, "no contour is left to cut")
NOTHING_DRAWN_BUT_PATHS = Sentence(
    Code.NOTHING_DRAWN, "no contour is left to cut: use a smaller tool, or --side on"
)
NOTHING_DRAWN_TO_DRILL = Sentence(
    Code.NOTHING_DRAWN,
    "there is no hole to drill: no single point, and no circle that is small enough",
)
NOTHING_DRAWN_TO_CHAMFER = Sentence(
    Code.NOTHING_DRAWN, "there is no edge to chamfer: no closed contour"
)
NOTHING_DRAWN_TO_BORE = Sentence(
    Code.NOTHING_DRAWN, "there is no hole to bore: no circle that is wider than the tool"
)
SELF_CROSSING = Sentence(
    Code.SELF_CROSSING,
    "a closed contour crosses itself{measured:| at # places}",
    severity=WARNING,
)
SELF_CROSSING_MORE = Sentence(
    Code.SELF_CROSSING,
    "{measured:# more closed contour crosses itself|# more closed contours cross themselves}",
    severity=WARNING,
)
SELF_CROSSING_CARVED = Sentence(
    Code.SELF_CROSSING,
    "{contour} crosses {other}: it is not clear what is inside; correct the drawing, or carve "
    "without it",
    severity=ERROR,
)
SELF_CROSSING_NO_REGION = Sentence(
    Code.SELF_CROSSING, "{fault}: its inside cannot be carved; {mend}", severity=ERROR
)
BRANCHED = Sentence(
    Code.BRANCHED, "{measured} ends meet; the straightest were joined", severity=WARNING
)
BRANCHED_MORE = Sentence(
    Code.BRANCHED,
    "more than two ends meet at {measured:# more place|# more places}",
    severity=WARNING,
)
BRANCHED_REGION = Sentence(
    Code.BRANCHED,
    "{measured:#} ends meet here on {contour}, and what it encloses depends on which of them are "
    "joined; correct the drawing here, lower --gap, or cut it with --side on",
    severity=ERROR,
)
BRANCHED_REGION_MORE = Sentence(
    Code.BRANCHED,
    "contours pass {measured:# more place|# more places} where what they enclose depends on which "
    "ends are joined",
    severity=ERROR,
)
DRAWN_TWICE = Sentence(
    Code.DRAWN_TWICE,
    "{doubles} drawn twice and {overlaps} lying on others in whole or in part: {measured:.6g} mm "
    "left out",
    "mm",
)
TINY_MERGED = Sentence(
    Code.TINY_MERGED,
    "{measured:# segment|# segments} too short to matter {measured:was|were} merged",
)
ARCS_RECOGNISED = Sentence(Code.ARCS_RECOGNISED, "chords became {measured:# arc|# arcs}")
FONT_SUBSTITUTED = Sentence(Code.FONT_SUBSTITUTED, "{measured:# text|# texts}: {what}")
SECTION_CHOSEN = Sentence(
    Code.SECTION_CHOSEN,
    "the section at z = {heights} mm is drawn; the model spans z = {bottom:.6g} to {top:.6g} mm; "
    "--section-z chooses another height",
    "mm",
)
SECTION_CHOSEN_FACES = Sentence(
    Code.SECTION_CHOSEN,
    "the highest level face of each solid at z = {heights} mm is drawn; the model spans z = "
    "{bottom:.6g} to {top:.6g} mm; --section-z chooses another height",
    "mm",
)
NOT_APPLIED = Sentence(Code.NOT_APPLIED, "{measured} {what} {why}")
NOT_APPLIED_TO_ENTITY = Sentence(Code.NOT_APPLIED, "{measured} {kind}: {what} is not applied")
CALLOUT_NOT_READ = Sentence(
    Code.CALLOUT_NOT_READ,
    "{measured} {kind} cannot be inspected: {reason}",
)
NO_GENERAL_TOLERANCE = Sentence(
    Code.NO_GENERAL_TOLERANCE,
    "{general} has no value for a {kind} of {measured:.4g} mm: it has no limits",
    "mm",
)
UNIT_GUESSED = Sentence(
    Code.UNIT_GUESSED,
    "the file names no unit ({why}): read as {taken}; if that is wrong, name the unit with "
    "--units",
)
UNIT_GUESSED_BY_PROGRAM = Sentence(
    Code.UNIT_GUESSED,
    "{program} wrote the file, which took {px_an_inch:g} px an inch, and it was read so; if it "
    "comes out too large, give --dpi {usual:g}",
    severity=WARNING,
)
POINTS_MERGED = Sentence(
    Code.POINTS_MERGED,
    "at this scale {measured:# point lies|# points lie} within {near_nm:g} nm of the one before "
    "and {measured:was|were} merged{paths:|; # path is no longer than that and is left out|; # "
    "paths are no longer than that and are left out}",
)

# What planning says.

CONTOUR_TOO_SMALL = Sentence(
    Code.CONTOUR_TOO_SMALL,
    "{tool} does not fit into this contour of {measured:.6g} mm²: it is not cut",
    "mm2",
)
CONTOUR_TOO_SMALL_ROUND = Sentence(
    Code.CONTOUR_TOO_SMALL,
    "{tool} does not fit round this contour of {measured:.6g} mm²: it is not cut",
    "mm2",
)
CONTOUR_TOO_SMALL_POCKET = Sentence(
    Code.CONTOUR_TOO_SMALL,
    "{tool} does not fit into this pocket of {measured:.6g} mm²: it is not cut",
    "mm2",
)
CONTOUR_TOO_SMALL_FOR_TIP = Sentence(
    Code.CONTOUR_TOO_SMALL,
    "a flat tip of {limit:g} mm does not fit into this contour, which is {measured:.4g} mm wide: "
    "it is not carved",
    "mm",
)
OPEN_CONTOUR_ON_LINE = Sentence(
    Code.OPEN_CONTOUR_ON_LINE, "an open contour has no {side}: the tool runs on the line"
)
GOUGE = Sentence(Code.GOUGE, "{tool} beside {contour} cuts {amount:.4g} mm into {other}", "mm")
GOUGE_OF_UNCUT = Sentence(
    Code.GOUGE,
    "{tool} beside {contour} cuts {amount:.4g} mm into {other}, which is not cut itself",
    "mm",
)
GOUGE_OF_ALLOWANCE = Sentence(
    Code.GOUGE,
    "{tool} beside {contour} cuts {amount:.4g} mm into the allowance on {other}",
    "mm",
)
GOUGE_BEYOND = Sentence(
    Code.GOUGE,
    "{tool} cuts {amount:.4g} mm beyond the lines, and what is to stay is less than "
    "{measured:.4g} mm wide here: it is cut away from both sides",
    "mm",
    WARNING,
)
GOUGE_MORE = Sentence(Code.GOUGE, "{measured:# more place|# more places} like this")
GOUGE_BY_POCKET = Sentence(
    Code.GOUGE,
    "the pocket {pocket} clears away {contour}, {measured:.4g} mm wide, which another operation "
    "keeps: let the pocket take its layer too, as an island",
    "mm",
    ERROR,
)
GOUGE_BY_POCKET_MORE = Sentence(Code.GOUGE, "{measured:# more contour|# more contours} like this")
OUT_OF_TRAVEL = Sentence(
    Code.OUT_OF_TRAVEL,
    "{axis} spans {measured:.4f} mm with part zero, more than its travel of {limit:g} mm: {mend}",
    "mm",
)
OUT_OF_TRAVEL_IN_PROGRAM = Sentence(
    Code.OUT_OF_TRAVEL,
    "the program spans {measured:.3f} mm of {axis}, the axis has {limit:g} mm: {mend}",
    "mm",
)
UNREACHED = Sentence(
    Code.UNREACHED,
    "{tool} is too wide for this place: {measured:.4g} mm² stay uncut",
    "mm2",
    WARNING,
)
UNREACHED_MORE = Sentence(
    Code.UNREACHED,
    "{tool} is too wide for {places:# more place|# more places}: {measured:.4g} mm² stay uncut",
    "mm2",
    WARNING,
)
UNREACHED_CORNERS = Sentence(
    Code.UNREACHED,
    "{corners:an inner corner keeps|# inner corners keep} {measured:.4g} mm² that {tool} does "
    "not reach",
    "mm2",
    INFO,
)
UNREACHED_BY_TIP = Sentence(
    Code.UNREACHED,
    "a flat tip of {tip:g} mm leaves {places:# corner or narrow place|# corners or narrow "
    "places} uncut, {measured:.4g} mm² in all: use a bit with a smaller tip",
    "mm2",
    WARNING,
)
UNREACHED_BETWEEN = Sentence(
    Code.UNREACHED,
    "{tool} does not fit between {one} and {other}, {measured:.4g} mm apart: they stay joined",
    "mm",
    WARNING,
)
UNREACHED_BETWEEN_MORE = Sentence(
    Code.UNREACHED,
    "{measured:# more pair|# more pairs} of contours that {measured:stays|stay} joined",
    severity=WARNING,
)
OUT_OF_STOCK = Sentence(
    Code.OUT_OF_STOCK,
    "the tool cuts {measured:.4g} mm deep into a stock of {thickness:g} mm, more than "
    "{allowed:g} mm into what lies below: cut less deep, or allow more with spoilboard in "
    "[stock]",
    "mm",
    ERROR,
)
OUT_OF_STOCK_AS_ALLOWED = Sentence(
    Code.OUT_OF_STOCK,
    "the tool goes {through:.4g} mm through the stock of {thickness:g} mm into what lies below; "
    "up to {allowed:g} mm are allowed",
    "mm",
    INFO,
)
OUT_OF_STOCK_BESIDE = Sentence(
    Code.OUT_OF_STOCK,
    "{measured:# cut lies|# cuts lie} wholly beside the stock: check its corner, its size and "
    "the origin",
    "cuts",
    WARNING,
)
OUT_OF_STOCK_PART = Sentence(
    Code.OUT_OF_STOCK,
    "the {what} goes {measured:.4g} mm beyond the {edge} edge of the stock, so that it is not "
    "whole: move the origin or the copies, or correct [stock]",
    "mm",
    ERROR,
)
OUT_OF_STOCK_WHOLLY = Sentence(
    Code.OUT_OF_STOCK,
    "the {what} lies wholly beside the stock, {measured:.4g} mm beyond its {edge} edge: move the "
    "origin or the copies, or correct [stock]",
    "mm",
    ERROR,
)
OUT_OF_STOCK_PARTLY = Sentence(
    Code.OUT_OF_STOCK,
    "the {what} goes {measured:.4g} mm beyond the {edge} edge of the stock: correct the origin or "
    "[stock] if that is not meant",
    "mm",
    WARNING,
)
OUT_OF_STOCK_MORE = Sentence(
    Code.OUT_OF_STOCK, "{measured:# more contour|# more contours} like this"
)
RAPID_IN_STOCK = Sentence(
    Code.RAPID_IN_STOCK,
    "a rapid runs through the stock, {depth:.4g} mm below its top" + _and_more("rapids"),
    "mm",
)
RAPID_IN_STOCK_IN_PROGRAM = Sentence(
    Code.RAPID_IN_STOCK,
    "a rapid runs through the stock, {depth:.3f} mm below its top" + _and_more("rapids"),
    "mm",
)
SLOT_AS_WIDE = Sentence(
    Code.SLOT_AS_WIDE, "{tool} is as wide as this contour: it runs in its middle"
)
SLOT_AS_WIDE_IN_POCKET = Sentence(
    Code.SLOT_AS_WIDE, "a slot as wide as {tool} is cut along its middle", "mm"
)
TAB_LEFT_OUT = Sentence(
    Code.TAB_LEFT_OUT, "there is no room for a tab of this width: the contour has one less"
)
TAB_LEFT_OUT_DRILLED = Sentence(
    Code.TAB_LEFT_OUT, "a hole is drilled through this tab of {contour}: it may not hold"
)
TAB_LEFT_OUT_OF_ALL = Sentence(
    Code.TAB_LEFT_OUT,
    "{measured:# contour gets|# contours get} no tabs: {kinds}; cut them in an operation "
    "of their own if they need tabs",
    "contours",
)
LEAD_LEFT_OUT = Sentence(
    Code.LEAD_LEFT_OUT,
    "the {lead} is left out instead of {limit:g} mm: there is no room for it beside what is to "
    "stay",
    "mm",
)
LEAD_LEFT_OUT_IN_PART = Sentence(
    Code.LEAD_LEFT_OUT,
    "the {lead} is {measured:.4g} mm instead of {limit:g} mm: there is no room for it beside "
    "what is to stay",
    "mm",
)
ENTRY_CHANGED = Sentence(
    Code.ENTRY_CHANGED,
    "a ramp of {measured:.4g} mm is too long for a contour of {length:.4g} mm: the tool plunges",
    "mm",
)
ENTRY_CHANGED_IN_POCKET = Sentence(
    Code.ENTRY_CHANGED, "the tool goes down by {change}, which does not fit"
)
ENTRY_CHANGED_STEEPER = Sentence(
    Code.ENTRY_CHANGED,
    "the helix of a bore takes at most {limit} turns: its slope is {measured:.3g}°, not "
    "{wanted:.3g}°; use a smaller tool, or a steeper entry",
)
ENTRY_CHANGED_IN_NARROW_BORE = Sentence(
    Code.ENTRY_CHANGED,
    "a hole of {measured:.4g} mm is too narrow for {tool} to go down in a helix: it plunges in "
    "the middle{pecks}, and goes once round at the bottom; a drill or a smaller tool cuts it more "
    "easily",
    "mm",
)
LOOSE_PIECE = Sentence(
    Code.LOOSE_PIECE,
    "a piece of {width:.4g} by {height:.4g} mm comes loose within this contour beside the running "
    "tool, because nothing holds it: {mend}",
    "mm2",
)
LOOSE_PIECE_MORE = Sentence(
    Code.LOOSE_PIECE, "{measured:# more piece comes|# more pieces come} loose like this"
)
DEPTH_LIMITED = Sentence(
    Code.DEPTH_LIMITED,
    "a floor of {measured:.6g} mm² is left: up to {width:.4g} mm wide, bit and depth allow "
    "{allowed:.4g} mm; clear it with a pocket and a flat tool",
    "mm2",
)
REVERSALS_IN_AIR = Sentence(
    Code.REVERSALS_IN_AIR,
    "{limit:# reversal|# reversals} while cutting {limit:becomes|become} {measured}: "
    "{runs_before:# run is|# runs are} cut as {runs_after}; what backlash leaves over is at most "
    "{after_um:.3g} µm, not {before_um:.3g} µm",
)
REVERSALS_IN_AIR_NOT = Sentence(
    Code.REVERSALS_IN_AIR,
    "{measured:# contour that turns back is|# contours that turn back are} cut in one piece: "
    "{reason}",
)
NOT_RELIEVED = Sentence(Code.NOT_RELIEVED, "{tool} has no room for a relief at this corner")
MARKS_NOT_CUT = Sentence(
    Code.MARKS_NOT_CUT,
    "{measured:# single point is|# single points are} not cut: drill "
    "them with an operation of the kind drill",
)
NOT_DRILLED = Sentence(
    Code.NOT_DRILLED,
    "only full circles and single points are drilled: {measured:# other path is|# other paths "
    "are} left out",
)
NOT_DRILLED_TOO_LARGE = Sentence(
    Code.NOT_DRILLED,
    "circles of more than {limit:g} mm are not drilled: {count}, up to {measured:.6g} mm",
    "mm",
)
NO_REST = Sentence(Code.NO_REST, "{other} leaves nothing that {tool} can clear")
FINISH_IN_PASSES = Sentence(
    Code.FINISH_IN_PASSES,
    "up to {measured:.4g} mm are left beside the wall where the tool that roughs does not get: "
    "the wall is finished in {passes} passes",
    "mm",
)
FINISH_IN_PASSES_WHOLE = Sentence(
    Code.FINISH_IN_PASSES,
    "nothing is roughed: the wall is cut in {passes} passes",
)
NOT_BORED = Sentence(
    Code.NOT_BORED,
    "only full circles are bored: {measured:# other path is|# other paths are} left out",
    severity=WARNING,
)
NOT_CHAMFERED = Sentence(
    Code.NOT_CHAMFERED,
    "only edges of closed contours are chamfered: {measured:# open path is|# open paths are} left "
    "out",
)
NOT_BORED_TOO_SMALL = Sentence(
    Code.NOT_BORED,
    "{tool} bores circles wider than {limit:g} mm: {count:# circle|# circles} of {measured:.6g} "
    "mm or more {count:is|are} left out; drill {count:it|them}, or take a smaller tool",
    "mm",
    WARNING,
)
NOT_BORED_WITHIN = Sentence(
    Code.NOT_BORED,
    "{measured:# circle lies|# circles lie} within another one, with which "
    "{measured:it is|they are} bored",
    severity=INFO,
)
HOLE_SIZE = Sentence(
    Code.HOLE_SIZE,
    "{count:# circle|# circles} of {limit:g} mm {count:is|are} drilled with a drill of "
    "{measured:g} mm",
    "mm",
)
TOOL_NOT_SAID = Sentence(
    Code.TOOL_NOT_SAID,
    "the operation has another tool than the one before it and no number, so the program cannot "
    "ask for it: number the tools, or write a program for each (--split tool)",
)
TOOL_NOT_SAID_APART = Sentence(
    Code.TOOL_NOT_SAID,
    "the operation has another tool than the one before it and the same number {number}, so the "
    "program cannot ask for it: number the tools, or write a program for each (--split tool)",
)
TOOL_CHANGE_NOT_STATED = Sentence(
    Code.TOOL_CHANGE_NOT_STATED,
    "{count:a tool is|# tools are} changed {measured:.4g} mm above the stock here, because the "
    "file of {machine} states no place: give {keys} in its [defaults]",
    "mm",
)
LINES_RUN_TOGETHER = Sentence(
    Code.LINES_RUN_TOGETHER,
    "the tool cuts {measured:.4g} mm wide at this depth, and lines lie {limit:.4g} mm apart here"
    "{more:| (and at # more place)| (and at # more places)}, so that what is between them is cut "
    "away: take a tool of less than {limit:.4g} mm, or a V bit less deep",
    "mm",
)
TEXT_AS_EDGE = Sentence(
    Code.TEXT_AS_EDGE,
    "{measured:# contour is an outline|# contours are outlines} of text, cut as edges of parts: "
    'engrave text in an operation of its own (select = ["text"]), and leave it out here (select = '
    '["not text"])',
    "contours",
)
SIDE_BY_UNCUT = Sentence(
    Code.SIDE_BY_UNCUT,
    "{measured:# contour|# contours} would be cut on the other side without {uncut}, which "
    "is not cut: {first} is cut {side}; if {uncut} is not the edge of a part, give --frames "
    "{layer!r}, or the side",
    "contours",
    WARNING,
)
SIDE_BY_UNCUT_FRAME = Sentence(
    Code.SIDE_BY_UNCUT,
    "{measured:# contour|# contours} would be cut on the other side if {uncut}, on the layer of "
    "a frame, were the edge of a part: {first} is cut {side}; --frames lists the layers of frames",
    "contours",
    INFO,
)
EVENT_LEFT_OUT_COOLANT = Sentence(
    Code.EVENT_LEFT_OUT,
    "{count:# word for coolant is|# words for coolant are} left out: the machine has none (mist "
    "and flood of [coolant] in its file)",
    severity=WARNING,
)
CUT_DOUBTFUL = Sentence(Code.CUT_DOUBTFUL, "{reasons}")
CUT_DOUBTFUL_SPEED = Sentence(
    Code.CUT_DOUBTFUL, "no spindle speed is given, so the spindle stays off (--spindle)"
)
CUT_DOUBTFUL_WIDTH = Sentence(
    Code.CUT_DOUBTFUL,
    "the tool has no width, so it runs on the line of closed contours (--tool-diameter, or "
    "--side on)",
)
CUT_DOUBTFUL_DEPTH = Sentence(
    Code.CUT_DOUBTFUL,
    "a pass of {depth:.4g} mm is deeper than the tool of {width:g} mm is wide (--step-down)",
)
CUT_DOUBTFUL_BEYOND = Sentence(
    Code.CUT_DOUBTFUL,
    "{beyond:g} mm are cut beyond the lines, more than a quarter of the tool's radius "
    "(--allowance)",
)
CUT_DOUBTFUL_PLUNGE = Sentence(
    Code.CUT_DOUBTFUL,
    "the tool plunges at the feed of the cut, {feed:g} mm/min (--plunge-feed)",
)
CUT_DOUBTFUL_LENGTH = Sentence(
    Code.CUT_DOUBTFUL,
    "the cut is {depth:.4g} mm deep, and the edges of the tool are {length:g} mm long (--depth)",
)
CUT_DOUBTFUL_CENTRE = Sentence(
    Code.CUT_DOUBTFUL, "the tool plunges, and does not cut at its centre (--entry ramp)"
)
CUT_DOUBTFUL_CHIP = Sentence(
    Code.CUT_DOUBTFUL,
    "a chip load of {chip:.3g} mm, where {limits} mm are meant for the tool (--feed, --spindle)",
)
CUT_DOUBTFUL_EDGE = Sentence(
    Code.CUT_DOUBTFUL,
    "a surface speed of {speed:.4g} m/min, where {limits} m/min are meant for the tool "
    "(--spindle)",
)
CUT_DOUBTFUL_NOSE = Sentence(
    Code.CUT_DOUBTFUL,
    "the round nose of the tool leaves {nose:g} mm at the foot of walls (a deeper cut, or a flat "
    "tool)",
)
CUT_DOUBTFUL_RIDGES = Sentence(
    Code.CUT_DOUBTFUL,
    "the round nose of the tool leaves ridges of {ridge:.3g} mm on floors (--step-over)",
)
CUT_DOUBTFUL_LOOSE = Sentence(
    Code.CUT_DOUBTFUL, "parts are cut out of the stock, and nothing holds them (--tabs 4)"
)
CUT_DOUBTFUL_LOOSE_FINISH = Sentence(
    Code.CUT_DOUBTFUL,
    "parts are cut out of the stock before their finishing pass, and nothing holds them "
    "(--tabs 4)",
)
CUT_DOUBTFUL_PRESET = Sentence(
    Code.CUT_DOUBTFUL, "the tool has presets for {materials}, and none is taken (--material)"
)
TAB_SHARED = Sentence(
    Code.TAB_SHARED,
    "cuts are raised over {measured:# tab|# tabs}, which they would have cut away: the first "
    "over one of {contour}",
    "tabs",
    WARNING,
)
TAB_SHARED_WITH_OWN = Sentence(
    Code.TAB_SHARED,
    "cuts are raised over {measured:# tab|# tabs} of its own and its neighbours, which they "
    "would have cut away: the first over one of {contour}",
    "tabs",
    INFO,
)
CORNER_FAR = Sentence(
    Code.CORNER_FAR,
    "{joins} joins take the tool {measured:.4g} mm beyond a needle-like corner: use joins = "
    '"round", or "mitre" with a low limit',
    "mm",
)
CORNER_FAR_MORE = Sentence(Code.CORNER_FAR, "{measured:# more corner|# more corners}")

# What is said of programs.

FEED_ABOVE_LIMIT = Sentence(
    Code.FEED_ABOVE_LIMIT,
    "the tool moves at {measured:.4g} mm/min {direction}, {limit:.4g} is the highest of "
    "{machine}: lower the feed",
    "mm_min",
    ERROR,
)
FEED_ABOVE_LIMIT_ON_SLOPE = Sentence(
    Code.FEED_ABOVE_LIMIT,
    "the tool moves at {measured:.4g} mm/min {direction}, {limit:.4g} is the highest of "
    "{machine}: lower the feed, or slope less",
    "mm_min",
    ERROR,
)
FEED_ABOVE_LIMIT_IN_JOB = Sentence(
    Code.FEED_ABOVE_LIMIT,
    "the {feed} of {measured:g} mm/min becomes {lowered:g}, the rate of the axes in the file of "
    "{machine}: {mend}",
    "mm_min",
    WARNING,
)
FEED_ABOVE_LIMIT_LOWERED = Sentence(
    Code.FEED_ABOVE_LIMIT,
    "{cuts:# cut|# cuts} of up to {measured:g} mm/min {cuts:is|are} written at {limit:g}, the "
    "highest feed of {machine}",
    "mm_min",
    WARNING,
)

# What verification says.

DRAWING_PLACE_NOWHERE = Sentence(
    Code.DRAWING_PLACE,
    "{measured:.0f} % of the cuts follow the drawing, wherever it is moved",
    "%",
    ERROR,
)
DRAWING_PLACE_OTHERWISE = Sentence(
    Code.DRAWING_PLACE,
    "{measured:.0f} % of the cuts follow the drawing, {limit:.0f} % would with {flag}",
    "%",
    ERROR,
)
DRAWING_PLACE_ELSEWHERE = Sentence(
    Code.DRAWING_PLACE,
    "{measured:.0f} % of the cuts follow the drawing where its zero is, {limit:.0f} % would if it "
    "lay at X{x:.3f} Y{y:.3f}: --align",
    "%",
    ERROR,
)
DRAWING_PLACE_AMBIGUOUS = Sentence(
    Code.DRAWING_PLACE,
    "the cuts follow the drawing at X{x:.3f} Y{y:.3f} and as well at X{other_x:.3f} "
    "Y{other_y:.3f}: give its place with --origin in the place of --align",
    "%",
    ERROR,
)
DRAWING_PLACE_MOVED = Sentence(
    Code.DRAWING_PLACE, "the drawing was moved to X{x:.3f} Y{y:.3f}", severity=INFO
)
TOOL_FOUND_SEVERAL = Sentence(
    Code.TOOL_FOUND,
    "{share:.0%} of the cuts keep to the drawing for a tool of {measured:.3f} mm, "
    "{other_share:.0%} for one of {other:.3f} mm: give --tool-diameter",
    "mm",
    ERROR,
)
TOOL_FOUND_OTHER = Sentence(
    Code.TOOL_FOUND,
    "the cuts keep to the drawing for a tool of {measured:.3f} mm, not {limit:.3f} mm",
    "mm",
    WARNING,
)
NOT_CUT = Sentence(Code.NOT_CUT, "{contour} is not cut" + _and_more("contours"))
NOT_CUT_PART = Sentence(
    Code.NOT_CUT,
    "{measured:.3f} mm of the path along {contour} is not cut ({share:.0%})"
    + _and_more("contours"),
    "mm",
)
CUT_INTO_PART = Sentence(
    Code.CUT_INTO_PART,
    "cuts up to {measured:.3f} mm into what {contour} leaves standing" + _and_more("moves"),
    "mm",
)
CUTS_BESIDE = Sentence(
    Code.CUTS_BESIDE,
    "{measured:.3f} mm of cuts in {moves:# move follows|# moves follow} no contour of the drawing",
    "mm",
)
OFF_DRAWING = Sentence(
    Code.OFF_DRAWING, "the program runs up to {measured:.4f} mm beside the drawing", "mm"
)

ARC_MISSES_END = Sentence(
    Code.ARC_MISSES_END,
    "the {move} does not stop at its end, passing it {measured:.1f} steps away: the real machine "
    "would run on" + _and_more("arcs"),
    "steps",
    ERROR,
)
ARC_MISSES_END_FAR = Sentence(
    Code.ARC_MISSES_END,
    "the {move} does not stop at its end: the real machine would run on" + _and_more("arcs"),
    "steps",
    ERROR,
)
CONTOUR_MISSING = Sentence(
    Code.CONTOUR_MISSING,
    "{share:.0%} of {contour} is not cut by the program: up to {measured:.3f} mm from every "
    "decoded cutting move" + _and_more("contours"),
    "mm",
)
CONTOUR_MISSING_AT_DEPTH = Sentence(
    Code.CONTOUR_MISSING,
    "{share:.0%} of {contour} is not cut by the program: up to {measured:.3f} mm from every "
    "decoded cutting move, and none is at its depth" + _and_more("contours"),
    "mm",
)
CONTOUR_MISSING_NO_CUTS = Sentence(
    Code.CONTOUR_MISSING,
    "{share:.0%} of {contour} is not cut by the program: there are no decoded cutting moves at "
    "all" + _and_more("contours"),
    "mm",
)
CONTOUR_MISSING_ELSEWHERE = Sentence(
    Code.CONTOUR_MISSING,
    "cut {measured:.4f} mm beside what was asked" + _and_more("contours"),
    "mm",
)
CONTOUR_MISSING_OTHER_DEPTH = Sentence(
    Code.CONTOUR_MISSING,
    "what was asked is cut at another depth" + _and_more("contours"),
    "mm",
)
CONTOUR_MISSING_NOTHING_CUT = Sentence(
    Code.CONTOUR_MISSING,
    "the program cuts nothing" + _and_more("contours"),
    "mm",
)
CONTOUR_MISSING_HOLE = Sentence(
    Code.CONTOUR_MISSING,
    "a hole {measured:.3f} mm deep is not drilled by the program" + _and_more("holes"),
    "mm",
)
CONTOUR_MISSING_HOLE_DEPTH = Sentence(
    Code.CONTOUR_MISSING,
    "a hole {measured:.3f} mm deep is not drilled by the program: there is one of another depth"
    + _and_more("holes"),
    "mm",
)
EXTRA_CUT = Sentence(
    Code.EXTRA_CUT,
    "{share:.0%} of a cut was not wanted: up to {measured:.3f} mm from every wanted cutting move"
    + _and_more("cuts"),
    "mm",
)
EXTRA_CUT_AT_DEPTH = Sentence(
    Code.EXTRA_CUT,
    "{share:.0%} of a cut was not wanted: up to {measured:.3f} mm from every wanted cutting "
    "move, and none is at its depth" + _and_more("cuts"),
    "mm",
)
EXTRA_CUT_NONE_WANTED = Sentence(
    Code.EXTRA_CUT,
    "{share:.0%} of a cut was not wanted: there are no wanted cutting moves at all"
    + _and_more("cuts"),
    "mm",
)
EXTRA_CUT_ELSEWHERE = Sentence(
    Code.EXTRA_CUT,
    "a cut lies {measured:.4f} mm beside what was asked" + _and_more("contours"),
    "mm",
)
EXTRA_CUT_OTHER_DEPTH = Sentence(
    Code.EXTRA_CUT,
    "a cut is at another depth than was asked" + _and_more("contours"),
    "mm",
)
EXTRA_CUT_NOTHING_ASKED = Sentence(
    Code.EXTRA_CUT,
    "nothing was asked to be cut" + _and_more("contours"),
    "mm",
)
EXTRA_CUT_PLUNGE = Sentence(
    Code.EXTRA_CUT,
    "a plunge to {measured:.3f} mm was not asked for" + _and_more("plunges"),
    "mm",
)
EXTRA_CUT_AGAIN = Sentence(
    Code.EXTRA_CUT,
    "a move is cut {measured} times, asked for {limit:once|# times}" + _and_more("moves"),
    "times",
)
EXTRA_CUT_HOLE = Sentence(
    Code.EXTRA_CUT,
    "a hole {measured:.3f} mm deep was not wanted" + _and_more("holes"),
    "mm",
)
EXTRA_CUT_HOLE_DEPTH = Sentence(
    Code.EXTRA_CUT,
    "a hole {measured:.3f} mm deep was not wanted: there is one of another depth"
    + _and_more("holes"),
    "mm",
)
MANY_REVERSALS = Sentence(
    Code.MANY_REVERSALS,
    "X and Y reverse {measured:once|# times} while cutting a part of {size:.3g} mm; small parts "
    "were seen to fail above {limit}",
    "reversals",
)
PLAY_NOT_KNOWN = Sentence(
    Code.PLAY_NOT_KNOWN,
    "the machine file gives no backlash for {axis}: its error is predicted as if there were none",
    severity=INFO,
)
PLAY_NOT_KNOWN_TO_SAVE = Sentence(
    Code.PLAY_NOT_KNOWN,
    "no backlash is known of X and Y of {machine}, so that fewer reversals would gain nothing: "
    "give it with --set axes.x.backlash_mm=...",
    severity=WARNING,
)
NO_MOTION = Sentence(Code.NO_MOTION, "the program moves nothing")
NO_MOTION_BELOW = Sentence(
    Code.NO_MOTION, "the program cuts nothing: no feed move goes along below the stock top"
)
RETURN_TO_MACHINE_ZERO = Sentence(
    Code.RETURN_TO_MACHINE_ZERO,
    "the program returns to machine zero, which is taken to lie at ({zero}) mm from part zero "
    "(controller.machine_zero_mm)",
)
ABOVE_GATE = Sentence(
    Code.ABOVE_GATE,
    "the predicted error is {measured:.2f} µm at most; {limit:.2f} µm is allowed",
    "um",
)
ABOVE_GATE_UNKNOWN = Sentence(
    Code.ABOVE_GATE,
    "no error is known, because nothing was compared, so the limit is not met",
    "um",
)
ABOVE_GATE_GOUGED = Sentence(
    Code.ABOVE_GATE,
    "what stays is gouged by {measured:.2f} µm or more (see GOUGE); {limit:.2f} µm is allowed",
    "um",
)
ABOVE_GATE_REVERSALS = Sentence(
    Code.ABOVE_GATE,
    "X and Y reverse {measured:once|# times} while cutting; {limit} are allowed",
    "reversals",
)
ABOVE_GATE_TIME = Sentence(Code.ABOVE_GATE, "the program takes {takes}; {allowed} is allowed", "s")
END_NOT_REACHED = Sentence(
    Code.END_NOT_REACHED,
    "the controller leaves {count:# move beside its end|# moves beside their ends}, up to "
    "{measured:.2f} µm",
    "um",
)
FIT_COARSE = Sentence(
    Code.FIT_COARSE,
    "the drawing was read for a part {read:.4g} times its size and is scaled {scale:.4g} times: "
    "its curves lie up to {off_um:.4g} µm off; read it with scale={scale:.6g}",
    "mm",
)
OVERCUT = Sentence(
    Code.OVERCUT, "the cut itself goes {measured:.4g} mm beyond what is drawn", "mm"
)
FEED_DIFFERS = Sentence(
    Code.FEED_DIFFERS,
    "{moves:# move runs|# moves run} at another feed: {measured:g} mm/min, where {limit:g} is "
    "asked for",
    "mm_min",
    ERROR,
)
FEED_DIFFERS_OWN = Sentence(
    Code.FEED_DIFFERS,
    "{moves:# move runs|# moves run} at another feed: {measured:g} mm/min, where {limit:g} is "
    "the machine's own",
    "mm_min",
    WARNING,
)
FEED_DIFFERS_IN_AIR = Sentence(
    Code.FEED_DIFFERS,
    "{moves:# move runs|# moves run} at a feed in the air, {measured:g} mm/min, where a rapid is "
    "meant: slow, and harmless",
    "mm_min",
    WARNING,
)
SPINDLE_DIFFERS = Sentence(
    Code.SPINDLE_DIFFERS,
    "{moves:# move runs|# moves run} with {turning}, where {wanted} is asked for",
    "rev_min",
    ERROR,
)
SPINDLE_DIFFERS_UNASKED = Sentence(
    Code.SPINDLE_DIFFERS,
    "{moves:# move runs|# moves run} with {turning}, where {wanted} is not asked for",
    "rev_min",
    INFO,
)
CUT_OTHER_WAY = Sentence(
    Code.CUT_OTHER_WAY,
    "the cut runs the other way round than was asked" + _and_more("contours"),
)
CLEARANCE_LOW = Sentence(
    Code.CLEARANCE_LOW,
    "{rapids:# rapid runs|# rapids run} lower than Z {limit:g} mm, asked for: down to Z "
    "{measured:g} mm",
    "mm",
)
CLEARANCE_LOW_OWN = Sentence(
    Code.CLEARANCE_LOW,
    "{rapids:# rapid runs|# rapids run} lower than Z {limit:g} mm, the machine's own: down to Z "
    "{measured:g} mm",
    "mm",
)
MOVES_CHANGED = Sentence(
    Code.MOVES_CHANGED,
    "{moves:# move ends|# moves end} elsewhere than in the program that camtool writes, by "
    "{measured:.4g} mm at most; all others are the same",
    "mm",
)
END_DIFFERS = Sentence(
    Code.END_DIFFERS,
    "the tool ends at Z {measured:g} mm, where Z {limit:g} mm is asked for",
    "mm",
)
END_DIFFERS_NO_END = Sentence(
    Code.END_DIFFERS, "the program has no block that ends it", severity=ERROR
)
END_DIFFERS_PLACE = Sentence(
    Code.END_DIFFERS, "the tool ends at {end}; camtool would end at {wanted}", severity=WARNING
)
SETTING_DIFFERS_WAIT = Sentence(
    Code.SETTING_DIFFERS,
    "the tool stands still {where_it} for {measured:g} s at {places:# place|# places}, where "
    "{limit:g} s is asked for",
    "s",
)
SETTING_DIFFERS_TOOL = Sentence(
    Code.SETTING_DIFFERS,
    "{moves:# move runs|# moves run} with tool {measured:g}, where tool {limit:g} is asked for",
    severity=ERROR,
)
SETTING_DIFFERS_TOOL_UNASKED = Sentence(
    Code.SETTING_DIFFERS,
    "{moves:# move runs|# moves run} with tool {measured:g}, where no tool is asked for",
    severity=INFO,
)
SETTING_DIFFERS_COOLANT = Sentence(
    Code.SETTING_DIFFERS,
    "{moves:# move runs|# moves run} with {coolant}, where {wanted} is asked for",
    severity=ERROR,
)
SETTING_DIFFERS_COOLANT_UNASKED = Sentence(
    Code.SETTING_DIFFERS,
    "{moves:# move runs|# moves run} with {coolant}, where none is asked for",
    severity=INFO,
)
SETTING_DIFFERS_CORNERS = Sentence(
    Code.SETTING_DIFFERS,
    "{moves:# move runs|# moves run} with corners rounded {room}, where {limit:g} mm is asked for",
    "mm",
    ERROR,
)
SETTING_DIFFERS_NO_CORNERS = Sentence(
    Code.SETTING_DIFFERS,
    "{moves:# move runs|# moves run} with corners rounded {room}, where none is to be rounded",
    "mm",
    ERROR,
)
SETTING_DIFFERS_DWELL = Sentence(
    Code.SETTING_DIFFERS,
    "the tool waits {measured:g} s, where {limit:g} s are asked for; at {places:# place|# places}",
    "s",
    ERROR,
)
DIMENSION_UNBOUND = Sentence(
    Code.DIMENSION_UNBOUND,
    "{name} is not inspected: {measured:nothing that is drawn fits|one fits|# features fit}",
    severity=WARNING,
)
DIMENSION_NOT_CUT = Sentence(
    Code.DIMENSION_NOT_CUT,
    "{name} is not inspected: the program does not cut its {what}",
    severity=WARNING,
)
DIMENSION_NOT_CUT_THERE = Sentence(
    Code.DIMENSION_NOT_CUT,
    "{name} is not inspected: the slides leave what is drawn by too much, or may leave it",
    severity=WARNING,
)
CALLOUT_TEXT = Sentence(
    Code.CALLOUT_TEXT,
    "the text {text!r} is not understood: this dimension is not inspected",
    severity=WARNING,
)
DIMENSION_DIFFERS = Sentence(
    Code.DIMENSION_DIFFERS,
    "{name} is to be {limit:.6g} mm, but {measured:.6g} mm are drawn",
    "mm",
    ERROR,
)
DIMENSION_DIFFERS_VIEW = Sentence(
    Code.DIMENSION_DIFFERS,
    "says {limit:.6g} mm where {measured:.6g} mm are drawn, by the scale of its view (DIMLFAC, or "
    "that of its block): it is not inspected",
    "mm",
    WARNING,
)
DIMENSION_TWICE = Sentence(
    Code.DIMENSION_TWICE, "measures the same as {holds}, which holds", severity=INFO
)
DIMENSION_TWICE_DIFFERS = Sentence(
    Code.DIMENSION_TWICE,
    "measures the same as {holds} with other limits ({limits}, there {others}), which hold",
    severity=WARNING,
)
COUNT_DIFFERS = Sentence(
    Code.COUNT_DIFFERS,
    "{name} counts {limit:.0f} equal features, but {measured:.0f} of this size are drawn: only "
    "this one is inspected",
)
NOTHING_REQUIRED = Sentence(
    Code.NOTHING_REQUIRED,
    "no dimension with limits was inspected, so that nothing is known of what --require asks",
)
DIMENSION_NOT_IN_OUT = Sentence(
    Code.DIMENSION_NOT_IN,
    "{name} is out: {measured:.4f} mm at worst, where {limit:.4f} mm is the limit",
    "mm",
)
DIMENSION_NOT_IN_UNDECIDED = Sentence(
    Code.DIMENSION_NOT_IN,
    "{name} is undecided: {measured:.4f} mm at worst, where {limit:.4f} mm is the limit; {why}",
    "mm",
)
