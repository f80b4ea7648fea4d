"""What a probe does: cycles that touch a part, and the grid over the area that a program cuts.

A cycle is a generator. It yields one `ProbeStep` after the other, is sent the place at which the
tool then stands (`ProbeAnswer`), and returns what it has measured, in the work frame in which it
began. Each place is touched twice, fast and then slowly. Where a touch finds nothing, the tool
goes back the way it came, and the cycle ends with a MachineError."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Literal

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.errors import MachineError, OptionError, PostError
from camtool.geometry.distance import nearest
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import Segments
from camtool.toolpath.moves import Toolpath, toolpath_extents
from camtool.toolpath.surface import MIN_NODES, Surface, filled

MAX_POINTS = 10_000
"""Grids of more points are refused: at 5 s each they would take 14 hours."""

MAX_SPREAD_MM = 0.2
"""Largest difference between the fast and the slow touch of a place."""

NEAR_MM = 0.05
"""Largest distance of a reported touch from the way that the tool was sent."""

SAME_MM = 1e-3
"""Places within this distance are one."""

Axis = Literal["x", "y", "z"]
AXES: tuple[Axis, Axis, Axis] = ("x", "y", "z")
Place = tuple[float, float, float]


class ProbeStep(Struct, frozen=True):
    """One order to a machine with a probe; `axes`: mm in the work frame.

    "go": move rapidly, whatever the probe says; "guard": move at `feed` (mm/min), and stop where
    the probe touches; "touch": the same, towards what is to be measured; "zero": the tool stands
    at these coordinates from now on."""

    action: Literal["go", "guard", "touch", "zero"]
    axes: Mapping[Axis, float]
    feed: float = 0.0


class ProbeAnswer(Struct, frozen=True):
    """The answer of the machine to a step: the place, mm in the work frame, at which the probe
    touched, or at which the tool now stands."""

    place: Place
    has_touched: bool = False


ProbeScript = Generator[ProbeStep, ProbeAnswer, None]
"""A cycle that has begun."""

ProbeCycle = Callable[[Place], ProbeScript]
"""Function that begins a cycle, given the place of the tool."""

TouchNote = Callable[[ProbeStep, ProbeAnswer], None]
"""Function that is told of each touch, and of each zero that is set."""


class CycleRun:
    """A cycle under way: `step` is what the machine is to do next, None at the end; `failure`: why
    the cycle has ended before its end; `place`: where the tool stands, mm in the work frame."""

    def __init__(self, cycle: ProbeCycle) -> None:
        self._cycle = cycle
        self._script: ProbeScript | None = None
        self.step: ProbeStep | None = None
        self.failure = ""
        self.place: Place = (0.0, 0.0, 0.0)

    @property
    def has_begun(self) -> bool:
        """True once the machine has said where it stands."""
        return self._script is not None

    def begin(self, place: Place) -> None:
        """Begin the cycle with a tool that stands at `place`, mm in the work frame."""
        self.place, self._script = place, self._cycle(place)
        self._turn(None)

    def answer(self, touched: Place | None = None) -> None:
        """Note that the step is done, and take the next one: the probe touched at the place
        `touched`, or did not touch (None)."""
        step = self.step
        assert step is not None
        x, y, z = (step.axes.get(axis, self.place["xyz".index(axis)]) for axis in AXES)
        self.place = touched or (x, y, z)
        self._turn(ProbeAnswer(self.place, touched is not None))

    def refusal(self, touched: Place) -> str:
        """Return the reason why the probe cannot have touched at this place: the step does not
        pass there. "" if it can.

        The place is what the controller reported."""
        assert self.step is not None
        for axis, before, reported in zip(AXES, self.place, touched, strict=True):
            end = self.step.axes.get(axis, before)
            low, high = min(before, end) - NEAR_MM, max(before, end) + NEAR_MM
            if not low <= reported <= high:
                return (
                    f"it says that the probe touched at {axis.upper()}{reported:.3f}, and it "
                    f"moved from {before:.3f} to {end:.3f}"
                )
        return ""

    def _turn(self, answer: ProbeAnswer | None) -> None:
        assert self._script is not None
        self.step = None
        try:
            step = next(self._script) if answer is None else self._script.send(answer)
            while step.action == "guard" and self._is_there(step):
                step = self._script.send(ProbeAnswer(self.place))
        except StopIteration:
            return
        except MachineError as error:
            self.failure = str(error)
        else:
            self.step = step

    def _is_there(self, step: ProbeStep) -> bool:
        """Return True if the step would not move the tool: controllers refuse to probe without a
        move."""
        return all(
            abs(value - self.place["xyz".index(axis)]) < SAME_MM
            for axis, value in step.axes.items()
        )


Measured = Generator[ProbeStep, ProbeAnswer, dict[str, float]]
"""A cycle that returns what it has measured, mm."""


class Touch(Struct, frozen=True):
    """The way in which places are touched: up to `reach_mm` away at `fast` mm/min, then `back_mm`
    back and again at `slow`.

    Between the places the tool moves at `travel` and stops if it touches anything. `radius_mm`:
    radius of the tool or of the tip of the probe. `sets_zero`: what is measured gets the
    coordinates `values`, 0 if there are none."""

    reach_mm: float = 10.0
    fast: float = 100.0
    slow: float = 25.0
    back_mm: float = 1.0
    travel: float = 150.0
    radius_mm: float = 0.0
    sets_zero: bool = True
    values: Mapping[str, float] = {}


def touch(
    start: Place, axis: Axis, sense: int, how: Touch
) -> Generator[ProbeStep, ProbeAnswer, float]:
    """Touch from `start` along an axis, fast and then slowly, and go back to `start`; return the
    coordinate, mm, of the tool's centre (of its tip in Z)."""
    begin = start["xyz".index(axis)]
    fast = yield from _touch_once(begin, begin + sense * how.reach_mm, axis, how.fast, begin)
    if abs(fast - begin) < how.back_mm:
        yield ProbeStep("go", {axis: begin})
        raise MachineError(
            f"it touches {abs(fast - begin):.3f} mm from where it began, nearer than the "
            f"{how.back_mm:g} mm by which it goes back",
            mend="begin further away, or give a smaller --back",
        )
    back, far_end = fast - sense * how.back_mm, fast + sense * how.back_mm
    yield ProbeStep("go", {axis: back})
    slow = yield from _touch_once(back, far_end, axis, how.slow, begin)
    yield ProbeStep("go", {axis: begin})
    if abs(slow - fast) > MAX_SPREAD_MM:
        raise MachineError(
            f"the fast touch is at {axis.upper()}{fast:.3f} and the slow one at {slow:.3f}, more "
            f"than {MAX_SPREAD_MM:g} mm apart",
            mend="fasten probe and part, look at the cable, or give a lower --feed",
        )
    return slow


