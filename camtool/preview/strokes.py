"""What a toolpath and its drawing look like from above: chains of lines and true arcs.

A chain is an unbroken run of moves of one sort. Arcs stay arcs all the way into the SVG; one of
more than 3/4 turn is written as two, since a nearly full circle is ill-defined by its end points.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments
from camtool.preview.svg import MM_DECIMALS, PathData
from camtool.toolpath.moves import Kind, Toolpath

Floats = npt.NDArray[np.float64]

LONGEST_ARC_RAD = 1.5 * math.pi
"""An arc of more is written as two."""


@dataclass(frozen=True, eq=False)
class Chain:
    """n moves end to end: points (n+1, 2) mm; centre (n, 2) mm; sweep (n,) rad, 0 for lines."""

    points: Floats
    centre: Floats
    sweep: Floats
    closed: bool = False

    def lengths(self) -> Floats:
        """(n,) mm: the true length of each move."""
        chord = np.diff(self.points, axis=0)
        spoke = self.points[:-1] - self.centre
        arc = np.abs(self.sweep) * np.hypot(spoke[:, 0], spoke[:, 1])
        return np.where(self.sweep == 0.0, np.hypot(chord[:, 0], chord[:, 1]), arc)

    def at(self, index: int, share: float) -> tuple[tuple[float, float], float]:
        """The point at `share` (0 … 1) of move `index`, and the direction of travel there, rad."""
        begin, end = self.points[index], self.points[index + 1]
        sweep = float(self.sweep[index])
        if sweep == 0.0:
            dx, dy = (end - begin).tolist()
            return (
                float(begin[0]) + share * dx,
                float(begin[1]) + share * dy,
            ), math.atan2(dy, dx)
        cx, cy = self.centre[index].tolist()
        x, y = float(begin[0]) - cx, float(begin[1]) - cy
        angle = math.atan2(y, x) + share * sweep
        radius = math.hypot(x, y)
        heading = angle + math.copysign(math.pi / 2.0, sweep)
        return (cx + radius * math.cos(angle), cy + radius * math.sin(angle)), heading


@dataclass(frozen=True, eq=False)
class Strokes:
    """A toolpath from above: `feeds`, `ramps` (sinking while moving) and `rapids` as chains,
    `plunges` (P, 2) mm each place once, `begin` (2,) mm where the tool stands at first."""

    feeds: tuple[Chain, ...]
    ramps: tuple[Chain, ...]
    rapids: tuple[Chain, ...]
    plunges: Floats
    begin: Floats


def strokes_of(toolpath: Toolpath) -> Strokes:
    """Sort the moves of a toolpath by how they are drawn."""
    starts, ends = toolpath.starts, toolpath.end
    step = ends - starts
    across = np.hypot(step[:, 0], step[:, 1]) > POSITION_EPS_MM
    sinks = (toolpath.kind == Kind.LINE) & (step[:, 2] < -POSITION_EPS_MM)
    feeds = toolpath.is_feed & ~sinks & (across | toolpath.is_arc)
    rapid = (toolpath.kind == Kind.RAPID) & across
    plunges = ends[sinks & ~across, :2]
    _, first = np.unique(plunges, axis=0, return_index=True)
    return Strokes(
        feeds=_chains(toolpath, feeds),
        ramps=_chains(toolpath, sinks & across),
        rapids=_once(starts[rapid, :2], ends[rapid, :2]),
        plunges=plunges[np.sort(first)],
        begin=toolpath.start[:2],
    )


def _chains(toolpath: Toolpath, chosen: npt.NDArray[np.bool_]) -> tuple[Chain, ...]:
    """Runs of the chosen rows, each run once (passes at several depths look the same)."""
    rows = np.flatnonzero(chosen)
    if not len(rows):
        return ()
    starts, sweeps = toolpath.starts, toolpath.sweeps()
    found: dict[bytes, Chain] = {}
    for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        points = np.concatenate([starts[run[:1], :2], toolpath.end[run, :2]])
        chain = Chain(points, toolpath.centre[run], sweeps[run])
        found.setdefault(points.tobytes() + chain.sweep.tobytes(), chain)
    return tuple(found.values())


def _once(begin: Floats, end: Floats) -> tuple[Chain, ...]:
    """Straight moves, each once, there or back: dashes over dashes would look like a line."""
    found: dict[tuple[tuple[float, ...], ...], Chain] = {}
    for a, b in zip(begin, end, strict=True):
        chain = Chain(np.array([a, b]), np.full((1, 2), np.nan), np.zeros(1))
        found.setdefault(tuple(sorted([tuple(a.tolist()), tuple(b.tolist())])), chain)
    return tuple(found.values())


def chains_of(lines: Polylines) -> tuple[Chain, ...]:
    """Every path of the columns as a chain."""
    all_segments = Segments.of(lines)
    cuts = np.searchsorted(all_segments.path, np.arange(len(lines) + 1))
    chains = []
    for path, closed in enumerate(lines.closed.tolist()):
        part = slice(int(cuts[path]), int(cuts[path + 1]))
        points = np.concatenate([all_segments.start[part], all_segments.end[part][-1:]])
        chains.append(
            Chain(points, all_segments.centre[part], all_segments.sweep[part], bool(closed))
        )
    return tuple(chains)


def path_data(chains: Iterable[Chain]) -> str:
    """The `d` of a path that shows the chains, in mm, Y up (the group around it flips)."""
    data = PathData(MM_DECIMALS)
    for chain in chains:
        points = chain.points.tolist()
        data.move(*points[0])
        closing_line = chain.closed and chain.sweep[-1] == 0.0
        for index, sweep in enumerate(chain.sweep.tolist()):
            if sweep != 0.0 and not _is_flat(chain, index, sweep):
                _arc(data, chain, index, sweep)
            elif not (closing_line and index == len(chain.sweep) - 1):
                data.line(*points[index + 1])
        if chain.closed:
            data.close()
    return str(data)


def _is_flat(chain: Chain, index: int, sweep: float) -> bool:
    """Whether an arc leaves its chord by less than what tells two positions apart.

    height = chord/2 · tan(sweep/4); renderers lose their way in circles of kilometres.
    """
    chord = math.dist(chain.points[index], chain.points[index + 1])
    return abs(sweep) < math.pi and 0.5 * chord * math.tan(abs(sweep) / 4.0) < POSITION_EPS_MM


def _arc(data: PathData, chain: Chain, index: int, sweep: float) -> None:
    begin, centre = chain.points[index], chain.centre[index]
    radius = math.hypot(*(begin - centre).tolist())
    if abs(sweep) > LONGEST_ARC_RAD:
        sweep /= 2.0
        data.arc(*chain.at(index, 0.5)[0], radius=radius, sweep_rad=sweep)
    data.arc(*chain.points[index + 1].tolist(), radius=radius, sweep_rad=sweep)


def chains_box(chains: Sequence[Chain]) -> Floats | None:
    """[[xmin, xmax], [ymin, ymax]] mm of the true lines and arcs; None when there are none."""
    if not chains:
        return None
    boxes = segment_boxes(_halved(chains))
    return np.column_stack([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])


def _halved(chains: Sequence[Chain]) -> Segments:
    """All moves as segments, each arc as two: a full circle has no bulge of its own."""
    begin = np.concatenate([chain.points[:-1] for chain in chains])
    end = np.concatenate([chain.points[1:] for chain in chains])
    centre = np.concatenate([chain.centre for chain in chains])
    sweep = np.concatenate([chain.sweep for chain in chains])
    is_arc = sweep != 0.0
    begin_arc, end_arc, turn = begin[is_arc], end[is_arc], sweep[is_arc] / 2.0
    spoke = begin_arc - centre[is_arc]
    cos, sin = np.cos(turn), np.sin(turn)
    turned = [cos * spoke[:, 0] - sin * spoke[:, 1], sin * spoke[:, 0] + cos * spoke[:, 1]]
    middle = centre[is_arc] + np.column_stack(turned)
    bulge = np.tan(turn / 4.0)
    return Segments.between(
        np.concatenate([begin[~is_arc], begin_arc, middle]),
        np.concatenate([end[~is_arc], middle, end_arc]),
        np.concatenate([np.zeros(int((~is_arc).sum())), bulge, bulge]),
    )
