"""Shaded pictures of a height map: light, shadows, and the colour of the material.

Pixels are computed with sums, products, quotients and roots alone, which all processors round
alike. Colours are mixed as light (squares of the values of the page) and written as its roots.
The map stands on a board; where the stock is cut through, the board is seen."""

from __future__ import annotations

import base64
import math
import struct
import zlib

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Floats, Octets
from camtool.kernels.heightmap import project
from camtool.pictures.colours import channels
from camtool.stock.heightmap import HeightMap
from camtool.stock.moves import StockMoves

Heights = npt.NDArray[np.float32]

SAMPLES = 2
"""Each pixel is the mean of so many samples in each direction."""

ROWS_AT_ONCE = 64

THROUGH_MM = 1e-4
"""Stock thinner than this under a cut counts as cut through."""

TOP, DEEP, SIDE = "#ecd2a6", "#b07a45", "#d3a973"
"""Colours of the material: its top, the deepest floors, and between them the walls."""

AMBIENT, SKY, KEY = 0.30, 0.18, 0.62
"""Light from everywhere, from above, and from the lamp."""

PENUMBRA = 0.012
"""Width of the edge of a shadow, as a share of the map."""

NEARBY = ((0.012, 0.30), (0.035, 0.28), (0.1, 0.25))
"""Distances, as shares of the map, within which neighbours shade a cell, and how much."""

WALL_CELLS = 4.0
"""A step between neighbouring cells that is higher than this many cells is a wall; a lower one is
a slope."""

WALL_REACHES = (3, 2)
"""Cells over which heights are averaged for the direction of a wall."""

GLOSS = 0.05
"""Largest change of brightness by the direction of the tool's marks."""


class Camera(Struct, frozen=True):
    """A camera that looks along the horizontal `direction` (x, y) of length 1, from above the
    table by the angle with this `sine`.

    The lamp stands in the direction `lamp` (to the right, away from the viewer), and `rise` times
    as high as it is far away."""

    direction: tuple[float, float]
    sine: float
    lamp: tuple[float, float]
    rise: float

    @property
    def cosine(self) -> float:
        return math.sqrt(1.0 - self.sine * self.sine)

    def place(self, x: float, y: float, z: float) -> tuple[float, float]:
        """Return where a point of the part appears on the picture: mm to the right and mm up."""
        fx, fy = self.direction
        return x * fy - y * fx, z * self.cosine + (x * fx + y * fy) * self.sine

    @property
    def light(self) -> tuple[float, float, float]:
        """Direction to the lamp, of length 1."""
        (fx, fy), (right, distance) = self.direction, self.lamp
        x, y = right * fy + distance * fx, distance * fy - right * fx
        size = math.sqrt((x * x + y * y) * (1.0 + self.rise * self.rise))
        return x / size, y / size, self.rise / math.sqrt(1.0 + self.rise * self.rise)


_HALF = math.sqrt(0.5)
CAMERAS = {
    "iso": Camera((_HALF, _HALF), math.sqrt(1.0 / 3.0), (-1.0, 0.25), 1.15),
    "front": Camera((0.0, 1.0), 0.0, (-1.0, -0.6), 1.15),
    "side": Camera((-1.0, 0.0), 0.0, (-1.0, -0.6), 1.15),
    "top": Camera((0.0, 1.0), 1.0, (-0.8, 0.7), 1.9),
}
CAMERAS["bottom"] = CAMERAS["iso"]
"""Views by name; in "bottom" the block is turned over. In "iso" lengths along all three axes are
seen at one scale; "front" and "side" are those of a drawing, level with the table."""


class Stage(Struct, frozen=True, eq=False):
    """The scene to be lit: heights (NY, NX) mm of the stock, and of a board around it that is
    `margin` cells wide.

    `bottom_mm` and `deep_mm`: heights of the board and of the deepest floor. `marks` (NY, NX): how
    much the marks of the tool catch the light, −1 … 1. `tint` (NY, NX, 3): the light of the
    colours of floors, in place of those of the material."""

    heights: Heights
    corner_mm: tuple[float, float]
    cell_mm: float
    bottom_mm: float
    deep_mm: float
    margin: int = 0
    marks: Heights | None = None
    tint: Heights | None = None

    @property
    def size_mm(self) -> float:
        """The longer side of the map, mm."""
        return float(self.cell_mm * max(self.heights.shape))