def _touch_once(
    begin: float, end: float, axis: Axis, feed: float, retreat: float
) -> Generator[ProbeStep, ProbeAnswer, float]:
    answer = yield ProbeStep("touch", {axis: end}, feed)
    if not answer.has_touched:
        yield ProbeStep("go", {axis: retreat})
        raise MachineError(
            f"nothing was touched between {axis.upper()}{begin:.3f} and {end:.3f}: the probe did "
            "not touch, and has gone back",
            mend="bring it nearer, give a larger --reach, or look at its cable",
        )
    return answer.place["xyz".index(axis)]


def _guard(axes: Mapping[Axis, float], how: Touch) -> Generator[ProbeStep, ProbeAnswer, None]:
    """Move to these coordinates where nothing should be in the way; MachineError if the probe
    touches something."""
    answer = yield ProbeStep("guard", axes, how.travel)
    if answer.has_touched:
        raise MachineError(
            "the probe touched on its way, at X{:.3f} Y{:.3f} Z{:.3f}, where it stands".format(
                *answer.place
            ),
            mend="move it away by hand, and begin where the way is free",
        )


def _zero(
    stands: Place, measured_mm: Mapping[Axis, float], how: Touch
) -> Generator[ProbeStep, ProbeAnswer, None]:
    """Set the work coordinates so that what was measured at `measured_mm` gets the values of
    `how`; the tool stands at `stands`. Without `how.sets_zero` do nothing."""
    if how.sets_zero:
        values = {
            axis: stands["xyz".index(axis)] - place + how.values.get(axis, 0.0)
            for axis, place in measured_mm.items()
        }
        yield ProbeStep("zero", values)


