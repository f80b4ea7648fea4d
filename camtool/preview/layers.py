"""The layers of a picture by name: which there are, and a picture's content with some of them."""

from __future__ import annotations

from collections.abc import Iterable

from camtool.errors import OptionError
from camtool.patterns import guess

LAYERS = (
    "drawing",
    "swept",
    "travel",
    "rapids",
    "feeds",
    "plunges",
    "starts",
    "order",
    "arrows",
    "reversals",
    "path",
    "worst",
    "zero",
    "doubts",
)
"""Names of layers, from the ground up."""

USUAL = frozenset(LAYERS) - {"reversals"}
"""What is shown when nobody says."""

OF_DRAWINGS = frozenset({"drawing", "zero", "doubts"})
"""What a picture of a drawing alone can show."""

OF_PREDICTIONS = frozenset({"path", "worst"})
"""What a picture shows only where it is predicted how the slides move."""

NOT_UNDER_PATH = frozenset({"rapids", "plunges", "starts", "order", "arrows"})
"""What is left out where the predicted path is shown."""


def chosen(names: Iterable[str], without: Iterable[str]) -> frozenset[str]:
    """The layers `names` (none: the usual ones) but those `without`; OptionError for others, and
    when none is left."""
    shown, left_out = set(names), set(without)
    for name in sorted(shown | left_out):
        if name not in LAYERS:
            raise OptionError(
                f"{name!r} is no layer",
                mend=f"{guess(name, LAYERS)}There are {', '.join(LAYERS)}",
            )
    left = frozenset(shown or USUAL) - left_out
    if not left:
        raise OptionError("no layer is left to show", mend="name others, or leave out fewer")
    return left
