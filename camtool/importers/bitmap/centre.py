"""The centre lines of what is dark in a picture: thinned to a pixel's width, then followed.

    dark ──thinned (Guo and Hall 1989)──▶ pixels ──links──▶ junctions, chains between them
         ──without spurs shorter than the stroke is wide──▶ chains
         ──straight on through junctions──▶ paths

Thinning takes pixels away from all sides alike, so that what remains lies in the middle, within a
pixel, and hangs together as the picture does. At the end of a stroke the line ends up to half the
width of the stroke before it: a tool as wide as the stroke covers it."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from camtool.arrays import Bools, Floats, Ints, distinct

SPUR_SHARE = 1.5
"""A branch that ends within this many half widths of the stroke at its junction is a spur: it
leads into a corner, which is √2 of them away at a square end, or a bump of the stroke's edge."""

STRAIGHT_ON_RAD = math.radians(60.0)
"""A path goes on through a junction into the branch that bends least, if by less than this."""

HOOK_SHARE = 0.6
"""A thinned line is in the middle of its stroke when half the width there is less than this share
of the distance from its end; on its way out of a corner of the stroke it is more."""

MIDDLE_SHARE = 0.93
"""The hook into a corner ends where half the width first reaches this share of its value in the
middle."""

ROUGH_PX = 1.0
"""Half widths are uncertain by this much, since they are counted in pixels."""

LOOK_BACK = 1.5
"""The direction of a branch is measured from its junction to a point this many half widths
away."""

MIN_LOOK_PX = 4
"""The direction of a branch is measured over at least this many pixels."""

MAX_ROUNDS = 8
"""Spurs are removed in at most this many rounds, since removing some lengthens others."""

Pixel = tuple[int, int]
"""Row and column."""


def thin(dark: Bools) -> Bools:
    """Return the mask (H, W) of the dark pixels that remain when strokes are thinned to lines of
    one pixel."""
    height, width = dark.shape
    wide = width + 2
    pixels = np.zeros((height + 2) * wide, dtype=np.bool_)
    pixels.reshape(height + 2, wide)[1:-1, 1:-1] = dark
    around = np.array([-wide, 1 - wide, 1, wide + 1, wide, wide - 1, -1, -wide - 1])
    edge, changed = _edge(np.flatnonzero(pixels), pixels, around), True
    while changed:
        changed = False
        for turn in range(2):
            removed = edge[_removable(pixels[edge[:, None] + around], turn)]
            pixels[removed] = False
            changed |= len(removed) > 0
            neighbours = (removed[:, None] + around).ravel()
            edge = np.concatenate([edge, neighbours])
            edge = distinct(edge[pixels[edge]])
    return pixels.reshape(height + 2, wide)[1:-1, 1:-1]


def _edge(pixels: Ints, pixels_set: Bools, neighbours: Ints) -> Ints:
    """Return those `pixels` that have at least one light neighbour."""
    inner = np.ones(len(pixels), dtype=np.bool_)
    for step in neighbours:
        inner &= pixels_set[pixels + step]
    return pixels[~inner]


def _removable(neighbours: Bools, turn: int) -> Bools:
    """Return a mask (N,) of pixels that may be removed at once, from their eight neighbours (N,
    8), clockwise from above.

    Turn 0 removes pixels of the left and lower edges, turn 1 those of the right and upper edges.
    """
    p2, p3, p4, p5, p6, p7, p8, p9 = neighbours.T
    pairs = ((p2, p3, p4), (p4, p5, p6), (p6, p7, p8), (p8, p9, p2))
    runs = sum((~one & (b | c)).astype(np.int8) for one, b, c in pairs)
    first = sum((one | b).astype(np.int8) for one, b in ((p9, p2), (p3, p4), (p5, p6), (p7, p8)))
    second = sum((one | b).astype(np.int8) for one, b in ((p2, p3), (p4, p5), (p6, p7), (p8, p9)))
    count = np.minimum(first, second)
    side = (p2 | p3 | ~p5) & p4 if turn else (p6 | p7 | ~p9) & p8
    return np.asarray((runs == 1) & (count >= 2) & (count <= 3) & ~side)