def plate(start: Place, how: Touch, thickness_mm: float) -> Measured:
    """Touch a plate of this thickness that lies on the part. If zero is set, the lower side of the
    plate becomes Z0."""
    top = yield from touch(start, "z", -1, how)
    yield from _zero(start, {"z": top - thickness_mm}, how)
    return {"top_z_mm": top, "z_mm": top - thickness_mm}


def edge(start: Place, axis: Axis, sense: int, how: Touch) -> Measured:
    """Touch a side of a part from beside it. If zero is set, the side becomes 0 of that axis."""
    place = yield from _side(start, axis, sense, how)
    yield from _zero(start, {axis: place}, how)
    return {f"{axis}_mm": place}


def _side(
    start: Place, axis: Axis, sense: int, how: Touch
) -> Generator[ProbeStep, ProbeAnswer, float]:
    """Touch a side of the part; return its coordinate: that of the tool's centre, and the tool's
    radius beyond it."""
    return (yield from touch(start, axis, sense, how)) + sense * how.radius_mm


def corner(
    start: Place, senses: tuple[int, int], how: Touch, along_mm: float, *, is_inside: bool = False
) -> Measured:
    """Touch the two sides of a corner, in the direction `senses` of X and of Y. If zero is set,
    the corner becomes X0 Y0.

    Outside, the tool stands diagonally beyond the corner, and goes `along_mm` along each side
    before it touches it; inside (a pocket, a fence) both sides are touched from where it stands.
    """
    x, y, z = start
    step = 0.0 if is_inside else along_mm
    beside_x, beside_y = (x, y + senses[1] * step, z), (x + senses[0] * step, y, z)
    if step:
        yield from _guard({"y": beside_x[1]}, how)
    found_x = yield from _side(beside_x, "x", senses[0], how)
    if step:
        yield from _guard({"y": y}, how)
        yield from _guard({"x": beside_y[0]}, how)
    found_y = yield from _side(beside_y, "y", senses[1], how)
    if step:
        yield from _guard({"x": x}, how)
    yield from _zero(start, {"x": found_x, "y": found_y}, how)
    return {"x_mm": found_x, "y_mm": found_y}


def bore(start: Place, how: Touch) -> Measured:
    """Touch a bore at four places from within, X again through the centre, and go to its centre.
    If zero is set, that becomes X0 Y0."""
    x, y, z = start
    x, _ = yield from _middle((x, y, z), "x", how)
    yield from _guard({"x": x}, how)
    y, height = yield from _middle((x, y, z), "y", how)
    yield from _guard({"y": y}, how)
    x, width = yield from _middle((x, y, z), "x", how)
    yield from _guard({"x": x}, how)
    yield from _zero((x, y, z), {"x": x, "y": y}, how)
    return _round(x, y, width + 2.0 * how.radius_mm, height + 2.0 * how.radius_mm)


def _round(x: float, y: float, width: float, height: float) -> dict[str, float]:
    return {
        "x_mm": x,
        "y_mm": y,
        "diameter_mm": 0.5 * (width + height),
        "width_x_mm": width,
        "width_y_mm": height,
    }


def _middle(
    start: Place, axis: Axis, how: Touch
) -> Generator[ProbeStep, ProbeAnswer, tuple[float, float]]:
    """Touch two opposite walls from `start`; return the coordinate midway between them and their
    distance, mm."""
    low = yield from touch(start, axis, -1, how)
    high = yield from touch(start, axis, 1, how)
    return 0.5 * (low + high), high - low


def boss(start: Place, how: Touch, size_mm: float, clear_mm: float, depth_mm: float) -> Measured:
    """Touch a boss about `size_mm` wide at four places from outside. If zero is set, its centre
    becomes X0 Y0.

    The tool stands free above its centre. It goes out beyond each side by `clear_mm`, and down by
    `depth_mm`; X is touched again through the centre, and the tool ends above it."""
    x, y, z = start
    x, _ = yield from _across((x, y, z), "x", how, size_mm, clear_mm, depth_mm)
    y, height = yield from _across((x, y, z), "y", how, size_mm, clear_mm, depth_mm)
    x, width = yield from _across((x, y, z), "x", how, size_mm, clear_mm, depth_mm)
    yield from _zero((x, y, z), {"x": x, "y": y}, how)
    return _round(x, y, width - 2.0 * how.radius_mm, height - 2.0 * how.radius_mm)


