"""Codes that plans, programs and verification share, and the sentences of toolpaths.

A machine's own sentences stand in its `postprocessors/<machine>/findings.py`."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING, Code


class ProgramCode(Code):
    """Codes of findings about toolpaths and programs."""

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
    RAPID_IN_STOCK = (
        207,
        ERROR,
        "a rapid runs through material below the stock top that is not yet cleared",
        "raise `safe_z`",
    )
    LOOSE_PIECE = (
        232,
        WARNING,
        "a piece that is no part is cut off through the stock, so that it comes loose beside the "
        "running tool, which may throw it or jam; or a part is cut again after it has come loose. "
        "Block, place and size are given. What the tool mills away leaves no piece",
        "tabs in an operation of its own, a pocket that clears it, tape below; outlines last",
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
    SURFACE_FOLLOWED = (
        325,
        (INFO, ERROR),
        "the cuts of a converted program were compared with the probed surface that they follow; "
        "the greatest distance in Z is given; an error where it is beyond what curves may be off "
        "and the last decimal of a height",
        "a surface with a smaller step; or report it with the program and the surface",
    )
    INPUT_REFUSED = (
        326,
        ERROR,
        "a file cannot be used: a drawing or program that cannot be read or decoded, a job that "
        "this machine cannot cut. Where such an error ends a command with code 2, this is its "
        "code in the files for pipelines; `lint` goes on with the next program",
        "what the message says",
    )
    ARC_MISSES_END = (
        401,
        (ERROR, WARNING),
        "the controller never stands on the end of an arc (or of another move): the real "
        "machine would run on; a warning where it would stop beside it",
        "post the drawing again with `camtool post`",
    )
    PLAY_NOT_KNOWN = (
        405,
        (INFO, WARNING),
        "an axis that moves has no known backlash, so its error is not predicted; a warning where "
        "fewer reversals were asked for and neither X nor Y has any",
        "measure it: `--set axes.z.backlash_mm=...`",
    )


EVENT_LEFT_OUT_COOLANT = ProgramCode.EVENT_LEFT_OUT.says(
    "{count:# word for coolant is|# words for coolant are} left out: the machine has none (mist "
    "and flood of [coolant] in its file)",
    severity=WARNING,
)
INPUT_REFUSED = ProgramCode.INPUT_REFUSED.says("{message}")
FEED_ABOVE_LIMIT_LOWERED = ProgramCode.FEED_ABOVE_LIMIT.says(
    "{cuts:# cut|# cuts} of up to {measured:g} mm/min {cuts:is|are} written at {limit:g}, the "
    "highest feed of {machine}",
    "mm_min",
    WARNING,
)
SURFACE_FOLLOWED_WITHIN = ProgramCode.SURFACE_FOLLOWED.says(
    "the cuts are {measured:.4f} mm or less from the probed surface (limit {limit:g})", "mm", INFO
)
SURFACE_FOLLOWED_NOT = ProgramCode.SURFACE_FOLLOWED.says(
    "a cut is {measured:.4f} mm from the probed surface, and {limit:g} are allowed", "mm", ERROR
)