class _Graph:
    """The pixels of thin lines, each linked to its neighbours.

    A pixel is linked to neighbours in its row and column, and to diagonal ones that no such
    neighbour connects to it."""

    def __init__(self, thin: Bools, dark: Bools) -> None:
        self.dark = np.pad(dark, 1)
        rows, columns = np.nonzero(thin)
        pixels = list(zip(rows.tolist(), columns.tolist(), strict=True))
        pixel_set = set(pixels)
        self.links: dict[Pixel, list[Pixel]] = {}
        for row, column in pixels:
            sides = [
                (row + dy, column + dx)
                for dy, dx in ((-1, 0), (0, 1), (1, 0), (0, -1))
                if (row + dy, column + dx) in pixel_set
            ]
            diagonals = [
                (row + dy, column + dx)
                for dy, dx in ((-1, 1), (1, 1), (1, -1), (-1, -1))
                if (row + dy, column + dx) in pixel_set
                and (row + dy, column) not in pixel_set
                and (row, column + dx) not in pixel_set
            ]
            self.links[row, column] = sides + diagonals

    def chains(self) -> list[list[Pixel]]:
        """Return the chains of linked pixels from one end or junction to the next, both included.

        Closed chains without a junction come last; they begin and end at the same pixel."""
        chains, used_links = [], set[tuple[Pixel, Pixel]]()
        visited = set[Pixel]()
        for begin, links in self.links.items():
            if len(links) == 2:
                continue
            for link in links:
                if (begin, link) in used_links:
                    continue
                chain = self._follow(begin, link)
                used_links |= {(chain[0], chain[1]), (chain[-1], chain[-2])}
                visited.update(chain)
                chains.append(chain)
        for begin, links in self.links.items():
            if len(links) == 2 and begin not in visited:
                chain = self._follow(begin, links[0])
                visited.update(chain)
                chains.append(chain)
        return chains

    def _follow(self, begin: Pixel, link: Pixel) -> list[Pixel]:
        chain = [begin, link]
        while len(self.links[link]) == 2 and link != begin:
            one, other = self.links[link]
            link = other if one == chain[-2] else one
            chain.append(link)
        return chain

    def without(self, pixels: Sequence[Pixel]) -> None:
        """Remove pixels and their links."""
        for pixel in pixels:
            for link in self.links.pop(pixel):
                if link in self.links:
                    self.links[link].remove(pixel)

    def half_width(self, pixel: Pixel) -> float:
        """Return half the width of the stroke at a pixel, in pixels: the distance to the nearest
        light one, less half a pixel."""
        row, column = pixel[0] + 1, pixel[1] + 1
        reach = 4
        while True:
            low = max(row - reach, 0), max(column - reach, 0)
            light = np.argwhere(~self.dark[low[0] : row + reach + 1, low[1] : column + reach + 1])
            if len(light):
                distances = np.hypot(*(light + np.array(low) - [row, column]).T)
                if distances.min() <= reach:
                    return float(distances.min()) - 0.5
            reach *= 2


def centre_lines(dark: Bools) -> tuple[list[tuple[Floats, bool]], int]:
    """Return the centre lines of the strokes, and the number of dots that are left out since they
    have no length.

    A line is its points (n, 2) in pixels (frame as in `outline`), and True if it is closed."""
    graph = _Graph(thin(dark), dark)
    _prune(graph)
    dots = sum(1 for links in graph.links.values() if not links)
    nodes = _junctions(graph)
    ends: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    chains: list[list[Pixel]] = []
    for chain in graph.chains():
        if chain[0] != chain[-1] and nodes.get(chain[0], -1) == nodes.get(chain[-1], -2):
            continue  # within one junction
        for last in (False, True):
            if (node := nodes.get(chain[-1 if last else 0])) is not None:
                ends[node].append((len(chains), last))
        for _ in range(2):
            chain = chain[::-1]
            if chain[0] not in nodes and chain[0] != chain[-1]:
                chain = _without_hook(chain, graph)
        chains.append(chain)
    middles = _middles(nodes)
    height = dark.shape[0]
    continuations: dict[tuple[int, bool], tuple[int, bool]] = {}
    for node, arms in ends.items():
        width = max(graph.half_width(pixel) for pixel, number in nodes.items() if number == node)
        look = max(MIN_LOOK_PX, int(LOOK_BACK * width))
        continuations |= _pair_straightest(chains, arms, middles[node], look)
    return [
        (_points(path, chains, nodes, middles, height), closed)
        for path, closed in _paths(len(chains), chains, continuations)
    ], dots


def _prune(graph: _Graph) -> None:
    """Remove spurs, the short branches that thinning leaves at corners, until none is left."""
    for _ in range(MAX_ROUNDS):
        spur_pixels: list[Pixel] = []
        for chain in graph.chains():
            first, last = (len(graph.links[end]) for end in (chain[0], chain[-1]))
            if last == 1 and first > 2:
                chain, first, last = chain[::-1], last, first
            if first != 1 or last < 3:
                continue
            reach = math.dist(chain[0], chain[-1])
            if reach <= SPUR_SHARE * graph.half_width(chain[-1]) + 1.0:
                spur_pixels += chain[:-1]
        if not spur_pixels:
            return
        graph.without(spur_pixels)


