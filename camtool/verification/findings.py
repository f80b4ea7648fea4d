"""Codes and sentences of verification: errors predicted, and programs unlike their job."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING, Code, and_more
from camtool.toolpath.findings import ProgramCode


class VerificationCode(Code):
    """Codes of verification."""

    CONTOUR_MISSING = (
        402,
        ERROR,
        "part of what was wanted is not cut by the program; a contour smaller than a "
        "dialect can express may be a plunge",
        "post again; give `camtool verify` the flags of the post",
    )
    SECTION_CUT = (
        428,
        INFO,
        "the section that the predicted cut of a lathe leaves: how deep it goes into the wanted "
        "one, and how much stays, with places",
        "none",
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
    NO_MOTION = (406, WARNING, "the program moves nothing", "check that it is the right file")
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
        "`--max-error`, `--max-gouge`, `--max-leftover`, `--max-engagement`, `--max-reversals` or "
        "`--max-time` allow, or it is not proved that it keeps to one of the limits of the stock",
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


OUT_OF_TRAVEL_IN_PROGRAM = ProgramCode.OUT_OF_TRAVEL.says(
    "the program spans {measured:.3f} mm of {axis}, the axis has {limit:g} mm: {mend}", "mm"
)
DRAWING_PLACE_NOWHERE = VerificationCode.DRAWING_PLACE.says(
    "{measured:.0f} % of the cuts follow the drawing, wherever it is moved", "%", ERROR
)
DRAWING_PLACE_OTHERWISE = VerificationCode.DRAWING_PLACE.says(
    "{measured:.0f} % of the cuts follow the drawing, {limit:.0f} % would with {flag}", "%", ERROR
)
DRAWING_PLACE_ELSEWHERE = VerificationCode.DRAWING_PLACE.says(
    "{measured:.0f} % of the cuts follow the drawing where its zero is, {limit:.0f} % would if it "
    "lay at X{x:.3f} Y{y:.3f}: --align",
    "%",
    ERROR,
)
DRAWING_PLACE_AMBIGUOUS = VerificationCode.DRAWING_PLACE.says(
    "the cuts follow the drawing at X{x:.3f} Y{y:.3f} and as well at X{other_x:.3f} "
    "Y{other_y:.3f}: give its place with --origin in the place of --align",
    "%",
    ERROR,
)
DRAWING_PLACE_MOVED = VerificationCode.DRAWING_PLACE.says(
    "the drawing was moved to X{x:.3f} Y{y:.3f}", severity=INFO
)
TOOL_FOUND_SEVERAL = VerificationCode.TOOL_FOUND.says(
    "{share:.0%} of the cuts keep to the drawing for a tool of {measured:.3f} mm, "
    "{other_share:.0%} for one of {other:.3f} mm: give --tool-diameter",
    "mm",
    ERROR,
)
TOOL_FOUND_OTHER = VerificationCode.TOOL_FOUND.says(
    "the cuts keep to the drawing for a tool of {measured:.3f} mm, not {limit:.3f} mm",
    "mm",
    WARNING,
)
NOT_CUT = VerificationCode.NOT_CUT.says("{contour} is not cut" + and_more("contours"))
NOT_CUT_PART = VerificationCode.NOT_CUT.says(
    "{measured:.3f} mm of the path along {contour} is not cut ({share:.0%})"
    + and_more("contours"),
    "mm",
)
CUT_INTO_PART = VerificationCode.CUT_INTO_PART.says(
    "cuts up to {measured:.3f} mm into what {contour} leaves standing" + and_more("moves"), "mm"
)
CUTS_BESIDE = VerificationCode.CUTS_BESIDE.says(
    "{measured:.3f} mm of cuts in {moves:# move follows|# moves follow} no contour of the drawing",
    "mm",
)
OFF_DRAWING = VerificationCode.OFF_DRAWING.says(
    "the program runs up to {measured:.4f} mm beside the drawing", "mm"
)
ARC_MISSES_END = ProgramCode.ARC_MISSES_END.says(
    "the {move} does not stop at its end, passing it {measured:.1f} steps away: the real machine "
    "would run on" + and_more("arcs"),
    "steps",
    ERROR,
)
ARC_MISSES_END_FAR = ProgramCode.ARC_MISSES_END.says(
    "the {move} does not stop at its end: the real machine would run on" + and_more("arcs"),
    "steps",
    ERROR,
)
CONTOUR_MISSING = VerificationCode.CONTOUR_MISSING.says(
    "{share:.0%} of {contour} is not cut by the program: up to {measured:.3f} mm from every "
    "decoded cutting move" + and_more("contours"),
    "mm",
)
CONTOUR_MISSING_AT_DEPTH = VerificationCode.CONTOUR_MISSING.says(
    "{share:.0%} of {contour} is not cut by the program: up to {measured:.3f} mm from every "
    "decoded cutting move, and none is at its depth" + and_more("contours"),
    "mm",
)
CONTOUR_MISSING_NO_CUTS = VerificationCode.CONTOUR_MISSING.says(
    "{share:.0%} of {contour} is not cut by the program: there are no decoded cutting moves at "
    "all" + and_more("contours"),
    "mm",
)
CONTOUR_MISSING_ELSEWHERE = VerificationCode.CONTOUR_MISSING.says(
    "cut {measured:.4f} mm beside what was asked" + and_more("contours"), "mm"
)
CONTOUR_MISSING_OTHER_DEPTH = VerificationCode.CONTOUR_MISSING.says(
    "what was asked is cut at another depth" + and_more("contours"), "mm"
)
CONTOUR_MISSING_NOTHING_CUT = VerificationCode.CONTOUR_MISSING.says(
    "the program cuts nothing" + and_more("contours"), "mm"
)
CONTOUR_MISSING_HOLE = VerificationCode.CONTOUR_MISSING.says(
    "a hole {measured:.3f} mm deep is not drilled by the program" + and_more("holes"), "mm"
)
CONTOUR_MISSING_HOLE_DEPTH = VerificationCode.CONTOUR_MISSING.says(
    "a hole {measured:.3f} mm deep is not drilled by the program: there is one of another depth"
    + and_more("holes"),
    "mm",
)
EXTRA_CUT = VerificationCode.EXTRA_CUT.says(
    "{share:.0%} of a cut was not wanted: up to {measured:.3f} mm from every wanted cutting move"
    + and_more("cuts"),
    "mm",
)
EXTRA_CUT_AT_DEPTH = VerificationCode.EXTRA_CUT.says(
    "{share:.0%} of a cut was not wanted: up to {measured:.3f} mm from every wanted cutting "
    "move, and none is at its depth" + and_more("cuts"),
    "mm",
)
EXTRA_CUT_NONE_WANTED = VerificationCode.EXTRA_CUT.says(
    "{share:.0%} of a cut was not wanted: there are no wanted cutting moves at all"
    + and_more("cuts"),
    "mm",
)
EXTRA_CUT_ELSEWHERE = VerificationCode.EXTRA_CUT.says(
    "a cut lies {measured:.4f} mm beside what was asked" + and_more("contours"), "mm"
)
EXTRA_CUT_OTHER_DEPTH = VerificationCode.EXTRA_CUT.says(
    "a cut is at another depth than was asked" + and_more("contours"), "mm"
)
EXTRA_CUT_NOTHING_ASKED = VerificationCode.EXTRA_CUT.says(
    "nothing was asked to be cut" + and_more("contours"), "mm"
)
EXTRA_CUT_PLUNGE = VerificationCode.EXTRA_CUT.says(
    "a plunge to {measured:.3f} mm was not asked for" + and_more("plunges"), "mm"
)
EXTRA_CUT_AGAIN = VerificationCode.EXTRA_CUT.says(
    "a move is cut {measured} times, asked for {limit:once|# times}" + and_more("moves"), "times"
)
EXTRA_CUT_HOLE = VerificationCode.EXTRA_CUT.says(
    "a hole {measured:.3f} mm deep was not wanted" + and_more("holes"), "mm"
)
EXTRA_CUT_HOLE_DEPTH = VerificationCode.EXTRA_CUT.says(
    "a hole {measured:.3f} mm deep was not wanted: there is one of another depth"
    + and_more("holes"),
    "mm",
)
MANY_REVERSALS = VerificationCode.MANY_REVERSALS.says(
    "X and Y reverse {measured:once|# times} while cutting a part of {size:.3g} mm; small parts "
    "were seen to fail above {limit}",
    "reversals",
)
PLAY_NOT_KNOWN = ProgramCode.PLAY_NOT_KNOWN.says(
    "the machine file gives no backlash for {axis}: its error is predicted as if there were none",
    severity=INFO,
)
NO_MOTION = VerificationCode.NO_MOTION.says("the program moves nothing")
NO_MOTION_BELOW = VerificationCode.NO_MOTION.says(
    "the program cuts nothing: no feed move goes along below the stock top"
)
RETURN_TO_MACHINE_ZERO = VerificationCode.RETURN_TO_MACHINE_ZERO.says(
    "the program returns to machine zero, which is taken to lie at ({zero}) mm from part zero "
    "(controller.machine_zero_mm)"
)
ABOVE_GATE = VerificationCode.ABOVE_GATE.says(
    "the predicted error is {measured:.2f} µm at most; {limit:.2f} µm is allowed", "um"
)
ABOVE_GATE_UNKNOWN = VerificationCode.ABOVE_GATE.says(
    "no error is known, because nothing was compared, so the limit is not met", "um"
)
ABOVE_GATE_GOUGED = VerificationCode.ABOVE_GATE.says(
    "what stays is gouged by {measured:.2f} µm or more (see GOUGE); {limit:.2f} µm is allowed",
    "um",
)
ABOVE_GATE_STOCK = VerificationCode.ABOVE_GATE.says(
    "the {what} is {measured:.2f} µm at X {x:.3f} Y {y:.3f}{most}; {limit:.2f} µm is allowed", "um"
)
ABOVE_GATE_NOT_PROVED = VerificationCode.ABOVE_GATE.says(
    "no {what} above {limit:.2f} µm was found, but {proved} is proved", "um"
)
ABOVE_GATE_NO_STOCK = VerificationCode.ABOVE_GATE.says(
    "no {what} is known without a drawing, a job and its tools, so the limit is not met", "um"
)
ABOVE_GATE_ENGAGEMENT = VerificationCode.ABOVE_GATE.says(
    "{operation}: the tool is engaged by {measured:.2f} degrees {place}; {limit:.2f} are allowed",
    "°",
)
ABOVE_GATE_NO_ENGAGEMENT = VerificationCode.ABOVE_GATE.says(
    "the engagement is not known, so the limit is not met: {reason}", "°"
)
ABOVE_GATE_REVERSALS = VerificationCode.ABOVE_GATE.says(
    "X and Y reverse {measured:once|# times} while cutting; {limit} are allowed", "reversals"
)
ABOVE_GATE_TIME = VerificationCode.ABOVE_GATE.says(
    "the program takes {takes}; {allowed} is allowed", "s"
)
END_NOT_REACHED = VerificationCode.END_NOT_REACHED.says(
    "the controller leaves {count:# move beside its end|# moves beside their ends}, up to "
    "{measured:.2f} µm",
    "um",
)
OVERCUT = VerificationCode.OVERCUT.says(
    "the cut itself goes {measured:.4g} mm beyond what is drawn", "mm"
)
FEED_DIFFERS = VerificationCode.FEED_DIFFERS.says(
    "{moves:# move runs|# moves run} at another feed: {measured:g} mm/min, where {limit:g} is "
    "asked for",
    "mm_min",
    ERROR,
)
FEED_DIFFERS_OWN = VerificationCode.FEED_DIFFERS.says(
    "{moves:# move runs|# moves run} at another feed: {measured:g} mm/min, where {limit:g} is "
    "the machine's own",
    "mm_min",
    WARNING,
)
FEED_DIFFERS_IN_AIR = VerificationCode.FEED_DIFFERS.says(
    "{moves:# move runs|# moves run} at a feed in the air, {measured:g} mm/min, where a rapid is "
    "meant: slow, and harmless",
    "mm_min",
    WARNING,
)
SPINDLE_DIFFERS = VerificationCode.SPINDLE_DIFFERS.says(
    "{moves:# move runs|# moves run} with {turning}, where {wanted} is asked for", "rev_min", ERROR
)
SPINDLE_DIFFERS_UNASKED = VerificationCode.SPINDLE_DIFFERS.says(
    "{moves:# move runs|# moves run} with {turning}, where {wanted} is not asked for",
    "rev_min",
    INFO,
)
CUT_OTHER_WAY = VerificationCode.CUT_OTHER_WAY.says(
    "the cut runs the other way round than was asked" + and_more("contours")
)
CLEARANCE_LOW = VerificationCode.CLEARANCE_LOW.says(
    "{rapids:# rapid runs|# rapids run} lower than Z {limit:g} mm, asked for: down to Z "
    "{measured:g} mm",
    "mm",
)
CLEARANCE_LOW_OWN = VerificationCode.CLEARANCE_LOW.says(
    "{rapids:# rapid runs|# rapids run} lower than Z {limit:g} mm, the machine's own: down to Z "
    "{measured:g} mm",
    "mm",
)
MOVES_CHANGED = VerificationCode.MOVES_CHANGED.says(
    "{moves:# move ends|# moves end} elsewhere than in the program that camtool writes, by "
    "{measured:.4g} mm at most; all others are the same",
    "mm",
)
END_DIFFERS = VerificationCode.END_DIFFERS.says(
    "the tool ends at Z {measured:g} mm, where Z {limit:g} mm is asked for", "mm"
)
END_DIFFERS_NO_END = VerificationCode.END_DIFFERS.says(
    "the program has no block that ends it", severity=ERROR
)
END_DIFFERS_PLACE = VerificationCode.END_DIFFERS.says(
    "the tool ends at {end}; camtool would end at {wanted}", severity=WARNING
)
SETTING_DIFFERS_WAIT = VerificationCode.SETTING_DIFFERS.says(
    "the tool stands still {where_it} for {measured:g} s at {places:# place|# places}, where "
    "{limit:g} s is asked for",
    "s",
)
SETTING_DIFFERS_TOOL = VerificationCode.SETTING_DIFFERS.says(
    "{moves:# move runs|# moves run} with tool {measured:g}, where tool {limit:g} is asked for",
    severity=ERROR,
)
SETTING_DIFFERS_TOOL_UNASKED = VerificationCode.SETTING_DIFFERS.says(
    "{moves:# move runs|# moves run} with tool {measured:g}, where no tool is asked for",
    severity=INFO,
)
SETTING_DIFFERS_COOLANT = VerificationCode.SETTING_DIFFERS.says(
    "{moves:# move runs|# moves run} with {coolant}, where {wanted} is asked for", severity=ERROR
)
SETTING_DIFFERS_COOLANT_UNASKED = VerificationCode.SETTING_DIFFERS.says(
    "{moves:# move runs|# moves run} with {coolant}, where none is asked for", severity=INFO
)
SETTING_DIFFERS_CORNERS = VerificationCode.SETTING_DIFFERS.says(
    "{moves:# move runs|# moves run} with corners rounded {room}, where {limit:g} mm is asked for",
    "mm",
    ERROR,
)
SETTING_DIFFERS_NO_CORNERS = VerificationCode.SETTING_DIFFERS.says(
    "{moves:# move runs|# moves run} with corners rounded {room}, where none is to be rounded",
    "mm",
    ERROR,
)
SETTING_DIFFERS_DWELL = VerificationCode.SETTING_DIFFERS.says(
    "the tool waits {measured:g} s, where {limit:g} s are asked for; at {places:# place|# places}",
    "s",
    ERROR,
)
SECTION_CUT = VerificationCode.SECTION_CUT.says(
    "the predicted cut goes up to {gouge:.3g} µm into the section (at X {x:.3f} Y {y:.3f}) and "
    "leaves up to {measured:.3g} µm of it",
    "um",
)
