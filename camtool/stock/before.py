"""The stock as a set-up finds it: what the set-ups before have cut away from either face.

Over a point the material reaches from the *floor*, which cuts from the other face have raised, up
to the *top*, which cuts from this face have lowered; it is gone where the floor is not below the
top. Cuts of the other set-ups are those of their planned toolpaths, turned into this frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing
from camtool.geometry.turn import Box, Turn
from camtool.kernels.stock import StockTree
from camtool.machine.model import Machine
from camtool.planning.job import Job
from camtool.planning.naming import setup_name
from camtool.records import replace
from camtool.stock.heights import TOP_MM, Bracket, greatest_value, stock_tree
from camtool.stock.moves import StockMoves, stock_moves_of_toolpath
from camtool.stock.slides import tools_of_rows
from camtool.toolpath.moves import Toolpath

if TYPE_CHECKING:
    from camtool.stock.heightmap import HeightMap

THROUGH_SLACK_MM = 1e-6
"""A cut that gets so near to the bottom of the stock goes through it."""

MAX_REMAINING_SQUARES = 200_000
"""The search for the thinnest place ends after this many squares."""


class SetupCut(Struct, frozen=True, eq=False):
    """The cuts of another set-up: its name, its moves with their index, and the map into its
    frame."""

    name: str
    moves: StockMoves
    tree: StockTree
    turn: Turn

    @classmethod
    def of(cls, name: str, moves: StockMoves, turn: Turn) -> SetupCut:
        """Return the cuts of a set-up whose tools make these moves, with the map into this
        set-up's frame."""
        return cls(name, moves, stock_tree(moves), turn)

    def heights_in(self, drawn: HeightMap) -> npt.NDArray[np.float32]:
        """Return the heights (NY, NX), mm, that the cuts leave in the cells of a map, measured
        from the face that this set-up cuts."""
        from camtool.stock.heightmap import add_moves

        start, end = map(self.turn.back.points, (self.moves.start, self.moves.end))
        cut = replace(drawn, heights=np.zeros_like(drawn.heights), owner=None)
        add_moves(cut, replace(self.moves, start=start, end=end))
        return cut.heights


class StockBefore(Struct, frozen=True, eq=False):
    """The stock that other set-ups have cut before a program: `above` are cuts from the program's
    own face, `below` those from the other face. `thickness_mm` is inf where nothing is cut below.
    """

    above: tuple[SetupCut, ...] = ()
    below: tuple[SetupCut, ...] = ()
    thickness_mm: float = np.inf

    def tops(self, points: Floats, grow_mm: float = 0.0) -> Floats:
        """Return the heights (J,), mm, of the tops over points (J, 2), with the tools of the
        earlier cuts widened by `grow_mm`."""
        return _lowest(self.above, points, lambda tree, at: tree.heights(at, None, grow_mm)[0])

    def floors(self, points: Floats, grow_mm: float = 0.0) -> Floats:
        """Return the heights (J,), mm, of the floors over points (J, 2), with the tools widened by
        `grow_mm`; −inf where nothing is cut from below."""
        return self._raised(
            _lowest(self.below, points, lambda tree, at: tree.heights(at, None, grow_mm)[0])
        )

    def least_tops(self, squares: Floats) -> Floats:
        """Return lower bounds (K,) of the tops over squares (K, 3)."""
        return _lowest(self.above, squares, lambda tree, at: tree.min_heights(at))

    def greatest_tops(self, squares: Floats, grow_mm: float = 0.0) -> Floats:
        """Return upper bounds (K,) of the tops over squares (K, 3)."""
        return _lowest(self.above, squares, lambda tree, at: tree.max_heights(at, None, grow_mm))

    def least_floors(self, squares: Floats, grow_mm: float = 0.0) -> Floats:
        """Return lower bounds (K,) of the floors over squares (K, 3)."""
        return self._raised(
            _lowest(self.below, squares, lambda tree, at: tree.max_heights(at, None, grow_mm))
        )

    def greatest_floors(self, squares: Floats) -> Floats:
        """Return upper bounds (K,) of the floors over squares (K, 3)."""
        return self._raised(_lowest(self.below, squares, lambda tree, at: tree.min_heights(at)))

    def shown_in(self, drawn: HeightMap) -> HeightMap:
        """Return the height map of what is left of the stock; where it is cut through, the height
        is that of its bottom."""
        heights = drawn.heights
        for each in self.above:
            heights = np.minimum(heights, each.heights_in(drawn))
        for each in self.below:
            floors = self._raised(each.heights_in(drawn).astype(np.float64))
            is_gone = floors >= heights - THROUGH_SLACK_MM
            heights = np.where(is_gone, np.float32(TOP_MM - self.thickness_mm), heights)
        return replace(drawn, heights=heights)

    def turned_over(self, drawn: HeightMap) -> HeightMap:
        """Return the height map of what is left of the stock, turned over about X: the lower face
        is at 0, and shows the cuts from below and the holes."""
        heights = np.where(drawn.heights <= -self.thickness_mm + THROUGH_SLACK_MM, -np.inf, 0.0)
        for each in self.below:
            heights = np.minimum(heights, each.heights_in(drawn))
        low_x, bottom = drawn.corner_mm
        top = bottom + len(heights) * drawn.cell_mm
        heights = heights.clip(-self.thickness_mm)[::-1].astype(np.float32)
        return replace(drawn, heights=heights, corner_mm=(low_x, -top), owner=None)

    def deepest_below(self, point: Floats) -> str:
        """Return the name of the set-up that has cut deepest from below at a point (2,)."""
        depths = [each.tree.heights(each.turn.points(point[None]))[0][0] for each in self.below]
        return self.below[int(np.argmin(depths))].name

    def _raised(self, depths: Floats) -> Floats:
        """Convert heights (J,) measured from the other face to floors (J,) in this frame; −inf
        where that face is uncut."""
        return np.where(depths < TOP_MM, TOP_MM - self.thickness_mm - depths, -np.inf)


