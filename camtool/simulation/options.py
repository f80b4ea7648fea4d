"""How to simulate: which interpolator, which effects of the mechanics, how much at a time."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.machine.controllers import Interpolator


@dataclass(frozen=True)
class Effects:
    """The parts of the mechanics, each of which can be left out to see its share.

    play of the axes (by region too); compensation that the controller issues against it; scale
    (real against coded step); squareness of X and Y; repeatability (random, by a seed).
    """

    play: bool = True
    compensation: bool = True
    scale: bool = True
    squareness: bool = True
    repeatability: bool = True


ALL = Effects()
IDEAL = Effects(False, False, False, False, False)
"""Slides that are where they are commanded."""

CHUNK_STEPS = 1 << 16
"""Samples of a chunk, unless told: a few MB."""


@dataclass(frozen=True)
class Options:
    """`interpolator` takes the place of the controller's own for arcs; no chunk has more than
    `chunk_steps` samples."""

    interpolator: Interpolator | None = None
    effects: Effects = ALL
    chunk_steps: int = CHUNK_STEPS