def stage_of(
    height_map: HeightMap, thickness_mm: float, moves: StockMoves | None, margin: float
) -> Stage:
    """Return the height map on a board that reaches beyond it by `margin`, a share of its longer
    side."""
    bottom = -thickness_mm
    heights = np.where(height_map.heights <= bottom + THROUGH_MM, bottom, height_map.heights)
    rows, columns = heights.shape
    pad = math.ceil(margin * max(rows, columns))
    marks = None
    if moves is not None and height_map.owner is not None:
        marks = np.pad(_marks(height_map, moves), ((pad, pad), (pad, pad)))
    return Stage(
        np.pad(heights, pad, constant_values=bottom).astype(np.float32),
        (
            height_map.corner_mm[0] - pad * height_map.cell_mm,
            height_map.corner_mm[1] - pad * height_map.cell_mm,
        ),
        height_map.cell_mm,
        bottom,
        float(height_map.heights.min(initial=0.0)),
        pad,
        marks,
    )


def _marks(height_map: HeightMap, moves: StockMoves) -> Heights:
    """Return how much the tool marks of each cell (NY, NX) catch the light, −1 … 1.

    It is the cosine of twice the angle between the cut and the diagonal; 0 where nothing cut, or
    straight down."""
    travel = moves.end[:, :2] - moves.start[:, :2]
    square = travel[:, 0] * travel[:, 0] + travel[:, 1] * travel[:, 1]
    catch = np.where(
        square > 0.0, 2.0 * travel[:, 0] * travel[:, 1] / np.where(square > 0.0, square, 1.0), 0.0
    )
    table = np.append(catch, 0.0).astype(np.float32)
    assert height_map.owner is not None
    return np.asarray(table[height_map.owner])


def light_of(colour: str) -> Floats:
    """Return the light (3,), 0 … 1, of a colour "#rrggbb": the squares of its channels."""
    return np.array(channels(colour), dtype=np.float64) ** 2 / 255.0**2


def floor_colours(count: int) -> Octets:
    """Return the colours (count, 3) of unshaded floors, from the top of the stock to the
    deepest."""
    share = np.arange(count)[:, None] / (count - 1)
    top, low = light_of(TOP), light_of(DEEP)
    light = AMBIENT + SKY + KEY * CAMERAS["iso"].light[2]
    mixed = np.clip((top + (low - top) * share) * light, 0.0, 1.0)
    return np.asarray((np.sqrt(mixed) * 255.0 + 0.5).astype(np.uint8))


def picture_of(
    stage: Stage,
    camera: Camera,
    window: tuple[float, float, float, float],
    sizes: tuple[int, int],
    ground: str,
) -> Octets:
    """Return the pixels (H, W, 3) of a window (left, low, right, high; mm on the picture) with
    `sizes` (W, H).

    The board has the colour `ground`."""
    wide, high = sizes[0] * SAMPLES, sizes[1] * SAMPLES
    pixel = (window[2] - window[0]) / wide
    cell = np.empty((high, wide), dtype=np.int32)
    level = np.empty((high, wide), dtype=np.float32)
    half = 0.5 * stage.cell_mm
    project(
        stage.heights,
        (stage.corner_mm[0] + half, stage.corner_mm[1] + half, stage.cell_mm),
        (
            *camera.direction,
            camera.sine,
            camera.cosine,
            window[0] + 0.5 * pixel,
            window[1] + 0.5 * pixel,
            pixel,
        ),
        WALL_CELLS * stage.cell_mm,
        cell,
        level,
    )
    lit = _lit(stage, camera)
    pixels = np.empty((sizes[1], sizes[0], 3), dtype=np.uint8)
    for first in range(0, sizes[1], ROWS_AT_ONCE):
        rows = slice(first * SAMPLES, (first + ROWS_AT_ONCE) * SAMPLES)
        colours = _colours(lit, cell[rows], level[rows], light_of(ground))
        # The mean of the light of SAMPLES² points; the first row of a picture is its highest.
        mean = sum(
            colours[i::SAMPLES, j::SAMPLES] for i in range(SAMPLES) for j in range(SAMPLES)
        ) / np.float32(SAMPLES * SAMPLES)
        last = sizes[1] - first
        pixels[max(last - ROWS_AT_ONCE, 0) : last] = (np.sqrt(mean) * 255.0 + 0.5)[::-1]
    return pixels


class _LitStage(Struct, frozen=True, eq=False):
    """A stage with the light on its cells (NY, NX).

    `flat`, `steep`: how directly they face the lamp as floors and as walls; `shade`: the height
    below which it does not shine; `open_sky`: the share of the sky that they see; `fade`: how much
    of all this the board shows, 0 at its edges. `open_board`: the light of the board far from the
    stock."""

    stage: Stage
    flat: Heights
    steep: Heights
    shade: Heights
    open_sky: Heights
    fade: Heights
    open_board: float


