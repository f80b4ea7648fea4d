"""Lathe cycles over a contour (G70, G71, G72): the moves that LinuxCNC makes of them
(interp_g7x.cc).

The contour is the sub that Q names. It is turned and mirrored so that Z and X fall along it; there
G71 cuts level by level in X, from the contour's first segment to where the level meets it again.
G72 is G71 with both axes exchanged. Points are complex: Z + iX."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from msgspec import Struct

from ..gcode.faults import LineFault
from .lines import LinuxcncBlock
from .needs import check, motion_of
from .state import InterpreterState

TOLERANCE: Final = 1e-6
"""Places that differ by less are one, in units of the program."""

SHORT: Final = 1e-3
"""Shorter segments, and those that run back by less, do not count."""

GAP: Final = 1e-2
"""An offset that opens a wider gap along Z gets an arc about the corner."""

SAME: Final = 1e-4
"""An arc that ends so near to its start is left out (TOLERANCE_EQUAL)."""

MAX_STEPS: Final = 50_000
"""Steps in which a cycle is worked out."""

Emit = Callable[[str, complex, complex], None]
"""Takes "rapid", "line", "cw" or "ccw", the end and the centre."""


class BlockMotions(Struct, frozen=True):
    """The interpreter's functions for a single move: to make a straight move or an arc from its
    motion, block and words, and to find the centre of an arc from I and K or from R."""

    straight: Callable[[int, LinuxcncBlock, dict[str, float]], None]
    arc: Callable[[int, LinuxcncBlock, dict[str, float]], None]
    centre: Callable[..., tuple[float, float]]
    centre_of_radius: Callable[..., tuple[float, float]]


class Segment(Struct):
    """A line, or an arc about `centre`. `corner`: the size of a fillet or chamfer that still has
    to be fitted between its neighbours."""

    start: complex
    end: complex
    centre: complex | None = None
    ccw: bool = False
    corner: float = 0.0

    @property
    def size(self) -> float:
        """Length of the chord, or the radius if that is smaller."""
        chord = abs(self.start - self.end)
        return chord if self.centre is None else min(chord, abs(self.start - self.centre))

    @property
    def radius(self) -> float:
        """Radius of an arc."""
        assert self.centre is not None
        return abs(self.start - self.centre)

    def copy(self) -> Segment:
        """Return a copy that may be changed."""
        return Segment(self.start, self.end, self.centre, self.ccw, self.corner)

    def change(self, change: Callable[[complex], complex], *, mirrors: bool = False) -> None:
        """Map all points of the segment by `change`."""
        self.start, self.end = change(self.start), change(self.end)
        if self.centre is not None:
            self.centre = change(self.centre)
            self.ccw ^= mirrors

    def offset(self, distance: float) -> None:
        """Move the segment to its right by a distance."""
        if self.centre is None:
            chord = self.start - self.end
            self.start += 1j * distance * chord / abs(chord)
            self.end += 1j * distance * chord / abs(chord)
            return
        factor = (self.radius + (distance if self.ccw else -distance)) / self.radius
        self.start = factor * (self.start - self.centre) + self.centre
        self.end = factor * (self.end - self.centre) + self.centre

    @property
    def is_monotonic(self) -> bool:
        """True if Z falls along the segment, and an arc turns no more than the quadrants allow."""
        run = (self.end - self.start).real
        if self.centre is None:
            return run <= SHORT
        if self.corner:
            return True
        ends = [(point - self.centre).imag for point in (self.start, self.end)]
        side = min(ends) >= -SHORT if self.ccw else max(ends) <= SHORT
        return side and run <= -SHORT

    def crossings(self, x: float) -> list[float]:
        """Return the Z at which the segment meets a level of X."""
        if self.centre is not None:
            inner = self.radius**2 - (x - self.centre.imag) ** 2
            if inner < -TOLERANCE:
                return []
            half = math.sqrt(max(inner, 0.0))
            both = (self.centre.real + half, self.centre.real - half)
            return [z for z in both if self._has(complex(z, x))]
        low, high = sorted((self.start.imag, self.end.imag))
        if low > x + TOLERANCE or high < x - TOLERANCE:
            return []
        if abs(self.start.imag - self.end.imag) < TOLERANCE:
            return [self.start.real, self.end.real]
        share = (x - self.start.imag) / (self.end.imag - self.start.imag)
        return [self.start.real + share * (self.end.real - self.start.real)]

    def _has(self, point: complex) -> bool:
        assert self.centre is not None
        from_start = ((self.start - self.centre).conjugate() * (point - self.centre)).imag
        from_end = ((self.end - self.centre).conjugate() * (point - self.centre)).imag
        sign = 1.0 if self.ccw else -1.0
        return sign * from_start >= -TOLERANCE and sign * from_end <= TOLERANCE


class LatheContour:
    """The segments of a contour in the frame in which Z and X fall along it, and the map back to
    the program."""

    def __init__(self, segments: list[Segment], emit: Emit) -> None:
        self.segments = segments
        self.emit = emit
        self._back: list[tuple[Callable[[complex], complex], bool]] = []
        self.steps = 0
        """Steps of the search for what is next to be cut."""

    # Frames

    def exchange_axes(self) -> None:
        """Exchange X and Z of the contour, by a quarter turn."""
        self._change(lambda p: p * -1j, lambda p: p * 1j, mirrors=False)

    def mirror(self) -> None:
        """Mirror so that Z and X fall from the end of the first segment to that of the last."""
        direction = self.segments[0].end - self.segments[-1].end
        if direction.imag > 0.0:
            self._change(_mirror_x, _mirror_x, mirrors=True)
        if direction.real < 0.0:
            self._change(_mirror_z, _mirror_z, mirrors=True)

    def _change(
        self,
        change: Callable[[complex], complex],
        back: Callable[[complex], complex],
        *,
        mirrors: bool,
    ) -> None:
        for each in self.segments:
            each.change(change, mirrors=mirrors)
        self._back.append((back, mirrors))

    def go(self, how: str, end: complex, centre: complex = 0j) -> None:
        """Emit a move to a point of the contour's frame."""
        if sum(mirrors for _, mirrors in self._back) % 2 and how in ("cw", "ccw"):
            how = "cw" if how == "ccw" else "ccw"
        self.emit(how, self.original(end), self.original(centre))

    def original(self, point: complex) -> complex:
        """Return a point of the contour in the frame of the program."""
        for back, _ in reversed(self._back):
            point = back(point)
        return point

    def arc(self, each: Segment, end: complex) -> None:
        """Emit the arc of a segment up to a point of it."""
        assert each.centre is not None
        self.go("ccw" if each.ccw else "cw", end, each.centre)

    def draw(self, each: Segment) -> None:
        """Emit a whole segment."""
        if each.centre is None:
            self.go("line", each.end)
        else:
            self.arc(each, each.end)

    # Preparing

    def finish_corners(self) -> None:
        """Fit the fillets and chamfers between their neighbours."""
        segments = self.segments
        for before, each, after in zip(segments, segments[1:], segments[2:], strict=False):
            if each.corner:
                _finish_corner(before, each, after)
        self.segments = [segments[0]] + [each for each in segments[1:] if each.size >= SHORT]

    def check_monotonic(self) -> None:
        """Raise LineFault where Z rises along the contour."""
        first = self.segments[0]
        if (first.end - first.start).real > 0.0:
            first.start = complex(first.end.real, first.start.imag)
        if not all(each.is_monotonic for each in self.segments):
            raise LineFault(
                "the contour of a lathe cycle runs back along its axis",
                "g",
                "let it run one way, and its arcs turn no further than their quadrant",
            )

    def shift_outwards(self, distance: float) -> None:
        """Offset all segments but the first, in steps of half the length of the shortest."""
        first, last = self.segments[0], self.segments[-1]
        direction, across = first.end - first.start, last.start - first.start
        if across and (direction / across).imag < 0.0:
            distance = -distance
        entry = self.segments.pop(0)
        shifted_mm = 0.0
        while shifted_mm != distance:
            self.count()
            step = min(
                *(each.size / 2.0 for each in self.segments), abs(distance - shifted_mm), math.inf
            )
            step = math.copysign(step, distance)
            self._shift(step, distance > 0.0)
            if not self.segments:
                raise LineFault("nothing of the contour is left beside its offset", "g")
            if shifted_mm + step == shifted_mm:
                raise LineFault("the contour's segments are too short for its offset", "g")
            shifted_mm += step
        for each, after in zip(self.segments, self.segments[1:], strict=False):
            each.end = after.start = (each.end + after.start) / 2.0
        entry.end = self.segments[0].start
        self.segments.insert(0, entry)

    def _shift(self, step: float, ccw: bool) -> None:
        for each in self.segments:
            each.offset(step)
        segments = [each for each in self.segments if each.size >= SHORT]
        joined = segments[:1]
        for each in segments[1:]:
            before = joined[-1]
            if (before.end - each.start).real > GAP:
                copies = before.copy(), each.copy()
                for copy in copies:
                    copy.offset(-step)
                centre = (copies[0].end + copies[1].start) / 2.0
                joined.append(Segment(before.end, each.start, centre, ccw))
            joined.append(each)
        self.segments = joined
        index = 0
        while index < len(joined) - 1:
            self.count()
            if index and not joined[index].is_monotonic:
                shorter = joined[index].size < joined[index - 1].size
                del joined[index if shorter else index - 1]
                index = 0
                if len(joined) == 1:
                    return
            if joined[index].size < SHORT:
                del joined[index]
                index = 0
            else:
                _intersect(joined[index], joined[index + 1])
            index += 1

    def count(self) -> None:
        """Count a step of the cycle; LineFault where there are so many that it may never end."""
        self.steps += 1
        if self.steps > MAX_STEPS:
            raise LineFault(
                f"a lathe cycle of more than {MAX_STEPS} steps: LinuxCNC may never end it",
                "g",
                "write a larger I",
            )

    # Cutting

    def rough(self, how: int, depth: float, escape: float) -> None:
        """Cut level by level. `how`: everything (0), no pockets (1), or pockets only (2)."""
        segments, cutting = self.segments, how
        tops = [segments[0].start]
        at, index = tops[0], 0
        self.go("rapid", at)
        while True:
            x = tops[-1].imag
            if cutting == 2:
                while index < len(segments):
                    stops, at = self._dive(segments[index], at, -1e9, fast=index == 0)
                    if stops:
                        break
                    index += 1
                cutting = 3
            index, at, has_ended = self._cut(index, at, x, depth, escape)
            if has_ended:
                return
            if cutting == 1:
                for each in segments[index:]:
                    at = self._climb_only(each, at)
                return
            # Along the contour, up to where it falls again: a pocket.
            while index < len(segments):
                stops, at = self._climb(segments[index], at)
                if stops:
                    break
                index += 1
            else:
                return
            if cutting == 3:
                if at.imag > tops[-1].imag and len(tops) > 1:
                    tops.pop()
                if len(tops) == 1:
                    tops.append(at)

    def _cut(
        self, index: int, at: complex, x: float, depth: float, escape: float
    ) -> tuple[int, complex, bool]:
        """Cut levels from x downwards until the contour climbs. Return the index of the segment
        reached, the place, and True if the contour ends there."""
        segments = self.segments
        while index < len(segments):
            while x - TOLERANCE > at.imag:
                self.count()
                x -= depth
            self.count()
            each = segments[index]
            stops, at = self._dive(each, at, x, fast=index == 0)
            if stops:
                return index, at, False
            if index == len(segments) - 1:
                return index, at, True
            if abs(at.imag - x) > TOLERANCE or each.end == at:
                index += 1
                continue
            for k in range(index, len(segments)):
                met = segments[k].crossings(at.imag)
                if not met:
                    continue
                z = met[0] if k != index else met[-1]
                if z - TOLERANCE > at.real:
                    continue  # where it begins
                length = abs(z - at.real)
                if length < TOLERANCE:
                    if k == index:
                        continue
                    if abs(at - segments[k].start) < TOLERANCE:
                        index = k
                    else:
                        x -= depth
                    break
                self.go("line", complex(z, at.imag))
                out = escape * (min(1.0, length / 2.0 / escape) if escape else 1.0)
                self.go("rapid", complex(z + out, at.imag + out))
                self.go("rapid", complex(at.real - out, at.imag + out))
                self.go("rapid" if index == 0 else "line", at)
                x -= depth
                break
        return index, at, True

    def _dive(self, each: Segment, at: complex, x: float, *, fast: bool) -> tuple[bool, complex]:
        """Follow a segment downwards, to the level x at most. Return True if it does not go down,
        and the place reached."""
        if each.centre is None:
            if each.start.imag <= each.end.imag + TOLERANCE:
                return True, at
            end = each.end
            if x >= end.imag:
                met = each.crossings(x)
                if not met:
                    raise LineFault("the contour of a lathe cycle lies beyond its start", "g")
                end = complex(met[0], x)
            self.go("rapid" if fast else "line", end)
            return False, end
        if abs(at - each.end) < TOLERANCE or (at - each.end).real <= TOLERANCE:
            return False, each.end
        met = each.crossings(x) or each.crossings(x - TOLERANCE)
        middle = each.centre.real
        if each.ccw:
            if at.real - TOLERANCE > middle:
                return True, at
            end = each.end if not met or met[-1] > middle else complex(met[-1], x)
        else:
            if at.real <= middle:
                return True, at
            if met and met[0] < middle:
                return False, at  # met behind its lowest point only
            end = complex(met[0], x) if met else each.end
        self.arc(each, end)
        return False, end

    def _climb(self, each: Segment, at: complex) -> tuple[bool, complex]:
        """Follow a segment upwards. Return True if it descends from some point on, and the place
        reached."""
        if each.centre is None:
            if each.end.imag + TOLERANCE < each.start.imag:
                return True, at
            if abs(at - each.start) > TOLERANCE:
                raise LineFault("LinuxCNC loses its place on the contour of this cycle", "g")
            self.go("line", each.end)
            return False, each.end
        if (at.real < each.centre.real) if each.ccw else (at.real > each.centre.real):
            return True, at
        end = self._summit(each) if each.ccw else each.end
        if abs(at - end) > SHORT:
            self.arc(each, end)
        return each.ccw, end

    def _climb_only(self, each: Segment, at: complex) -> complex:
        """Follow the part of a segment that is not below the present level upwards; return the
        place reached."""
        if each.centre is None and each.end.imag < each.start.imag:
            return at
        met = each.crossings(at.imag)
        if not met:
            return at
        if each.centre is None:
            self.go("line", complex(met[0], at.imag))
            self.go("line", each.end)
            return each.end
        z = met[0] if each.ccw else met[-1]
        if (z < each.centre.real) if each.ccw else (z > each.centre.real):
            return at
        at = complex(z, at.imag)
        self.go("line", at)
        end = self._summit(each) if each.ccw else each.end
        if abs(at - end) > SHORT:
            self.arc(each, end)
        return end

    def _summit(self, each: Segment) -> complex:
        """Return the highest point of a counter-clockwise arc, or its end if that comes before."""
        assert each.centre is not None
        if each.end.real >= each.centre.real:
            return each.end
        return each.centre + 1j * each.radius


