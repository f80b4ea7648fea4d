"""Cleaned pieces to contours: overlaps taken off, ends joined, arcs recognised, specks merged.

    cleaned ──overlaps──▶ ──chain──▶ ──arcs (if asked)──▶ ──tiny──▶ contours, and a Healing

Each stage is a function of camtool.geometry; here they are put in order and counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camtool.geometry.chain import Chained, Kinds, chain, numbered
from camtool.geometry.drawing import Gap, Healing
from camtool.geometry.intersect import self_crossings_of
from camtool.geometry.overlaps import SAME_LINE_MM, without_overlaps
from camtool.geometry.polylines import POSITION_EPS_MM, Ints, Polylines
from camtool.geometry.simplify import without_tiny
from camtool.importers.clean import Cleaned
from camtool.importers.options import ReadOptions
from camtool.importers.piece import Piece

TINY_SHARE = 0.5
"""Segments up to this share of the tolerance are merged into their neighbours."""


@dataclass(frozen=True, eq=False)
class Healed:
    """Contours, the pieces that each is made of, the gaps, and what was mended."""

    lines: Polylines
    members: tuple[tuple[int, ...], ...]
    closed_gaps: tuple[Gap, ...]
    open_gaps: tuple[Gap, ...]
    healing: Healing


def gap_of(options: ReadOptions) -> float:
    """Ends nearer than this are joined, mm; equal ends always are."""
    return max(options.gap_mm, POSITION_EPS_MM) if options.chain_gaps else POSITION_EPS_MM


def healed(pieces: Sequence[Piece], clean: Cleaned, options: ReadOptions) -> Healed:
    """The contours of the cleaned pieces."""
    chosen = [pieces[index] for index in clean.piece.tolist()]
    places = [("" if options.across_layers else piece.layer, piece.colour) for piece in chosen]
    within = min(SAME_LINE_MM, options.tolerance_mm)
    single = without_overlaps(clean.lines, numbered(places, len(chosen)), within)
    of = clean.piece[single.source]
    chained = _chained(pieces, single.lines, of, options)
    lines, arcs = _recognised(chained.lines, options)
    merged = without_tiny(lines, TINY_SHARE * options.tolerance_mm)
    members = _members(chained.members, of)
    return Healed(
        lines=merged.lines,
        members=members,
        closed_gaps=chained.closed_gaps,
        open_gaps=chained.open_gaps,
        healing=Healing(
            duplicates=clean.duplicates,
            duplicates_mm=clean.duplicates_mm,
            overlaps=single.count,
            overlaps_mm=single.length_mm,
            tiny_merged=merged.count,
            arcs_recognised=arcs,
            branches=chained.branches,
            crossings=self_crossings_of(merged.lines, [pieces[one[0]].layer for one in members]),
        ),
    )


def _members(chains: tuple[tuple[int, ...], ...], of: Ints) -> tuple[tuple[int, ...], ...]:
    """The pieces of each chain of paths, each once; `of` says which piece each path is from."""
    if np.array_equal(of, np.arange(len(of))):
        return chains
    rows = of.tolist()
    return tuple(tuple(dict.fromkeys(rows[index] for index in one)) for one in chains)


def _chained(pieces: Sequence[Piece], lines: Polylines, of: Ints, options: ReadOptions) -> Chained:
    """The paths joined, within their layers unless told otherwise."""
    chosen = [pieces[index] for index in of.tolist()]
    layers = [piece.layer for piece in chosen]
    kinds = Kinds(
        groups=None if options.across_layers else layers,
        styles=[(piece.colour, piece.line_type) for piece in chosen],
        layers=layers,
    )
    return chain(lines, gap_of(options), kinds=kinds)


def _recognised(lines: Polylines, options: ReadOptions) -> tuple[Polylines, int]:
    """The paths with arcs for chords on one circle, if that was asked for; how many arcs."""
    if not options.recognise_arcs:
        return lines, 0
    from camtool.geometry.simplify import recognise_arcs

    made = [recognise_arcs(path, options.tolerance_mm) for path in lines]
    return Polylines.of(path for path, _ in made), sum(count for _, count in made)
