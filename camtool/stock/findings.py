"""Codes and sentences of the stock: what is cut too deep or left, and what the tools run into."""

from __future__ import annotations

from collections.abc import Sequence

from camtool.arrays import Floats
from camtool.findings import ERROR, INFO, WARNING, Code, and_more
from camtool.toolpath.findings import ProgramCode

FINDINGS_LISTED = 10


def place_words(place: Sequence[float] | Floats) -> str:
    """Return a place (x, y), mm, as text in the form that pictures read from findings."""
    return f"at X {place[0]:.3f} Y {place[1]:.3f}"


class StockCode(Code):
    """Codes of the stock."""

    CUT_TOO_DEEP = (
        601,
        (ERROR, WARNING),
        "the stock is cut deeper than drawing and job allow there: below a floor, or into what is "
        "to stay; the depth and its place are given. A warning where planning has reported a "
        "gouge of the lines already",
        "post again; look at the block that is named, and at the depth and the tool of the job",
    )
    MATERIAL_LEFT = (
        602,
        WARNING,
        "material stands higher than drawing and job ask for, where the tool could have cut it; "
        "its height and place are given",
        "post again; look whether a contour or a pass is missing",
    )
    PASS_TOO_DEEP = (
        603,
        ERROR,
        "a move takes a thicker chip at once than the step down of its operation, its peck, or "
        "the length of the tool's edges allows",
        "post again; look whether a pass is missing before this block",
    )
    TAB_MISSING = (
        604,
        ERROR,
        "a tab that holds the part is cut away; its place is given",
        "post again, or fasten the part in another way",
    )
    TAB_THIN = (
        605,
        WARNING,
        "a tab is narrower or lower than the job asks for",
        "post again; look at the cuts beside it",
    )
    TOOL_IN_STOCK = (
        606,
        ERROR,
        "the shank or the holder of a tool runs into the stock as it stands before that move; "
        "places are looked at no farther apart than a quarter of its radius",
        "a longer tool, a larger `stickout`, or less depth",
    )
    KEEP_OUT_ENTERED = (
        607,
        ERROR,
        "a tool, its shank or its holder enters a box of the job that is to be kept free "
        "(`[[keep_out]]`), such as a clamp",
        "move the clamp, the part or its start, or raise `--safe-z`",
    )
    TOOL_NOT_KNOWN = (
        608,
        INFO,
        "the shank or the holder of some tools is not known, so that it was not looked for in the "
        "stock and in boxes that are to be kept free",
        "`shank_diameter` with `cutting_length`, `holder_diameter` with `stickout` in "
        "`[tools.NAME]`",
    )
    STOCK_NOT_JUDGED = (
        609,
        INFO,
        "something of the stock is not judged, because it is not known which tools cut, or what "
        "the programs before this one have cut; the finding says what",
        "tools with the numbers that the program calls; or one program with all tools",
    )
    FACES_MEET = (
        610,
        WARNING,
        "set-ups from both faces cut so deep that they meet: the floor between them is cut away, "
        "though neither goes through the stock there; its place and by how much are given",
        "less depth in one of the set-ups, unless they shall meet",
    )
    FLOOR_LEFT = (
        611,
        INFO,
        "the least thickness that set-ups from both faces leave of the stock between them, where "
        "neither goes through it",
        "nothing, if it is thick enough",
    )
    NETS_JOINED = (
        612,
        ERROR,
        "two nets of a board stay joined after the predicted cut, by their own copper or by "
        "copper between them that is not cut off; the place is where they are nearest",
        "a finer tool, less depth of a V bit, or more distance in the drawing",
    )
    NET_CUT = (
        613,
        ERROR,
        "a net of a board is cut into several pieces, or away, by the predicted cut",
        "a finer tool, less depth of a V bit, or wider tracks; less backlash of the machine",
    )
    NETS_APART = (
        614,
        INFO,
        "it is proved that all nets of a board are apart and whole after the predicted cut; the "
        "narrowest groove beside a net and the narrowest copper of a net are given",
        "nothing",
    )
    ENGAGEMENT_TOO_HIGH = (
        620,
        WARNING,
        "the tool is engaged by a larger angle than its operation allows, on the predicted slides "
        "and outside of entries; chips thinner than 0.4 % of the tool's radius do not count",
        "a larger limit, a smaller tool, or a wider corner in the drawing",
    )
    ENGAGEMENT_KEPT = (
        621,
        INFO,
        "it is proved that the tool is never engaged by more than its operation allows, on the "
        "predicted slides and outside of entries",
        "nothing",
    )


