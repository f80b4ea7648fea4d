"""The moves of a block: straight ones, arcs, splines, and the way home.

Cycles, threads and cutter compensation have files of their own, which only programs load that use
them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from camtool import bounds
from camtool.toolpath.moves import Kind

from ..gcode.faults import LineFault
from ..gcode.part_moves import PLANES, too_many
from .contour_cycles import BlockMotions, run_cycle
from .frames import HOMES, FrameCodes
from .lines import AXES, LinuxcncBlock
from .needs import LATHE_CYCLES

INCH_SLACK: Final = 2.54
"""Radii of an arc may differ by so many times as much under G20 (CENTER_ARC_RADIUS_TOLERANCE_INCH:
0.001 inch where it has 0.01 mm)."""

MIN_RATE: Final = 0.1
"""The lowest feed of inverse time, units/min (inverse_time_rate_straight)."""

EQUAL_TO_ONE: Final = 1e-12
"""Half a chord is the radius when it differs by no more than this part (TINY)."""

NO_FEED: Final = "a feed move, and no feed yet"

CONTROL_POINT_LINES: Final = 10
"""Executed lines that a control point of a spline counts as."""

COMPENSATION_LINES: Final = 2
"""Executed lines that a compensated move counts as beyond its own."""

AXIS_LETTERS: Final = f"{AXES}@^"
"""Words of which a line or a rapid needs one to move."""

REFUSED: Final = {
    **dict.fromkeys((382, 383, 384, 385), "probes, which cannot be simulated"),
    **dict.fromkeys((171, 181, 191), "is a plane of U, V and W, which are not simulated"),
}
"""G codes that LinuxCNC knows and that are not read."""


class BlockMoves(FrameCodes):
    """Interpreter state with its frames and the moves of blocks."""

    def _go_home(self, code: int, words: dict[str, float], g: Mapping[str, int]) -> None:
        """Execute G28 or G30: go by way of the block's coordinates to the stored place, in the
        axes that are named."""
        end = self._ends(words, g)
        self._not_while_compensating("G28 or G30")
        self.canon.rapid(*end)
        self.position[:] = end
        first = HOMES[code]
        if first not in self._homed:
            self.notes.homes.setdefault(f"G{code // 10}", self.block_index)
        place = [a - b for a, b in zip(self._stored_place(first), self._tool_offset, strict=True)]
        home = self._in_frame(place)
        named = [axis in words for axis in "xyz"]
        if not any(letter in words for letter in AXES):
            named = [True, True, True]
        end = [new if go else old for new, old, go in zip(home, end, named, strict=True)]
        self.canon.rapid(*end)
        self.position[:] = end

    # Motion

    def _move(self, motion: int, block: LinuxcncBlock, words: dict[str, float]) -> None:
        if motion in REFUSED:
            raise LineFault(f"G{motion / 10:g} {REFUSED[motion]}", "g")
        if self._first_frame is None and motion != 800:
            self._first_frame = self._frame
        if motion == 800:
            self.motion = 800
        elif motion in (0, 10):
            self._straight(motion, block, words)
        elif motion in (20, 30):
            self._arc(motion, block, words)
        else:
            self._other(motion, block, words)
        if self.series is not None and not _is_cycle(motion):
            self.series.height = None

    def _other(self, motion: int, block: LinuxcncBlock, words: dict[str, float]) -> None:
        if _is_cycle(motion) or motion in (330, 331, 760):
            from .cycles import drill, follow_spindle, thread

        if _is_cycle(motion):
            self.canon.feed = self._rate(block)
            drill(self, LinuxcncBlock(words, block.g, block.m, None), motion)
        elif motion in (330, 331, 760):
            self._arc_refused = False
            self.motion = motion
            end = self._ends(words, block.g)
            if motion == 760:
                thread(self, block, end)
            else:
                follow_spindle(self, block, end, motion)
        elif motion in (700, *LATHE_CYCLES):
            moves = BlockMotions(self._straight, self._arc, self._centre, self._centre_of_radius)
            run_cycle(self, moves, words, motion)
        elif motion == 52:
            self._control_point(block, words)
        else:
            self._spline_move(motion, block, words)

    def _rate(self, block: LinuxcncBlock, length: Callable[[], float] | None = None) -> float:
        """Return the feed of a move, mm/min; LineFault where none is in force."""
        mm = self.canon.mm
        if self.feed_mode == 930:
            if "f" not in block.words:
                raise LineFault("a feed move of inverse time (G93) without F")
            rate = max(MIN_RATE, length() * block.words["f"]) if length else 0.0
            self.feed_mm = rate * mm
            return self.feed_mm
        if self.feed_mm == 0.0:
            raise LineFault(NO_FEED, mend="write F first")
        if self.feed_mode == 950:
            if self.speed == 0.0:
                raise LineFault("a feed for each turn (G95) of a spindle at speed 0")
            return self.feed_mm * self.speed
        return self.feed_mm

    def _straight(self, motion: int, block: LinuxcncBlock, words: dict[str, float]) -> None:
        self._arc_refused = False
        self.motion = motion
        end = self._ends(words, block.g)
        canon, position = self.canon, self.position
        if motion == 10:
            begin = self._begin()
            canon.feed = self._rate(block, lambda: math.dist(begin, end))
        if not any(letter in words for letter in AXIS_LETTERS):
            return
        if self._compensation is not None and self._compensation.active:
            if block.g.get("one block") == 530:
                raise LineFault("G53 while the cutter's radius is compensated", "g")
            kind = Kind.RAPID if motion == 0 else Kind.LINE
            self.effort += COMPENSATION_LINES
            target = self._compensation.line(kind, self._flat(end), self._flat())
            self._put(target)
            return
        if motion == 10:
            canon.line(*end)
        elif block.g.get("one block") == 530:
            self._rapid_on_machine(end, words)
        else:
            canon.rapid(*end)
        position[:] = end

    def _rapid_on_machine(self, end: list[float], words: dict[str, float]) -> None:
        """Add the rapid of G53 G0. To machine zero it is homing, where there is an event for those
        axes."""
        named = tuple(axis for axis in "xyz" if axis in words)
        kinds = {("x", "y"): Kind.HOME_XY, ("z",): Kind.HOME_Z}
        if named in kinds and not any(words[axis] for axis in named):
            self.canon.moved = True
            self.canon.path.set_position(*self.canon.to_part(*end)).event(kinds[named])
        else:
            self.canon.rapid(*end)

    def _ends(self, words: dict[str, float], g: Mapping[str, int]) -> list[float]:
        """Return the end of a block's move (find_ends)."""
        for letter in "abc":
            if letter in words:
                self.notes.axes.setdefault(letter.upper(), self.block_index)
                old = 0.0 if self.absolute else self.others[letter]
                self.others[letter] = old + words[letter]
        if g.get("one block") == 530:
            return self._ends_on_machine(words)
        end = list(self.position)
        if self._compensates:
            begin = self._begin()
            flat = (0, 1) if self.plane == 170 else (0, 2)
            for axis in flat:
                end[axis] = begin[axis]
        for axis, letter in enumerate("xyz"):
            if letter in words:
                end[axis] = words[letter] if self.absolute else end[axis] + words[letter]
        if "@" in words or "^" in words:
            end[:2] = self._polar(words, end)
        return end

    def _polar(self, words: dict[str, float], end: list[float]) -> tuple[float, float]:
        x, y = end[0], end[1]
        radius, angle = math.hypot(y, x), math.atan2(y, x)
        is_origin = x == 0.0 and y == 0.0 and not (self.absolute and "^" in words)
        if is_origin:
            raise LineFault("polar coordinates at zero, which has no direction", "@")
        if self.absolute:
            radius = words.get("@", radius)
            angle = math.radians(words["^"]) if "^" in words else angle
        else:
            radius += words.get("@", 0.0)
            angle += math.radians(words.get("^", 0.0))
        return radius * math.cos(angle), radius * math.sin(angle)

    def _ends_on_machine(self, words: dict[str, float]) -> list[float]:
        """Return the end of a G53 move, whose coordinates are those of the machine for the point
        that carries the tool."""
        if "@" in words or "^" in words:
            raise LineFault("polar coordinates beside G53", "@")
        place = self._on_machine()
        for axis, letter in enumerate("xyz"):
            if letter in words:
                place[axis] = words[letter] - self._tool_offset[axis]
        return self._in_frame(place)

    def _arc(self, motion: int, block: LinuxcncBlock, words: dict[str, float]) -> None:
        """Add the arc of G2 or G3, given by its centre or radius, flat or helical."""
        if self._arc_refused:
            raise LineFault(
                "an arc as the first move behind cutter compensation", "g", "write a line"
            )
        offsets = {letter: words[letter] for letter in "ijk" if letter in words}
        names = [AXES[axis] for axis in PLANES[self.plane]]
        if "r" in words and offsets:
            raise LineFault("an arc with both R and a centre (I, J)", "r")
        if "r" not in words and not offsets:
            raise LineFault("an arc without I, J or R", mend="write I and J of its centre, or R")
        centres = ["ijk"["xyz".index(name)] for name in names]
        if centres[2] in offsets:
            raise LineFault(
                f"{centres[2].upper()} of an arc in the plane of G17 to G19", centres[2]
            )
        polar = "@" in words or "^" in words
        if not offsets and not polar and not any(name in words for name in names[:2]):
            axes = " or ".join(name.upper() for name in names[:2])
            raise LineFault(
                f"an arc by its radius without {axes}", mend=f"write {axes} of its end"
            )
        missing = [letter for letter in centres[:2] if letter not in offsets]
        if self.absolute_centres and offsets and missing:
            letter_pair = " and ".join(letter.upper() for letter in centres[:2])
            raise LineFault(
                f"with G90.1 an arc needs both {letter_pair}", mend=f"write {letter_pair}"
            )
        if self.feed_mode != 930:
            self._rate(block)
        end = self._flat(self._ends(words, block.g))
        begin = self._flat(self._begin())
        turns = round(words["p"]) if "p" in words else 1
        turn = turns if motion == 30 else -turns
        if "r" in words:
            centre = self._centre_of_radius(begin, end, words["r"], turn > 0)
        else:
            centre = self._centre(begin, end, centres, offsets)
        self.motion = motion
        self.canon.feed = self._rate(block, lambda: _arc_length(begin, end, centre, turn))
        self._follow(begin, end, centre, turn, words)

    def _follow(
        self,
        begin: list[float],
        end: list[float],
        centre: tuple[float, float],
        turn: int,
        words: dict[str, float],
    ) -> None:
        compensation = self._compensation
        if compensation is None or not compensation.active:
            self.canon.arc(end, centre, turn)
            self._put(end)
            return
        from .compensation import ProgrammedArc

        self.effort += COMPENSATION_LINES
        inside = turn * compensation.side > 0
        radius = abs(words["r"]) if "r" in words else math.dist(begin[:2], centre)
        if inside and compensation.first and radius <= compensation.radius:
            raise LineFault("an arc whose radius is no larger than the tool's")
        spread = self._dialect.arc_difference_mm / self.canon.mm
        self._put(compensation.arc(ProgrammedArc(end, centre, turn), self._flat(), spread))

    def _centre(
        self, begin: list[float], end: list[float], letters: list[str], offsets: dict[str, float]
    ) -> tuple[float, float]:
        """Return the centre that I, J and K give; LineFault where the radii at both ends differ
        too much."""
        first, second = (offsets.get(letter, 0.0) for letter in letters[:2])
        if self.absolute_centres:
            x, y = first, second
        else:
            x, y = begin[0] + first, begin[1] + second
        mm, dialect = self.canon.mm, self._dialect
        r1 = math.hypot(x - begin[0], y - begin[1]) * mm
        r2 = math.hypot(x - end[0], y - end[1]) * mm
        looser = INCH_SLACK if mm != 1.0 else 1.0
        min_gap, max_gap = (
            dialect.arc_difference_mm * looser,
            dialect.arc_most_difference_mm * looser,
        )
        letter = next(letter for letter in letters if letter in offsets)
        if min(r1, r2) < dialect.arc_least_radius_mm:
            raise LineFault(f"an arc of radius {min(r1, r2):.5f} mm is none for LinuxCNC", letter)
        gap = abs(r1 - r2)
        wide = gap > min_gap and gap > dialect.arc_difference_part * max(r1, r2)
        if gap > max_gap or wide:
            message = (
                f"the radius is {r1:.4f} mm at the start and {r2:.4f} mm at the end of the arc"
            )
            raise LineFault(message, letter)
        return x, y

    def _centre_of_radius(
        self, begin: list[float], end: list[float], radius: float, ccw: bool
    ) -> tuple[float, float]:
        """Return the centre of an arc given by its radius: on the left of the chord for a
        counter-clockwise arc of at most half a turn; a negative R asks for the longer arc, whose
        centre is on the other side."""
        dx, dy = end[0] - begin[0], end[1] - begin[1]
        if dx == 0.0 and dy == 0.0:
            raise LineFault("an arc by its radius that ends where it starts has no centre", "r")
        size, half = abs(radius), math.hypot(dx, dy) / 2.0
        if half - size > self._dialect.arc_chord_slack_mm / self.canon.mm:
            message = f"half the chord is {half * self.canon.mm:.4f} mm, more than the radius"
            raise LineFault(message, "r")
        height = 0.0
        if half < size * (1.0 - EQUAL_TO_ONE):
            height = math.sqrt((size - half) * (size + half))
        offset = height if ccw == (radius > 0.0) else -height
        chord = 2.0 * half
        return (
            (begin[0] + end[0]) / 2.0 - offset * dy / chord,
            (begin[1] + end[1]) / 2.0 + offset * dx / chord,
        )

    # Splines

    def _spline_move(self, motion: int, block: LinuxcncBlock, words: dict[str, float]) -> None:
        """Add the spline of G5 (cubic) or G5.1 (quadratic)."""
        if self._compensates:
            raise LineFault("a spline while the cutter's radius is compensated", "g")
        if self.feed_mode == 930:
            raise LineFault("a spline with feeds of inverse time (G93), which is not read", "g")
        feed = self._rate(block)
        if self.plane != 170:
            raise LineFault("a spline in another plane than XY", "g")
        for letter in "zabc":
            if letter in words:
                raise LineFault(f"a spline with a {letter.upper()} word", letter)
        letter_count = ("i" in words) + ("j" in words)
        if letter_count == 1 or (motion == 51 and not letter_count):
            raise LineFault("a spline wants both I and J", "g")
        x, y, _ = self.position
        lead = (words["i"], words["j"]) if letter_count else self._leaving
        points = [(x, y, 1.0), (x + lead[0], y + lead[1], 1.0)]
        end = self._ends(words, block.g)
        if motion == 50:
            if "p" not in words or "q" not in words:
                raise LineFault("G5 wants both P and Q", "g")
            points.append((end[0] + words["p"], end[1] + words["q"], 1.0))
            self._leaving = -words["p"], -words["q"]
        points.append((end[0], end[1], 1.0))
        self.canon.feed = feed
        self._follow_spline(points, len(points))
        self.motion = motion if self.motion is None else self.motion
        self.position[:] = end

    def _control_point(self, block: LinuxcncBlock, words: dict[str, float]) -> None:
        """Execute G5.2: store a control point of a NURBS."""
        if self.motion != 52:
            self._spline = []
        if ("x" in words) != ("y" in words):
            raise LineFault("a control point wants both X and Y", "g")
        weight = words.get("p", -1.0)
        has_place = "x" in words
        if self._spline and not has_place and weight > 0.0:
            raise LineFault("P without X and Y is for the first control point", "p")
        if self._spline and weight <= 0.0:
            raise LineFault("a control point without a weight P above 0", "g")
        if self.feed_mode == 940 and self.feed_mm == 0.0:
            raise LineFault(NO_FEED, mend="write F first")
        if not self._spline:
            first = weight if not has_place and weight > 0.0 else 1.0
            self._spline = [(self.position[0], self.position[1], first)]
            self._order = 3
        if words.get("l", 0.0) > 3:
            self._order = int(words["l"])
        if has_place:
            end = self._ends(words, block.g)
            self._spline.append((end[0], end[1], weight))
        self.motion = 52

    def _end_spline(self) -> None:
        """Execute G5.3: add the NURBS of the stored control points."""
        if self.motion != 52:
            raise LineFault("G5.3 without G5.2 before it", "g")
        points = self._spline
        if len(points) < self._order:
            raise LineFault(
                f"a NURBS of order {self._order} with {len(points)} control points", "g"
            )
        if any(weight <= 0.0 for _, _, weight in points):
            raise LineFault("a control point without a weight P above 0", "g")
        if self.feed_mm == 0.0:
            raise LineFault(NO_FEED, mend="write F first")
        if self._first_frame is None:
            self._first_frame = self._frame
        self.canon.feed = self.feed_mm * (self.speed if self.feed_mode == 950 else 1.0)
        self._follow_spline(points, self._order)
        self.position[:2] = points[-1][0], points[-1][1]
        self._spline, self.motion = [], None

    def _follow_spline(self, points: list[tuple[float, float, float]], order: int) -> None:
        from .splines import PIECES, pieces_of

        canon, z = self.canon, self.position[2]
        if len(canon.path) + 2 * PIECES * len(points) > bounds.MAX_MOVES:
            raise LineFault(too_many("this spline"))
        self.effort += CONTROL_POINT_LINES * len(points)
        for piece in pieces_of(points, order):
            if piece.centre is None:
                canon.line(*piece.end, z)
            else:
                canon.arc([*piece.end, z], piece.centre, 1 if piece.ccw else -1)


def _is_cycle(motion: int) -> bool:
    return motion in (730, 740) or 800 < motion < 900


def _arc_length(
    begin: list[float], end: list[float], centre: tuple[float, float], turn: int
) -> float:
    from .compensation import sweep_of

    sweep = sweep_of((begin[0], begin[1]), centre, turn, (end[0], end[1]))
    radius = math.hypot(centre[0] - begin[0], centre[1] - begin[1])
    return math.hypot(radius * sweep, end[2] - begin[2])