def _lowest(
    cuts: Sequence[SetupCut], squares: Floats, heights_of: Callable[[StockTree, Floats], Floats]
) -> Floats:
    """Return the lowest height (J,) over all cuts, at points (J, 2) or squares (J, 3)."""
    lowest = np.full(len(squares), TOP_MM)
    for each in cuts:
        lowest = np.minimum(lowest, heights_of(each.tree, each.turn.points(squares)))
    return lowest


WHOLE = StockBefore()
"""Stock that nothing has cut before."""


def stock_before(job: Job, earlier: Sequence[tuple[Job, Toolpath]]) -> StockBefore:
    """Return the stock that earlier set-ups leave for this job's set-up, computed from the planned
    toolpath of each."""
    above: list[SetupCut] = []
    below: list[SetupCut] = []
    if job.stock is None:
        return WHOLE
    for other, toolpath in earlier:
        turn = job.placement.turn.back.then(other.placement.turn)
        try:
            tools = tools_of_rows(toolpath, other)
        except OptionError:  # a set-up that cuts nothing: its own findings say so
            continue
        moves = stock_moves_of_toolpath(toolpath, tools.index, tools.cutters)
        cut = SetupCut.of(setup_name(other), moves.select(~moves.rapid), turn)
        (below if turn.is_over else above).append(cut)
    return StockBefore(tuple(above), tuple(below), job.stock.thickness_mm)


def planned_before(drawing: Drawing, job: Job, machine: Machine) -> StockBefore:
    """Plan all set-ups of the part that come before the job's own, and return the stock that they
    leave; the uncut stock for a job that is no set-up."""
    if job.setup_of is None:
        return WHOLE
    from camtool.planning.plan import planned  # loads all of planning, which only set-ups need

    part_job, own = job.setup_of
    names = [each.name for each in part_job.setups]
    earlier = [part_job.setup(name) for name in names[: names.index(own.name)]]
    return stock_before(
        job, [(each, planned(drawing, each, machine).toolpath) for each in earlier]
    )


def least_remaining(tree: StockTree, before: StockBefore, box_mm: Box) -> Bracket:
    """Bracket the greatest value of floor − top, mm: how far the cuts from below reach above what
    the program leaves. A negative value is minus the least remaining thickness. Only places cut
    from both faces and through from neither are considered."""
    bottom = TOP_MM - before.thickness_mm

    def value(points: Floats) -> Floats:
        top = np.minimum(tree.heights(points)[0], before.tops(points))
        floor = before.floors(points)
        is_between = (top < TOP_MM) & (top > bottom + THROUGH_SLACK_MM)
        return np.where(is_between & (floor < TOP_MM - THROUGH_SLACK_MM), floor - top, -np.inf)

    def upper(squares: Floats) -> Floats:
        low = np.minimum(tree.min_heights(squares), before.least_tops(squares)).clip(min=bottom)
        high = np.minimum(tree.max_heights(squares), before.greatest_tops(squares))
        # If one face is cut through all over a square, nothing is left where both could meet.
        is_between = (low < TOP_MM) & (high > bottom + THROUGH_SLACK_MM)
        is_between &= before.least_floors(squares) < TOP_MM - THROUGH_SLACK_MM
        floor = before.greatest_floors(squares).clip(max=TOP_MM)
        return np.where(is_between, floor - low, -np.inf)

    return greatest_value(value, upper, box_mm, max_squares=MAX_REMAINING_SQUARES)