def _lit(stage: Stage, camera: Camera) -> _LitStage:
    """Return the stage with the light that falls on its cells."""
    return _LitStage(
        stage,
        *_facing(stage, camera),
        _shadows(stage.heights, camera.light, stage.cell_mm),
        _openness(stage, stage.size_mm),
        _fade(stage),
        AMBIENT + SKY + KEY * camera.light[2],
    )


def _colours(
    lit: _LitStage, cell: npt.NDArray[np.int32], level: Heights, ground: Floats
) -> Heights:
    """Return the light (H, W, 3) of each pixel, given the cell that it shows and its height."""
    stage, size = lit.stage, lit.stage.size_mm
    is_ground = cell == -1
    wall = (cell < 0) & ~is_ground
    number = np.where(wall, ~cell, np.maximum(cell, 0))
    facing = np.where(wall, lit.steep.ravel()[number], lit.flat.ravel()[number])
    shade = lit.shade.ravel()[number]
    clear = np.clip((level - shade) / np.float32(PENUMBRA * size) + 1.0, 0.0, 1.0)
    open_sky = lit.open_sky.ravel()[number]
    # A wall is as open as its foot below, and as the top above.
    foot = stage.heights.ravel()[number]
    depth = np.clip((level - foot) / np.float32(0.06 * size), 0.0, 1.0)
    open_sky = open_sky + np.where(wall, (1.0 - open_sky) * depth, 0.0)
    light = AMBIENT * open_sky + SKY * open_sky * open_sky + KEY * facing * clear
    share = np.clip(level / np.float32(min(stage.deep_mm, -1e-6)), 0.0, 1.0)[..., None]
    top, low, side = (light_of(each).astype(np.float32) for each in (TOP, DEEP, SIDE))
    material = top + (low - top) * share
    material = np.where(wall[..., None], side + (low - side) * (0.5 * share), material)
    board = (level <= np.float32(stage.bottom_mm + THROUGH_MM)) & ~wall
    if stage.marks is not None:
        light = light * (1.0 + GLOSS * np.where(wall, 0.0, stage.marks.ravel()[number]))
    if stage.tint is not None:
        tint = stage.tint.reshape(-1, 3)[number]
        material = np.where(wall[..., None], material, tint)
    # The colour of the board is meant for the light in the open, so that it is divided by that.
    faded = lit.open_board + (light - lit.open_board) * lit.fade.ravel()[number]
    light = np.where(board, faded, light)
    paper = ground.astype(np.float32) / np.float32(lit.open_board)
    material = np.where(board[..., None], paper, material)
    colours = material * light[..., None].astype(np.float32)
    colours[is_ground] = ground
    return np.asarray(np.clip(colours, 0.0, 1.0), dtype=np.float32)


def _facing(stage: Stage, camera: Camera) -> tuple[Heights, Heights]:
    """Return how directly each cell (NY, NX) faces the lamp, 0 … 1: once as a floor, and once as a
    wall."""
    heights, cell = stage.heights, np.float32(stage.cell_mm)
    flat = _towards(_lesser(heights, 1) / cell, _lesser(heights, 0) / cell, camera)
    smooth = heights
    for reach in WALL_REACHES:
        smooth = _mean(_mean(smooth, reach, 0), reach, 1)
    steep = _towards(_central(smooth, 1) / cell, _central(smooth, 0) / cell, camera)
    return flat, steep


def _towards(x: Heights, y: Heights, camera: Camera) -> Heights:
    lx, ly, lz = (np.float32(part) for part in camera.light)
    facing = (lz - x * lx - y * ly) / np.sqrt(1.0 + x * x + y * y)
    return np.asarray(np.clip(facing, 0.0, 1.0))


def _lesser(heights: Heights, axis: int) -> Heights:
    """Return the slope of each cell along an axis, mm from cell to cell: the lesser of the steps
    to both neighbours.

    It is 0 where the two differ in sign, and at the edges, so that floors beside walls stay level.
    """
    step = np.diff(heights, axis=axis)
    zeros = np.zeros_like(heights.take([0], axis=axis))
    step_behind = np.concatenate([zeros, step], axis=axis)
    step_ahead = np.concatenate([step, zeros], axis=axis)
    lesser = np.minimum(np.abs(step_behind), np.abs(step_ahead))
    return np.asarray(
        np.where(step_behind * step_ahead > 0.0, np.where(step_ahead > 0.0, lesser, -lesser), 0.0)
    )


def _central(heights: Heights, axis: int) -> Heights:
    """Return half the difference of both neighbours of each cell along an axis."""
    return np.asarray(0.5 * (np.roll(heights, -1, axis) - np.roll(heights, 1, axis)))