def _mirror_x(point: complex) -> complex:
    return point.conjugate()


def _mirror_z(point: complex) -> complex:
    return -point.conjugate()


def _finish_corner(before: Segment, corner: Segment, after: Segment) -> None:
    """Cut two segments off where their offsets meet, and fit the corner between them."""
    copies = before.copy(), after.copy()
    for distance in (corner.corner, -corner.corner):
        copies = before.copy(), after.copy()
        for copy in copies:
            copy.offset(distance)
        if (copies[0].end - copies[1].start).real <= GAP:
            break
    else:
        raise LineFault("the contour has no room for the fillet or chamfer of a corner", "g")
    _intersect(*copies)
    centre = (copies[0].end + copies[1].start) / 2.0
    for copy in copies:
        copy.offset(-distance)
    corner.start = before.end = copies[0].end
    corner.end = after.start = copies[1].start
    corner.corner = 0.0
    if corner.centre is not None:
        corner.centre = centre
        corner.ccw = (corner.start - centre).imag > 0.0 or (corner.end - centre).imag > 0.0


def _intersect(before: Segment, after: Segment) -> None:
    """Move the end of one segment and the start of the next to where both meet."""
    if before.centre is not None and after.centre is not None:
        a, b, c = after.radius, before.radius, abs(after.centre - before.centre)
        if not c:
            raise LineFault("two arcs of the contour have one centre", "g")
        cosine = (c * c + a * a - b * b) / 2.0 / a / c
        turn = complex(cosine, math.sqrt(max(1.0 - cosine * cosine, 0.0)))
        meeting = turn * (before.centre - after.centre) / c * a + after.centre
    elif before.centre is None and after.centre is None:
        frame = (after.start - after.end).conjugate() / abs(after.start - after.end)
        start, end = ((point - after.end) * frame for point in (before.start, before.end))
        if start.imag == end.imag:
            raise LineFault("two lines of the contour that follow each other are parallel", "g")
        share = start.imag / (start.imag - end.imag)
        meeting = (start + share * (end - start)) / frame + after.end
    else:
        if abs(after.start - before.end) < TOLERANCE:
            return
        line, arc = (after, before) if after.centre is None else (before, after)
        assert arc.centre is not None
        frame = (line.start - line.end).conjugate() / abs(line.start - line.end)
        centre, on_arc = ((point - line.end) * frame for point in (arc.centre, arc.end))
        half = math.sqrt(max(abs(centre - on_arc) ** 2 - centre.imag**2, 0.0))
        both = ((centre.real + side) / frame + line.end for side in (half, -half))
        meeting = min(both, key=lambda point: abs(after.start - point))
    after.start = before.end = meeting


