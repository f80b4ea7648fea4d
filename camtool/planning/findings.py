"""Codes and sentences of planning: what a tool cannot cut, and what planning changed."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING, Code
from camtool.geometry.findings import ContourCode
from camtool.toolpath.findings import ProgramCode


class PlanningCode(Code):
    """Codes of planning."""

    NOTHING_DRAWN = (
        107,
        ERROR,
        "nothing in the drawing can be cut",
        "look at what was not used: `camtool check`",
    )
    POINTS_MERGED = (
        117,
        (INFO, WARNING),
        "the scale brings points together that were apart in the drawing: they became one; a "
        "warning where whole paths became a point and are left out",
        "none, or a larger scale",
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
    UNREACHED = (
        205,
        (INFO, WARNING),
        "part of the shape is narrower than the tool, or is the foot of a corner, or the scallop "
        "of adaptive clearing in one: it stays uncut, with its place and size",
        "use a smaller tool, reliefs (`corners`), or `finish`",
    )
    OUT_OF_STOCK = (
        206,
        (INFO, WARNING, ERROR),
        "info: a cut goes through the stock into what lies below, as far as `spoilboard` in "
        "`[stock]` allows; error: farther, or a part or an engraving that goes beyond its edge, "
        "or what lies wholly beside it, as clamps (`[[keep_out]]`) and the ends of leads may; "
        "warning: a pocket, a hole or an open line goes beyond the edge, or a cut runs wholly "
        "beside it",
        "correct `[stock]`, the origin or the depth",
    )
    SLOT_AS_WIDE = (
        208,
        (INFO, WARNING),
        "a slot is as wide as the tool: it is cut along its middle; warning: it is too narrow for "
        "adaptive clearing, and is cut with the whole width of the tool, beyond its limit",
        "none, or a smaller tool",
    )
    TAB_LEFT_OUT = (
        209,
        WARNING,
        "a tab does not fit where it should stand, or a hole is drilled through it, or the tool "
        "that roughs, which makes the tabs, does not get there; or (counted, in one) holes, open "
        "paths and contours that are too short get no tabs although other parts have them",
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
    PINS_PROPOSED = (
        236,
        INFO,
        "a set-up turns the part over, and has no `pins`; places are proposed where two holes "
        "would meet again, in the waste of the stock",
        "the pins in `[[setups]]`, and an operation of the kind `pins` in the first set-up",
    )
    NOSE_LEAVES = (
        237,
        INFO,
        "the nose of a turning insert leaves material in a corner of the section, with its place",
        "none, or an insert with a smaller nose",
    )
    OVERHANG_NOT_JUDGED = (
        238,
        INFO,
        "the length of a turned part that stands out of the chuck, and over its thinnest "
        "diameter: how far it bends is not modelled",
        "light cuts, or a centre, beyond three diameters",
    )
    THREAD_FORM = (239, INFO, "the form of a thread: pitch, diameters, angle and passes", "none")
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
    NOT_BORED = (
        227,
        (WARNING, INFO),
        "a path chosen for `bore` is not a circle, or has no room for the tool: it is left out; a "
        "remark where it lies within another circle, with which it is bored",
        "`drill` for circles as wide as the tool, a smaller tool for the others",
    )
    FINISH_IN_PASSES = (
        228,
        INFO,
        "a finishing pass meets more at some places than is left on the wall, because the tool "
        "that roughs does not get so far: it is cut in passes of `step_down` there, not at the "
        "full depth at once",
        "none, or a smaller tool for the roughing",
    )
    NO_REST = (
        229,
        INFO,
        "there is nothing in a region that the tool of a `rest`, or of an adaptive pocket, "
        "reaches and what was cut before it has left",
        "none",
    )
    NOT_CHAMFERED = (
        230,
        WARNING,
        "a path chosen for `chamfer` is open: it has no side on which an edge would be, and is "
        "left out",
        'choose closed contours (`select = ["closed"]`), or close the path',
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
    LONG = (
        235,
        WARNING,
        "what is cut is larger than any machine, far from part zero, or makes very many moves, "
        "and the job allows it (`allow`)",
        "look at units and steps; leave `long` out of `allow`",
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
    FIT_COARSE = (
        410,
        WARNING,
        "from Python: a drawing was read for a smaller part than the job makes of it, so its "
        "curves were fitted more coarsely than the tolerance asks; how far they lie off is "
        "given, and is in the error",
        "read it with `scale=…`, or give its file instead of the drawing",
    )


NOTHING_DRAWN = PlanningCode.NOTHING_DRAWN.says("no contour is left to cut")
NOTHING_DRAWN_BUT_PATHS = PlanningCode.NOTHING_DRAWN.says(
    "no contour is left to cut: use a smaller tool, or --side on"
)
PINS_PROPOSED = PlanningCode.PINS_PROPOSED.says(
    "the part is turned over without alignment pins; holes of {diameter:.4g} mm would meet again "
    "at {pins}"
)
NOTHING_DRAWN_TO_DRILL = PlanningCode.NOTHING_DRAWN.says(
    "there is no hole to drill: no single point, and no circle that is small enough"
)
NOTHING_DRAWN_TO_CHAMFER = PlanningCode.NOTHING_DRAWN.says(
    "there is no edge to chamfer: no closed contour"
)
NOTHING_DRAWN_TO_BORE = PlanningCode.NOTHING_DRAWN.says(
    "there is no hole to bore: no circle that is wider than the tool"
)
SELF_CROSSING_CARVED = ContourCode.SELF_CROSSING.says(
    "{contour} crosses {other}: it is not clear what is inside; correct the drawing, or carve "
    "without it",
    severity=ERROR,
)
SELF_CROSSING_NO_REGION = ContourCode.SELF_CROSSING.says(
    "{fault}: its inside cannot be carved; {mend}", severity=ERROR
)
BRANCHED_REGION = ContourCode.BRANCHED.says(
    "{measured:#} ends meet here on {contour}, and what it encloses depends on which of them are "
    "joined; correct the drawing here, lower --gap, or cut it with --side on",
    severity=ERROR,
)
BRANCHED_REGION_MORE = ContourCode.BRANCHED.says(
    "contours pass {measured:# more place|# more places} where what they enclose depends on which "
    "ends are joined",
    severity=ERROR,
)
POINTS_MERGED = PlanningCode.POINTS_MERGED.says(
    "at this scale {measured:# point lies|# points lie} within {near_nm:g} nm of the one before "
    "and {measured:was|were} merged{paths:|; # path is no longer than that and is left out|; # "
    "paths are no longer than that and are left out}"
)
CONTOUR_TOO_SMALL = PlanningCode.CONTOUR_TOO_SMALL.says(
    "{tool} does not fit into this contour of {measured:.6g} mm²: it is not cut", "mm2"
)
CONTOUR_TOO_SMALL_ROUND = PlanningCode.CONTOUR_TOO_SMALL.says(
    "{tool} does not fit round this contour of {measured:.6g} mm²: it is not cut", "mm2"
)
CONTOUR_TOO_SMALL_POCKET = PlanningCode.CONTOUR_TOO_SMALL.says(
    "{tool} does not fit into this pocket of {measured:.6g} mm²: it is not cut", "mm2"
)
CONTOUR_TOO_SMALL_FOR_TIP = PlanningCode.CONTOUR_TOO_SMALL.says(
    "a flat tip of {limit:g} mm does not fit into this contour, which is {measured:.4g} mm wide: "
    "it is not carved",
    "mm",
)
OPEN_CONTOUR_ON_LINE = PlanningCode.OPEN_CONTOUR_ON_LINE.says(
    "an open contour has no {side}: the tool runs on the line"
)
GOUGE = ProgramCode.GOUGE.says("{tool} beside {contour} cuts {amount:.4g} mm into {other}", "mm")
GOUGE_OF_UNCUT = ProgramCode.GOUGE.says(
    "{tool} beside {contour} cuts {amount:.4g} mm into {other}, which is not cut itself", "mm"
)
GOUGE_OF_ALLOWANCE = ProgramCode.GOUGE.says(
    "{tool} beside {contour} cuts {amount:.4g} mm into the allowance on {other}", "mm"
)
GOUGE_BEYOND = ProgramCode.GOUGE.says(
    "{tool} cuts {amount:.4g} mm beyond the lines, and what is to stay is less than "
    "{measured:.4g} mm wide here: it is cut away from both sides",
    "mm",
    WARNING,
)
GOUGE_MORE = ProgramCode.GOUGE.says("{measured:# more place|# more places} like this")
GOUGE_AT_LEAST = ProgramCode.GOUGE.says("at least {measured:# more place|# more places} like this")
GOUGE_BY_POCKET = ProgramCode.GOUGE.says(
    "the pocket {pocket} clears away {contour}, {measured:.4g} mm wide, which another operation "
    "keeps: let the pocket take its layer too, as an island",
    "mm",
    ERROR,
)
GOUGE_BY_POCKET_MORE = ProgramCode.GOUGE.says(
    "{measured:# more contour|# more contours} like this"
)
OUT_OF_TRAVEL = ProgramCode.OUT_OF_TRAVEL.says(
    "{axis} spans {measured:.4f} mm with part zero, more than its travel of {limit:g} mm: {mend}",
    "mm",
)
UNREACHED = PlanningCode.UNREACHED.says(
    "{tool} is too wide for this place: {measured:.4g} mm² stay uncut", "mm2", WARNING
)
UNREACHED_MORE = PlanningCode.UNREACHED.says(
    "{tool} is too wide for {places:# more place|# more places}: {measured:.4g} mm² stay uncut",
    "mm2",
    WARNING,
)
UNREACHED_CORNERS = PlanningCode.UNREACHED.says(
    "{corners:an inner corner keeps|# inner corners keep} {measured:.4g} mm² that {tool} does "
    "not reach",
    "mm2",
    INFO,
)
UNREACHED_SCALLOP = PlanningCode.UNREACHED.says(
    "adaptive clearing leaves a scallop in {corners:an inner corner|# inner corners}, up to "
    "{measured:.3g} mm thick: finish takes it",
    "mm",
    INFO,
)
UNREACHED_BY_TIP = PlanningCode.UNREACHED.says(
    "a flat tip of {tip:g} mm leaves {places:# corner or narrow place|# corners or narrow "
    "places} uncut, {measured:.4g} mm² in all: use a bit with a smaller tip",
    "mm2",
    WARNING,
)
UNREACHED_BETWEEN = PlanningCode.UNREACHED.says(
    "{tool} does not fit between {one} and {other}, {measured:.4g} mm apart: they stay joined",
    "mm",
    WARNING,
)
UNREACHED_BETWEEN_MORE = PlanningCode.UNREACHED.says(
    "{measured:# more pair|# more pairs} of contours that {measured:stays|stay} joined",
    severity=WARNING,
)
OUT_OF_STOCK = PlanningCode.OUT_OF_STOCK.says(
    "the tool cuts {measured:.4g} mm deep into a stock of {thickness:g} mm, more than "
    "{allowed:g} mm into what lies below: cut less deep, or allow more with spoilboard in "
    "[stock]",
    "mm",
    ERROR,
)
OUT_OF_STOCK_AS_ALLOWED = PlanningCode.OUT_OF_STOCK.says(
    "the tool goes {through:.4g} mm through the stock of {thickness:g} mm into what lies below; "
    "up to {allowed:g} mm are allowed",
    "mm",
    INFO,
)
OUT_OF_STOCK_BESIDE = PlanningCode.OUT_OF_STOCK.says(
    "{measured:# cut lies|# cuts lie} wholly beside the stock: check its corner, its size and "
    "the origin",
    "cuts",
    WARNING,
)
OUT_OF_STOCK_PART = PlanningCode.OUT_OF_STOCK.says(
    "the {what} goes {measured:.4g} mm beyond the {edge} edge of the stock, so that it is not "
    "whole: move the origin or the copies, or correct [stock]",
    "mm",
    ERROR,
)
OUT_OF_STOCK_WHOLLY = PlanningCode.OUT_OF_STOCK.says(
    "the {what} lies wholly beside the stock, {measured:.4g} mm beyond its {edge} edge: move the "
    "origin or the copies, or correct [stock]",
    "mm",
    ERROR,
)
OUT_OF_STOCK_PARTLY = PlanningCode.OUT_OF_STOCK.says(
    "the {what} goes {measured:.4g} mm beyond the {edge} edge of the stock: correct the origin or "
    "[stock] if that is not meant",
    "mm",
    WARNING,
)
OUT_OF_STOCK_MORE = PlanningCode.OUT_OF_STOCK.says(
    "{measured:# more contour|# more contours} like this"
)
OUT_OF_STOCK_CLAMP = PlanningCode.OUT_OF_STOCK.says(
    "the box lies {measured:.4g} mm beside the {edge} edge of the stock, so that no clamp there "
    "holds it: correct the box or [stock], or --allow off-stock if it is no clamp",
    "mm",
    ERROR,
)
OUT_OF_STOCK_LEAD = PlanningCode.OUT_OF_STOCK.says(
    "at the end of the {lead} the whole tool is beside the stock, {measured:.4g} mm beyond its "
    "{edge} edge: a shorter lead, another start, a larger stock, or --allow off-stock if it is "
    "free there",
    "mm",
    ERROR,
)
OUT_OF_STOCK_MORE_LEADS = PlanningCode.OUT_OF_STOCK.says(
    "{measured:# more lead|# more leads} like this", severity=ERROR
)
SLOT_AS_WIDE = PlanningCode.SLOT_AS_WIDE.says(
    "{tool} is as wide as this contour: it runs in its middle", severity=INFO
)
SLOT_AS_WIDE_IN_POCKET = PlanningCode.SLOT_AS_WIDE.says(
    "a slot as wide as {tool} is cut along its middle", "mm", INFO
)
SLOT_AS_WIDE_ADAPTIVE = PlanningCode.SLOT_AS_WIDE.says(
    "a place {measured:.5g} mm wide is too narrow for adaptive clearing by {tool}: it is cut with "
    "the whole width of the tool, which no limit of engagement holds for",
    "mm",
    WARNING,
)
TAB_LEFT_OUT = PlanningCode.TAB_LEFT_OUT.says(
    "there is no room for a tab of this width: the contour has one less"
)
TAB_LEFT_OUT_OF_SLOT = PlanningCode.TAB_LEFT_OUT.says(
    "there is no room for a tab of this width with stock beyond the slot to hold on to: the "
    "contour has one less"
)
TAB_LEFT_OUT_DRILLED = PlanningCode.TAB_LEFT_OUT.says(
    "a hole is drilled through this tab of {contour}: it may not hold"
)
TAB_LEFT_OUT_ROUGH = PlanningCode.TAB_LEFT_OUT.says(
    "{measured:# tab holds|# tabs hold} this part instead of {limit:.0f}: roughing makes them, "
    "and its tool does not get all round the part (leave out finish, or take a smaller tool)",
    "tabs",
)
TAB_LEFT_OUT_OF_ALL = PlanningCode.TAB_LEFT_OUT.says(
    "{measured:# contour gets|# contours get} no tabs: {kinds}; cut them in an operation "
    "of their own if they need tabs",
    "contours",
)
LEAD_LEFT_OUT = PlanningCode.LEAD_LEFT_OUT.says(
    "the {lead} is left out instead of {limit:g} mm: there is no room for it beside what is to "
    "stay",
    "mm",
)
LEAD_LEFT_OUT_IN_PART = PlanningCode.LEAD_LEFT_OUT.says(
    "the {lead} is {measured:.4g} mm instead of {limit:g} mm: there is no room for it beside "
    "what is to stay",
    "mm",
)
ENTRY_CHANGED = PlanningCode.ENTRY_CHANGED.says(
    "a ramp of {measured:.4g} mm is too long for a contour of {length:.4g} mm: the tool plunges",
    "mm",
)
ENTRY_CHANGED_IN_POCKET = PlanningCode.ENTRY_CHANGED.says(
    "the tool goes down by {change}, which does not fit"
)
ENTRY_CHANGED_STEEPER = PlanningCode.ENTRY_CHANGED.says(
    "the helix of a bore takes at most {limit} turns: its slope is {measured:.3g}°, not "
    "{wanted:.3g}°; use a smaller tool, or a steeper entry"
)
ENTRY_CHANGED_IN_NARROW_BORE = PlanningCode.ENTRY_CHANGED.says(
    "a hole of {measured:.4g} mm is too narrow for {tool} to go down in a helix: it plunges in "
    "the middle{pecks}, and goes once round at the bottom; a drill or a smaller tool cuts it more "
    "easily",
    "mm",
)
DEPTH_LIMITED = PlanningCode.DEPTH_LIMITED.says(
    "a floor of {measured:.6g} mm² is left: up to {width:.4g} mm wide, bit and depth allow "
    "{allowed:.4g} mm; clear it with a pocket and a flat tool",
    "mm2",
)
REVERSALS_IN_AIR = PlanningCode.REVERSALS_IN_AIR.says(
    "{limit:# reversal|# reversals} while cutting {limit:becomes|become} {measured}: "
    "{runs_before:# run is|# runs are} cut as {runs_after}; what backlash leaves over is at most "
    "{after_um:.3g} µm, not {before_um:.3g} µm"
)
REVERSALS_IN_AIR_NOT = PlanningCode.REVERSALS_IN_AIR.says(
    "{measured:# contour that turns back is|# contours that turn back are} cut in one piece: "
    "{reason}"
)
NOT_RELIEVED = PlanningCode.NOT_RELIEVED.says("{tool} has no room for a relief at this corner")
MARKS_NOT_CUT = PlanningCode.MARKS_NOT_CUT.says(
    "{measured:# single point is|# single points are} not cut: drill "
    "them with an operation of the kind drill"
)
NOT_DRILLED = PlanningCode.NOT_DRILLED.says(
    "only full circles and single points are drilled: {measured:# other path is|# other paths "
    "are} left out"
)
NOT_DRILLED_TOO_LARGE = PlanningCode.NOT_DRILLED.says(
    "circles of more than {limit:g} mm are not drilled: {count}, up to {measured:.6g} mm", "mm"
)
NO_REST = PlanningCode.NO_REST.says("{other} leaves nothing that {tool} can clear")
FINISH_IN_PASSES = PlanningCode.FINISH_IN_PASSES.says(
    "up to {measured:.4g} mm are left beside the wall where the tool that roughs does not get: "
    "the wall is finished in {passes} passes",
    "mm",
)
FINISH_IN_PASSES_WHOLE = PlanningCode.FINISH_IN_PASSES.says(
    "nothing is roughed: the wall is cut in {passes} passes"
)
NOT_BORED = PlanningCode.NOT_BORED.says(
    "only full circles are bored: {measured:# other path is|# other paths are} left out",
    severity=WARNING,
)
NOT_CHAMFERED = PlanningCode.NOT_CHAMFERED.says(
    "only edges of closed contours are chamfered: {measured:# open path is|# open paths are} left "
    "out"
)
NOT_BORED_TOO_SMALL = PlanningCode.NOT_BORED.says(
    "{tool} bores circles wider than {limit:g} mm: {count:# circle|# circles} of {measured:.6g} "
    "mm or more {count:is|are} left out; drill {count:it|them}, or take a smaller tool",
    "mm",
    WARNING,
)
NOT_BORED_WITHIN = PlanningCode.NOT_BORED.says(
    "{measured:# circle lies|# circles lie} within another one, with which "
    "{measured:it is|they are} bored",
    severity=INFO,
)
HOLE_SIZE = PlanningCode.HOLE_SIZE.says(
    "{count:# circle|# circles} of {limit:g} mm {count:is|are} drilled with a drill of "
    "{measured:g} mm",
    "mm",
)
TOOL_NOT_SAID = PlanningCode.TOOL_NOT_SAID.says(
    "the operation has another tool than the one before it and no number, so the program cannot "
    "ask for it: number the tools, or write a program for each (--split tool)"
)
TOOL_NOT_SAID_APART = PlanningCode.TOOL_NOT_SAID.says(
    "the operation has another tool than the one before it and the same number {number}, so the "
    "program cannot ask for it: number the tools, or write a program for each (--split tool)"
)
TOOL_CHANGE_NOT_STATED = PlanningCode.TOOL_CHANGE_NOT_STATED.says(
    "{count:a tool is|# tools are} changed {measured:.4g} mm above the stock here, because the "
    "file of {machine} states no place: give {keys} in its [defaults]",
    "mm",
)
LONG_DRAWING = PlanningCode.LONG.says(
    "what is cut is {measured:.4g} mm long, or as far from part zero; {limit:g} mm is more than "
    "any machine has: check the units",
    "mm",
)
LONG_PROGRAM = PlanningCode.LONG.says(
    "{measured:# move|# moves} are more than {limit:g}: check the steps", "moves"
)
LINES_RUN_TOGETHER = PlanningCode.LINES_RUN_TOGETHER.says(
    "the tool cuts {measured:.4g} mm wide at this depth, and lines lie {limit:.4g} mm apart here"
    "{more:| (and at # more place)| (and at # more places)}, so that what is between them is cut "
    "away: take a tool of less than {limit:.4g} mm, or a V bit less deep",
    "mm",
)
TEXT_AS_EDGE = PlanningCode.TEXT_AS_EDGE.says(
    "{measured:# contour is an outline|# contours are outlines} of text, cut as edges of parts: "
    'engrave text in an operation of its own (select = ["text"]), and leave it out here (select = '
    '["not text"])',
    "contours",
)
SIDE_BY_UNCUT = PlanningCode.SIDE_BY_UNCUT.says(
    "{measured:# contour|# contours} would be cut on the other side without {uncut}, which "
    "is not cut: {first} is cut {side}; if {uncut} is not the edge of a part, give --frames "
    "{layer!r}, or the side",
    "contours",
    WARNING,
)
SIDE_BY_UNCUT_FRAME = PlanningCode.SIDE_BY_UNCUT.says(
    "{measured:# contour|# contours} would be cut on the other side if {uncut}, on the layer of "
    "a frame, were the edge of a part: {first} is cut {side}; --frames lists the layers of frames",
    "contours",
    INFO,
)
CUT_DOUBTFUL = PlanningCode.CUT_DOUBTFUL.says("{reasons}")
CUT_DOUBTFUL_SPEED = PlanningCode.CUT_DOUBTFUL.says(
    "no spindle speed is given, so the spindle stays off (--spindle)"
)
CUT_DOUBTFUL_WIDTH = PlanningCode.CUT_DOUBTFUL.says(
    "the tool has no width, so it runs on the line of closed contours (--tool-diameter, or "
    "--side on)"
)
CUT_DOUBTFUL_DEPTH = PlanningCode.CUT_DOUBTFUL.says(
    "a pass of {depth:.4g} mm is deeper than the tool of {width:g} mm is wide (--step-down)"
)
CUT_DOUBTFUL_BEYOND = PlanningCode.CUT_DOUBTFUL.says(
    "{beyond:g} mm are cut beyond the lines, more than a quarter of the tool's radius "
    "(--allowance)"
)
CUT_DOUBTFUL_PLUNGE = PlanningCode.CUT_DOUBTFUL.says(
    "the tool plunges at the feed of the cut, {feed:g} mm/min (--plunge-feed)"
)
CUT_DOUBTFUL_LENGTH = PlanningCode.CUT_DOUBTFUL.says(
    "the cut is {depth:.4g} mm deep, and the edges of the tool are {length:g} mm long (--depth)"
)
CUT_DOUBTFUL_CENTRE = PlanningCode.CUT_DOUBTFUL.says(
    "the tool plunges, and does not cut at its centre (--entry ramp)"
)
CUT_DOUBTFUL_CHIP = PlanningCode.CUT_DOUBTFUL.says(
    "a chip load of {chip:.3g} mm, where {limits} mm are meant for the tool (--feed, --spindle)"
)
CUT_DOUBTFUL_EDGE = PlanningCode.CUT_DOUBTFUL.says(
    "a surface speed of {speed:.4g} m/min, where {limits} m/min are meant for the tool (--spindle)"
)
CUT_DOUBTFUL_NOSE = PlanningCode.CUT_DOUBTFUL.says(
    "the round nose of the tool leaves {nose:g} mm at the foot of walls (a deeper cut, or a flat "
    "tool)"
)
CUT_DOUBTFUL_RIDGES = PlanningCode.CUT_DOUBTFUL.says(
    "the round nose of the tool leaves ridges of up to {ridge:.2g} mm on floors "
    "(--step-over {finer:.2g} leaves {less:.2g} mm)"
)
CUT_DOUBTFUL_LOOSE = PlanningCode.CUT_DOUBTFUL.says(
    "parts are cut out of the stock, and nothing holds them (--tabs 4)"
)
CUT_DOUBTFUL_LOOSE_FINISH = PlanningCode.CUT_DOUBTFUL.says(
    "parts are cut out of the stock before their finishing pass, and nothing holds them (--tabs 4)"
)
CUT_DOUBTFUL_PRESET = PlanningCode.CUT_DOUBTFUL.says(
    "the tool has presets for {materials}, and none is taken (--material)"
)
TAB_SHARED = PlanningCode.TAB_SHARED.says(
    "cuts are raised over {measured:# tab|# tabs}, which they would have cut away: the first "
    "over one of {contour}",
    "tabs",
    WARNING,
)
TAB_SHARED_WITH_OWN = PlanningCode.TAB_SHARED.says(
    "cuts are raised over {measured:# tab|# tabs} of its own and its neighbours, which they "
    "would have cut away: the first over one of {contour}",
    "tabs",
    INFO,
)
CORNER_FAR = PlanningCode.CORNER_FAR.says(
    "{joins} joins take the tool {measured:.4g} mm beyond a needle-like corner: use joins = "
    '"round", or "mitre" with a low limit',
    "mm",
)
CORNER_FAR_MORE = PlanningCode.CORNER_FAR.says("{measured:# more corner|# more corners}")
FEED_ABOVE_LIMIT = ProgramCode.FEED_ABOVE_LIMIT.says(
    "the tool moves at {measured:.4g} mm/min {direction}, {limit:.4g} is the highest of "
    "{machine}: lower the feed",
    "mm_min",
    ERROR,
)
FEED_ABOVE_LIMIT_ON_SLOPE = ProgramCode.FEED_ABOVE_LIMIT.says(
    "the tool moves at {measured:.4g} mm/min {direction}, {limit:.4g} is the highest of "
    "{machine}: lower the feed, or slope less",
    "mm_min",
    ERROR,
)
FEED_ABOVE_LIMIT_IN_JOB = ProgramCode.FEED_ABOVE_LIMIT.says(
    "the {feed} of {measured:g} mm/min becomes {lowered:g}, the rate of the axes in the file of "
    "{machine}: {mend}",
    "mm_min",
    WARNING,
)
PLAY_NOT_KNOWN_TO_SAVE = ProgramCode.PLAY_NOT_KNOWN.says(
    "no backlash is known of X and Y of {machine}, so that fewer reversals would gain nothing: "
    "give it with --set axes.x.backlash_mm=...",
    severity=WARNING,
)
FIT_COARSE = PlanningCode.FIT_COARSE.says(
    "the drawing was read for a part {read:.4g} times its size and is scaled {scale:.4g} times: "
    "its curves lie up to {off_um:.4g} µm off; read it with scale={scale:.6g}",
    "mm",
)
NOSE_LEAVES = PlanningCode.NOSE_LEAVES.says(
    "the nose, of radius {nose:g} mm, leaves up to {measured:.4g} mm in a corner", "mm"
)
OVERHANG_NOT_JUDGED = PlanningCode.OVERHANG_NOT_JUDGED.says(
    "{measured:.4g} mm stand out, {share:.3g} times the thinnest diameter: how far they bend is "
    "not modelled",
    "mm",
)
THREAD_FORM = PlanningCode.THREAD_FORM.says(
    "pitch {pitch:g} mm, major diameter {major:g} mm, minor {minor:.4g} mm, flanks at "
    "{flank:g}° to each other, in {measured:# pass|# passes}"
)