def _mean(heights: Heights, reach: int, axis: int) -> Heights:
    """Return the mean of 2 · reach + 1 cells along an axis, for each cell; edges repeat."""
    widths = [(0, 0), (0, 0)]
    widths[axis] = (reach + 1, reach)
    total = np.cumsum(np.pad(heights, widths, mode="edge"), axis=axis, dtype=np.float64)
    count = 2 * reach + 1
    size = total.shape[axis]
    low = total.take(range(size - count), axis=axis)
    high = total.take(range(count, size), axis=axis)
    return np.asarray((high - low) / count, dtype=np.float32)


def _shadows(heights: Heights, light: tuple[float, float, float], cell_mm: float) -> Heights:
    """Return the height (NY, NX) of the shadow over each cell: below it the lamp does not
    shine."""
    x, y, z = light
    if abs(x) > abs(y):
        return np.ascontiguousarray(
            _shadows(np.ascontiguousarray(heights.T), (y, x, z), cell_mm).T
        )
    order = range(len(heights)) if y < 0.0 else range(len(heights) - 1, -1, -1)
    shift = x / abs(y)
    drop = np.float32(z / abs(y) * cell_mm)
    whole_cells = math.floor(shift)
    part = np.float32(shift - whole_cells)
    count = heights.shape[1]
    index = np.clip(np.arange(count) + whole_cells, 0, count - 1)
    next_index = np.clip(index + 1, 0, count - 1)
    shadows = np.empty_like(heights)
    before = np.full(count, -np.inf, dtype=np.float32)
    first = True
    for row in order:
        if not first:
            before = (before[index] * (1.0 - part) + before[next_index] * part) - drop
        shadows[row] = before if not first else heights[row]
        before = np.maximum(shadows[row], heights[row])
        first = False
    return shadows


def _openness(stage: Stage, size_mm: float) -> Heights:
    """Return about which share (NY, NX) of the sky each cell sees past its neighbours."""
    heights = stage.heights
    open_sky = np.ones_like(heights)
    for share, weight in NEARBY:
        reach_mm = share * size_mm
        step = max(1, int(reach_mm / stage.cell_mm / 6.0))
        thin = heights[::step, ::step]
        reach = max(1, round(reach_mm / (stage.cell_mm * step)))
        for _ in range(2):
            thin = _mean(_mean(thin, reach, 0), reach, 1)
        neighbours = _enlarged(thin, step, heights.shape)
        covered = np.clip((neighbours - heights) / np.float32(0.5 * reach_mm), 0.0, 1.0)
        open_sky *= 1.0 - np.float32(weight) * covered
    return open_sky


def _fade(stage: Stage) -> Heights:
    """Return weights (NY, NX) that are 1 over the stock and fall to 0 at the edges of the
    board."""
    parts = []
    for count in stage.heights.shape:
        edge = np.minimum(np.arange(count), np.arange(count)[::-1]).astype(np.float32)
        parts.append(np.clip(edge / np.float32(max(stage.margin, 1)), 0.0, 1.0))
    return np.asarray(np.minimum(parts[0][:, None], parts[1][None, :]))


def _enlarged(thin: Heights, step: int, shape: tuple[int, ...]) -> Heights:
    """Return the array enlarged to `shape` by linear interpolation; `step` is the distance of its
    cells in the result."""
    for axis in (0, 1):
        place = np.arange(shape[axis], dtype=np.float32) / np.float32(step)
        low = np.minimum(place.astype(np.int64), thin.shape[axis] - 1)
        high = np.minimum(low + 1, thin.shape[axis] - 1)
        part = (place - low).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        thin = thin.take(low, axis) * (1.0 - part) + thin.take(high, axis) * part
    return np.asarray(thin, dtype=np.float32)


def png_of(pixels: Octets) -> bytes:
    """Return pixels (H, W, 3) encoded as a PNG."""
    high, wide, _ = pixels.shape
    rows = np.zeros((high, 1 + 3 * wide), dtype=np.uint8)
    # Each row as differences from the row above (filter 2 of the format): half as many bytes.
    rows[:, 0] = 2
    flat_rows = pixels.reshape(high, -1)
    rows[0, 1:] = flat_rows[0]
    rows[1:, 1:] = flat_rows[1:] - flat_rows[:-1]
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", wide, high, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows.tobytes(), 6)),
        (b"IEND", b""),
    ]
    chunks = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in parts
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def data_uri(png: bytes) -> str:
    """Return a PNG as a data URI, to be embedded in SVG."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