# The cycle of a block


def run_cycle(
    machine: InterpreterState, moves: BlockMotions, words: dict[str, float], motion: int
) -> None:
    """Execute G70, G71 or G72."""
    cycle, how = divmod(motion, 10)
    name = f"G{motion / 10:g}"
    side = machine.compensation.side
    if side and cycle != 70:
        raise LineFault(f"{name} while the cutter's radius is compensated", "g", "write G40")
    if machine.plane != 180:
        raise LineFault(f"{name} in a plane other than XZ", "g", "write G18 before it")
    if "q" not in words:
        raise LineFault(f"{name} without Q", "g", "write Q and the number of its contour's sub")
    depth, parts = words.get("i", 1.0), int(words.get("p", 1.0))
    if depth <= 0.0:
        raise LineFault(f"{name} with I that is not above 0", "i")
    absolute, centres = machine.absolute, machine.absolute_centres
    start = complex(machine.position[2], machine.position[0])
    named_place = complex(words.get("z", 0.0), words.get("x", 0.0))
    target = start + named_place
    if absolute:
        named_place = target = complex(words.get("z", start.real), words.get("x", start.imag))
    machine.absolute = machine.absolute_centres = True

    def emit(how: str, end: complex, centre: complex = 0j) -> None:
        place = {"x": end.imag, "z": end.real}
        if how in ("rapid", "line"):
            code = 0 if how == "rapid" else 10
            moves.straight(code, LinuxcncBlock(place, {}, {}, None), place)
        elif max(abs(machine.position[2] - end.real), abs(machine.position[0] - end.imag)) > SAME:
            place |= {"i": centre.imag, "k": centre.real}
            code = 30 if how == "ccw" else 20
            moves.arc(code, LinuxcncBlock(place, {}, {}, None), place)

    def approach(end: complex) -> None:
        machine.compensation.side = 0
        emit("rapid", end)
        machine.compensation.side = side

    approach(named_place)  # in G91 too LinuxCNC takes them for absolute here
    segments, last = _segments(machine, moves, int(words["q"]), target, absolute, centres)
    if len(segments) > 1:
        contour = LatheContour(segments, emit)
        if cycle == 70:
            _finish(contour, target, words, parts, approach)
        else:
            _rough(contour, target, last, words, how, cycle == 72)
    machine.absolute, machine.absolute_centres = absolute, centres