def _without_hook(chain: list[Pixel], graph: _Graph) -> list[Pixel]:
    """Return a chain without the hook at its begin that leads into a corner of the stroke."""
    widths = [graph.half_width(chain[0])]
    for pixel in chain[1:]:
        widths.append(graph.half_width(pixel))
        if widths[-1] + ROUGH_PX < HOOK_SHARE * math.dist(chain[0], pixel):
            break
    if len(widths) == len(chain):
        return chain
    middle = MIDDLE_SHARE * widths[-1] - 0.5 * ROUGH_PX
    return chain[next(k for k, width in enumerate(widths) if width >= middle) :]


def _junctions(graph: _Graph) -> dict[Pixel, int]:
    """Return the number of the junction for each pixel with three links or more; linked pixels of
    this kind are one junction."""
    junctions = {pixel for pixel, links in graph.links.items() if len(links) > 2}
    numbers: dict[Pixel, int] = {}
    for begin in graph.links:
        if begin not in junctions or begin in numbers:
            continue
        number, waiting = len(set(numbers.values())), [begin]
        while waiting:
            pixel = waiting.pop()
            if pixel not in numbers:
                numbers[pixel] = number
                waiting += [link for link in graph.links[pixel] if link in junctions]
    return numbers


def _middles(nodes: dict[Pixel, int]) -> dict[int, tuple[float, float]]:
    members: dict[int, list[Pixel]] = defaultdict(list)
    for pixel, node in nodes.items():
        members[node].append(pixel)
    return {
        node: (sum(p[0] for p in pixels) / len(pixels), sum(p[1] for p in pixels) / len(pixels))
        for node, pixels in members.items()
    }


def _pair_straightest(
    chains: list[list[Pixel]], arms: list[tuple[int, bool]], middle: tuple[float, float], look: int
) -> dict[tuple[int, bool], tuple[int, bool]]:
    """Return the pairs of chain ends that continue each other at a junction, both ways round.

    The pair with the smallest turn is made first; each end is in one pair at most."""
    headings = []
    for chain, last in arms:
        path = chains[chain][::-1] if last else chains[chain]
        probe = path[min(look, len(path) - 1)]
        headings.append(math.atan2(probe[0] - middle[0], probe[1] - middle[1]))
    pairs = sorted(
        (abs(math.remainder(headings[i] - headings[j] - math.pi, 2.0 * math.pi)), i, j)
        for i in range(len(arms))
        for j in range(i)
    )
    mates: dict[tuple[int, bool], tuple[int, bool]] = {}
    for bend, i, j in pairs:
        if bend < STRAIGHT_ON_RAD and arms[i] not in mates and arms[j] not in mates:
            mates[arms[i]], mates[arms[j]] = arms[j], arms[i]
    return mates


def _paths(
    count: int, chains: list[list[Pixel]], continuations: dict[tuple[int, bool], tuple[int, bool]]
) -> list[tuple[list[tuple[int, bool]], bool]]:
    """Return paths of chains that continue each other: each chain's index with True if it runs
    backwards, and for the path True if it is closed."""
    paths, visited = [], [False] * count
    # Paths that begin somewhere first; the rest are rings.
    ends = ((k, is_reversed) for k in range(count) for is_reversed in (False, True))
    begins = [end for end in ends if end not in continuations]
    for chain, is_reversed in [*begins, *((k, False) for k in range(count))]:
        path: list[tuple[int, bool]] = []
        while not visited[chain]:
            visited[chain] = True
            path.append((chain, is_reversed))
            following = continuations.get((chain, not is_reversed))
            if following is None:
                break
            chain, is_reversed = following
        if path:
            first, last = path[0], path[-1]
            ring = continuations.get((last[0], not last[1])) == first
            ring |= len(path) == 1 and chains[first[0]][0] == chains[first[0]][-1]
            paths.append((path, ring))
    return paths


def _points(
    path: list[tuple[int, bool]],
    chains: list[list[Pixel]],
    nodes: dict[Pixel, int],
    middles: dict[int, tuple[float, float]],
    height: int,
) -> Floats:
    """Return the points (n, 2) of a path: the centres of its pixels, and the middles of its
    junctions."""
    places: list[tuple[float, float]] = []
    for chain, is_reversed in path:
        pixels = chains[chain][::-1] if is_reversed else chains[chain]
        for pixel in pixels:
            place = middles[nodes[pixel]] if pixel in nodes else pixel
            if not places or places[-1] != place:
                places.append(place)
    rows, columns = np.array(places, dtype=np.float64).T
    points = np.column_stack([columns + 0.5, height - rows - 0.5])
    closed = len(points) > 3 and bool((points[0] == points[-1]).all())
    return points[:-1] if closed else points