def _across(
    above: Place, axis: Axis, how: Touch, size_mm: float, clear_mm: float, depth_mm: float
) -> Generator[ProbeStep, ProbeAnswer, tuple[float, float]]:
    """Touch two opposite sides of a boss and go above the middle between them; return the
    coordinate of the middle and their distance, mm."""
    index, places = "xyz".index(axis), list[float]()
    for sense in (-1, 1):
        place = list(above)
        place[index] -= sense * (0.5 * size_mm + how.radius_mm + clear_mm)
        yield from _guard({axis: place[index]}, how)
        yield from _guard({"z": above[2] - depth_mm}, how)
        try:
            places.append((yield from touch((place[0], place[1], place[2]), axis, sense, how)))
        except MachineError:
            yield ProbeStep("go", {"z": above[2]})
            raise
        yield ProbeStep("go", {"z": above[2]})
    high, low = places
    yield from _guard({axis: 0.5 * (low + high)}, how)
    return 0.5 * (low + high), high - low


def skew(start: Place, axis: Axis, sense: int, how: Touch, along_mm: float) -> Measured:
    """Touch a side at two places, `along_mm` apart along the other axis; return the angle, degrees
    counter-clockwise, by which it is turned out of the direction of that axis."""
    other: Axis = "y" if axis == "x" else "x"
    first = yield from touch(start, axis, sense, how)
    place = list(start)
    place["xyz".index(other)] += along_mm
    yield from _guard({other: place["xyz".index(other)]}, how)
    second = yield from touch((place[0], place[1], place[2]), axis, sense, how)
    yield from _guard({other: start["xyz".index(other)]}, how)
    slope = math.degrees(math.atan2(second - first, abs(along_mm)))
    turned = slope if (axis == "y") == (along_mm > 0.0) else -slope
    return {"angle_deg": turned, "first_mm": first, "second_mm": second, "along_mm": along_mm}


def noted(cycle: ProbeCycle, note: TouchNote) -> ProbeCycle:
    """Return a cycle that does the same and calls `note` after each touch and each zero that is
    set."""

    def run(start: Place) -> ProbeScript:
        script = cycle(start)
        try:
            step = next(script)
            while True:
                answer = yield step
                if step.action in ("touch", "zero"):
                    note(step, answer)
                step = script.send(answer)
        except StopIteration:
            return

    return run


def height_map(
    points: Sequence[tuple[float, float]],
    clear_mm: float,
    lowest_mm: float,
    feed: float,
    heights: list[float],
) -> ProbeCycle:
    """Return a cycle that touches the top at each point and adds the heights to the list
    `heights`, in order.

    Between the points the probe is at `clear_mm`; it goes down to `lowest_mm` at most, at `feed`
    mm/min."""

    def run(_: Place) -> ProbeScript:
        yield ProbeStep("go", {"z": clear_mm})
        for x, y in points:
            yield ProbeStep("go", {"x": x, "y": y})
            heights.append((yield from _touch_once(clear_mm, lowest_mm, "z", feed, clear_mm)))
            yield ProbeStep("go", {"z": clear_mm})

    return run


def grid_over(toolpath: Toolpath, step_mm: float) -> tuple[Floats, Floats]:
    """Return the nodes (NX,), (NY,) mm of a grid over all cuts, at most `step_mm` apart. PostError
    for a program without cuts, OptionError for a step that makes no grid."""
    if not step_mm > 0.0:
        raise OptionError(f"a step of {step_mm:g} mm makes no grid", where="--step")
    path = toolpath.first(toolpath.executed_rows)
    if not path.is_feed.any():
        raise PostError("the program cuts nothing", mend="give a program with moves at a feed")
    low, high = toolpath_extents(path, rows=path.is_feed)[:2].T
    nodes = []
    for axis in (0, 1):
        width = float(high[axis] - low[axis])
        count = max(math.ceil(min(width / step_mm, MAX_POINTS) - 1e-9) + 1, MIN_NODES)
        # A program that cuts along one line has a grid of the step's width.
        half = 0.5 * (max(width, step_mm) if width < 1e-6 else width)
        middle = 0.5 * float(high[axis] + low[axis])
        nodes.append(np.linspace(middle - half, middle + half, count))
    if len(nodes[0]) * len(nodes[1]) > MAX_POINTS:
        raise OptionError(
            f"the grid has {len(nodes[0])} × {len(nodes[1])} points, and {MAX_POINTS} are allowed",
            where="--step",
            mend="give a larger step",
        )
    return nodes[0], nodes[1]