def _finish(
    contour: LatheContour,
    target: complex,
    words: dict[str, float],
    parts: int,
    approach: Callable[[complex], None],
) -> None:
    """Execute G70: follow the contour in passes, whose distances from it go from D to E."""
    contour.segments[0].start = target
    rest = LatheContour([each.copy() for each in contour.segments[1:]], contour.emit)
    rest.mirror()
    if not all(each.is_monotonic for each in rest.segments):
        contour.exchange_axes()
    contour.mirror()
    contour.finish_corners()
    contour.check_monotonic()
    first, last = words.get("d", 0.0), words.get("e", 0.0)
    segments = contour.segments
    for number in range(parts - 1, -1, -1):
        contour.segments = [each.copy() for each in segments]
        contour.shift_outwards(number * (first - last) / parts + last)
        contour.count()
        approach(contour.original(contour.segments[0].start))
        contour.go("rapid", contour.segments[0].end)
        for each in contour.segments[1:]:
            contour.draw(each)


def _rough(
    contour: LatheContour,
    target: complex,
    last: complex,
    words: dict[str, float],
    how: int,
    across: bool,
) -> None:
    """Execute G71 or, with `across`, G72: cut level by level down to the distance D from the
    contour."""
    segments = contour.segments
    ways = [each.end - each.start for each in (segments[0], segments[-1])]
    if across and abs(ways[1].imag) > 0.0 and ways[0].real * (target - last).real < 0.0:
        segments.append(Segment(last, complex(target.real, last.imag)))
    elif not across and abs(ways[1].real) > 0.0 and ways[0].imag * (target - last).imag < 0.0:
        segments.append(Segment(last, complex(last.real, target.imag)))
    segments[0].start = target
    if across:
        contour.exchange_axes()
    contour.mirror()
    contour.finish_corners()
    contour.check_monotonic()
    contour.shift_outwards(words.get("d", 0.0))
    top, end = contour.segments[0].start.imag, contour.segments[-1].end
    if end.imag < top:
        contour.segments.append(Segment(end, complex(end.real, top)))
    depth = max(words.get("i", 1.0), 2.0 * TOLERANCE)
    contour.rough(how, depth, words.get("r", 0.5))