CUT_TOO_DEEP = StockCode.CUT_TOO_DEEP.says(
    "{by}cut {measured:.4g} mm too deep, to Z {z:.4f} where Z {low:.4f} is the lowest"
    + and_more("places"),
    "mm",
)
MATERIAL_LEFT = StockCode.MATERIAL_LEFT.says(
    "{measured:.4g} mm of material is left, up to Z {z:.4f} where Z {high:.4f} is the highest"
    + and_more("places"),
    "mm",
)
PASS_TOO_DEEP = StockCode.PASS_TOO_DEEP.says(
    "{operation} takes {measured:.4g} mm at once, where {limit:.4g} mm is the most"
    + and_more("blocks"),
    "mm",
)
TAB_MISSING = StockCode.TAB_MISSING.says(
    "{operation}: the tab here is cut away, {measured:.4g} mm of {limit:.4g} mm of its height are "
    "left",
    "mm",
)
TAB_MISSING_ALL = StockCode.TAB_MISSING.says("{operation}: tabs are asked for, and none is left")
TAB_THIN = StockCode.TAB_THIN.says(
    "{operation}: the tab here is {measured:.4g} mm wide instead of {limit:.4g} mm", "mm"
)
TOOL_IN_STOCK = StockCode.TOOL_IN_STOCK.says(
    "the {body} of {tool} is {measured:.4g} mm deep in the stock" + and_more("blocks"), "mm"
)
KEEP_OUT_ENTERED = StockCode.KEEP_OUT_ENTERED.says(
    "the {body} of {tool} enters {box!r} by {measured:.4g} mm" + and_more("blocks"), "mm"
)
RAPID_IN_STOCK = ProgramCode.RAPID_IN_STOCK.says(
    "a rapid runs through the stock, {depth:.4g} mm below its top" + and_more("rapids"), "mm"
)
LOOSE_PIECE = ProgramCode.LOOSE_PIECE.says(
    "a piece of {width:.3g} by {height:.3g} mm comes loose here beside the running tool, because "
    "nothing holds it: give it tabs in an operation of its own, clear it with a pocket, or fasten "
    "it from below" + and_more("pieces"),
    "mm2",
)
LOOSE_PIECE_CUT = ProgramCode.LOOSE_PIECE.says(
    "the part of {width:.3g} by {height:.3g} mm comes loose here, and is cut again from {again} "
    "on: cut its outline last, or give it tabs" + and_more("pieces"),
    "mm2",
)
LOOSE_PIECE_BEFORE = ProgramCode.LOOSE_PIECE.says(
    "what is cut here, {width:.3g} by {height:.3g} mm, has come loose in a set-up before: cut its "
    "outline in the last set-up, or give it tabs",
    "mm2",
)
NETS_JOINED = StockCode.NETS_JOINED.says(
    "{operation}: two nets are joined near here" + and_more("pairs")
)
NET_CUT = StockCode.NET_CUT.says(
    "{operation}: a net is in {measured:.0f} pieces after the cut" + and_more("nets"), "pieces"
)
NETS_APART = StockCode.NETS_APART.says(
    "{operation}: all nets, {measured:.0f}, are apart and whole; the narrowest groove beside one "
    "is {groove}, and the narrowest copper {copper}",
    "nets",
)
ENGAGEMENT_TOO_HIGH = StockCode.ENGAGEMENT_TOO_HIGH.says(
    "{operation}: the tool is engaged by {measured:.2f} degrees, where {limit:.2f} are allowed",
    "°",
)
ENGAGEMENT_KEPT = StockCode.ENGAGEMENT_KEPT.says(
    "{operation}: the tool is engaged by {measured:.2f} degrees at most; {limit:.2f} are allowed",
    "°",
)
STOCK_NOT_JUDGED_TOOLS = StockCode.STOCK_NOT_JUDGED.says(
    "it is not known which of {measured:.0f} tools cuts what: depths, passes, tabs, loose pieces, "
    "shanks and holders are not judged, and of rapids all below the stock top count: {mend}",
    "tools",
)
STOCK_NOT_JUDGED_BEFORE = StockCode.STOCK_NOT_JUDGED.says(
    "what other programs of this job cut is not known here: material that is left, passes, shanks "
    "and holders are not judged, and pieces only if this program alone cuts them off"
)
STOCK_NOT_JUDGED_NARROW = StockCode.STOCK_NOT_JUDGED.says(
    "the stock is too large to look for pieces that come loose within cuts of {measured:.3g} mm: "
    "those within cuts of {limit:.3g} mm or more are found",
    "mm",
)
STOCK_NOT_JUDGED_ENGAGEMENT = StockCode.STOCK_NOT_JUDGED.says(
    "{operation}: the engagement of its tool is not judged: {reason}"
)
TOOL_NOT_KNOWN = StockCode.TOOL_NOT_KNOWN.says("not known, and not judged: {bodies}")
FACES_MEET = StockCode.FACES_MEET.says(
    "this set-up and {other!r} meet: together they cut {measured:.4g} mm more than the stock is "
    "thick",
    "mm",
)
FLOOR_LEFT = StockCode.FLOOR_LEFT.says(
    "this set-up and {other!r} leave {measured:.4g} mm of the stock here, and nowhere less", "mm"
)
