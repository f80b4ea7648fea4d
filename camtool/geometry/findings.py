"""Codes of contours that importers and planning both report; their sentences stand with each."""

from __future__ import annotations

from camtool.findings import ERROR, WARNING, Code


class ContourCode(Code):
    """Codes of findings about contours."""

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