def _segments(
    machine: InterpreterState,
    moves: BlockMotions,
    label: int,
    start: complex,
    absolute: bool,
    centres: bool,
) -> tuple[list[Segment], complex]:
    """Return the segments that a contour's sub describes, and the point where it ends."""
    segments: list[Segment] = []
    for block in machine.read_sub(label):
        motion = motion_of(machine, block)
        check(machine, block, motion)
        words, half = block.words, 0.5 if machine.diameters else 1.0
        if "motion" in block.g:
            machine.motion = block.g["motion"]
        ways = {"x": 1j * half, "u": 1j * half, "z": 1.0, "w": 1.0}
        for relative, letter in (("u", "x"), ("w", "z")):
            if relative in words and (letter in words or not absolute):
                raise LineFault(
                    f"{relative.upper()} beside {letter.upper()}, or with G91", relative
                )
        end = start
        for letter in ("x", "z"):
            if letter in words and absolute:
                end = (
                    complex(end.real, words[letter] * half)
                    if letter == "x"
                    else complex(words[letter], end.imag)
                )
        end += sum(ways[letter] * words[letter] for letter in ("u", "w") if letter in words)
        if not absolute:
            end += sum(ways[letter] * words[letter] for letter in ("x", "z") if letter in words)
        if end == start:
            continue
        if machine.motion in (0, 10):
            segments.append(Segment(start, end))
        elif machine.motion in (20, 30):
            centre = _centre(machine, moves, words, start, end, centres)
            segments.append(Segment(start, end, centre, machine.motion == 30))
        if machine.motion in (0, 10, 20, 30):
            if "a" in words and "c" in words:
                raise LineFault("both A and C on one corner", "c")
            if "a" in words:
                segments.append(Segment(end, end, end, corner=words["a"]))
            if "c" in words:
                segments.append(Segment(end, end, corner=words["c"]))
        start = end
    return segments, start


def _centre(
    machine: InterpreterState,
    moves: BlockMotions,
    words: dict[str, float],
    start: complex,
    end: complex,
    absolute: bool,
) -> complex:
    """Return the centre of an arc of a contour."""
    flat = ([start.real, start.imag], [end.real, end.imag])
    offsets = {letter: words[letter] for letter in "ki" if letter in words}
    if "r" in words:
        if offsets:
            raise LineFault("an arc with both R and a centre (I, K)", "r")
        return complex(*moves.centre_of_radius(*flat, words["r"], machine.motion == 30))
    if not offsets:
        raise LineFault("an arc without I, K or R", mend="write I and K of its centre, or R")
    outer_mode, machine.absolute_centres = machine.absolute_centres, absolute
    centre = moves.centre(*flat, ["k", "i"], offsets)
    machine.absolute_centres = outer_mode
    return complex(*centre)
