"""What `camtool.api` gives back: the house's own records, with what they were made from.

Each is its record and nothing else to whoever takes one; besides, it prints as a few lines
(`print(posted)`), and what has a picture shows it in a notebook (`_repr_svg_`).
"""

from __future__ import annotations

from camtool.results.judged import Calibration, Comparison
from camtool.results.picture import Picture, Shown
from camtool.results.values import (
    Converted,
    Drawing,
    Posted,
    Toolpath,
    Verification,
    extended,
)

__all__ = [
    "Calibration",
    "Comparison",
    "Converted",
    "Drawing",
    "Picture",
    "Posted",
    "Shown",
    "Toolpath",
    "Verification",
    "extended",
]