class Box(Struct, frozen=True):
    """A clamp, or another place where no tool may be: its extents `x_mm` and `y_mm` (from, to) and
    the height of its top."""

    name: str
    x_mm: tuple[float, float]
    y_mm: tuple[float, float]
    top_mm: float


def probed_nodes(
    x: Floats, y: Floats, holes: Sequence[Segments], boxes: Sequence[Box], margin_mm: float
) -> Bools:
    """Return the mask (NY, NX) of the nodes that are probed: those neither in a closed contour
    or a box nor within `margin_mm` of one. OptionError if none remains."""
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    probed = np.ones(len(points), dtype=np.bool_)
    for ring in holes:
        probed &= ~inside(points, ring) & (nearest(points, ring).distance > margin_mm)
    for box in boxes:
        low = np.array([box.x_mm[0], box.y_mm[0]]) - margin_mm
        high = np.array([box.x_mm[1], box.y_mm[1]]) + margin_mm
        probed &= ~((points >= low) & (points <= high)).all(axis=1)
    if not probed.any():
        raise OptionError(
            "no point of the grid lies beside the holes and clamps", mend="give a smaller --step"
        )
    return probed.reshape(len(y), len(x))


def refuse_boxes_on_the_way(
    points: Sequence[tuple[float, float]], boxes: Sequence[Box], clear_mm: float, margin_mm: float
) -> None:
    """Raise OptionError if the straight way at `clear_mm` from one point to the next leads over,
    or within `margin_mm` of, a box whose top is at that height or above."""
    places = np.array(points)
    begin, steps = places[:-1], np.diff(places, axis=0)
    for box in boxes:
        if box.top_mm < clear_mm:
            continue
        first, last = np.zeros(len(steps)), np.ones(len(steps))
        for axis, (low, high) in enumerate((box.x_mm, box.y_mm)):
            with np.errstate(divide="ignore", invalid="ignore"):
                shares = (
                    np.array([[low - margin_mm], [high + margin_mm]]) - begin[:, axis]
                ) / steps[:, axis]
            stands = steps[:, axis] == 0.0
            within = (begin[:, axis] >= low - margin_mm) & (begin[:, axis] <= high + margin_mm)
            enters = np.where(stands, np.where(within, 0.0, np.inf), shares.min(axis=0))
            leaves = np.where(stands, np.where(within, 1.0, -np.inf), shares.max(axis=0))
            first, last = np.maximum(first, enters), np.minimum(last, leaves)
        if (first <= last).any():
            number = int((first <= last).argmax())
            (x, y), (to_x, to_y) = points[number], points[number + 1]
            raise OptionError(
                f"the way from X{x:g} Y{y:g} to X{to_x:g} Y{to_y:g} at Z{clear_mm:g} leads "
                f"through {box.name!r}, whose top is at Z{box.top_mm:g}",
                where="--clear",
                mend="give a larger one; or say in the job how high it is (z)",
            )


def in_rows(x: Floats, y: Floats, probed: Bools) -> list[tuple[float, float]]:
    """Return the (x, y) of the probed nodes row by row, every other row backwards, so that the
    probe travels little."""
    points: list[tuple[float, float]] = []
    for row, place in enumerate(y.tolist()):
        columns = np.flatnonzero(probed[row])[:: -1 if row % 2 else 1]
        points += [(value, place) for value in x[columns].tolist()]
    return points


def surface_from(x: Floats, y: Floats, probed: Bools, heights: Sequence[float]) -> Surface:
    """Return the surface of the heights probed at the nodes of the mask `probed`, in the order of
    `in_rows`."""
    z = np.full(probed.shape, np.nan)
    values = iter(heights)
    for row in range(len(y)):
        for column in np.flatnonzero(probed[row])[:: -1 if row % 2 else 1].tolist():
            z[row, column] = next(values)
    return filled(x, y, z)
