"""Pictures of pixels: their dark shapes as contours, or the centre lines of these.

    file ──pixels──▶ darkness ──outline──▶ lines at the threshold, without specks
                                             ├──strokes──▶ contours
                              dark ──centre──┴──strokes──▶ centre lines

How large a picture is must be said: its pixels have no size of their own, and what the file claims
of it counts only where that is asked for."""

from __future__ import annotations

import numpy as np

from camtool.arrays import Bools, Floats
from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing, Skipped, Units
from camtool.importers.assemble import assemble
from camtool.importers.bitmap.centre import centre_lines
from camtool.importers.bitmap.outline import crossings, enclosed_area, outlines
from camtool.importers.bitmap.pixels import Ink, PixelPicture, is_square, picture
from camtool.importers.bitmap.strokes import PixelStrokes, strokes
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece
from camtool.units import MM_PER_UNIT

MAX_POINTS = 200_000
"""Contours with more points in all (one between each two neighbouring pixels) are noise, not a
drawing."""

CENTRE_PX = 0.5
"""Centre lines may be off their pixels by this much more than contours off theirs."""

MIN_DARKNESS_RANGE = 0.05
"""A picture whose pixels differ by less in darkness has a single tone."""

BINS = 256


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """Return the Drawing of a PNG or JPEG; DrawingError for one that is broken or shows
    nothing, and for one whose size nothing says."""
    pixels = picture(data, file)
    units = _units(pixels, file, options)
    ink = np.float32(1.0) - pixels.ink if options.invert else pixels.ink
    _check_tones(ink, options, file)
    if crossings(ink, options.threshold) > 10 * MAX_POINTS:
        raise _too_noisy(file)
    lines = outlines(ink, options.threshold)
    areas = np.array([enclosed_area(line) for line in lines])
    shapes = [
        line for line, area in zip(lines, areas, strict=True) if _is_large_enough(area, options)
    ]
    if sum(map(len, shapes)) > MAX_POINTS:
        raise _too_noisy(file)
    skipped = _skipped("speck", len(lines) - len(shapes), f"under {options.speckle_px:g} pixels")
    limit = max(options.smooth_px, options.tolerance_mm / units.mm_per_unit)
    if options.trace == "outline":
        shapes_and_rings = [(strokes(line, limit, closed=True), True) for line in shapes]
    else:
        specks = [
            (abs(area), area < 0.0, line)
            for line, area in zip(lines, areas.tolist(), strict=True)
            if not _is_large_enough(area, options)
        ]
        specks.sort(key=lambda speck: speck[0])
        dark = ink >= options.threshold
        for _, hole, line in specks:
            _fill(dark, line, hole)
        paths, dots = centre_lines(dark)
        shapes_and_rings = [
            (strokes(path, limit + CENTRE_PX, closed=ring), ring) for path, ring in paths
        ]
        skipped += _skipped("dot", dots, "has no centre line: read it with --trace outline")
    return assemble(
        [
            _piece(each, closed, number, options.trace, units.mm_per_unit)
            for number, (each, closed) in enumerate(shapes_and_rings, start=1)
        ],
        file=file,
        units=units,
        used={options.trace: len(shapes_and_rings)},
        skipped=skipped,
        options=options,
    )


def _units(pixels: PixelPicture, file: str, options: ReadOptions) -> Units:
    """Return the size of a pixel as a unit; DrawingError if no option gives it, or more than
    one."""
    width = pixels.ink.shape[1]
    if options.units is not None:
        raise DrawingError(
            "has no numbers that --units could be of",
            file=file,
            mend="give its width, --width 60mm, or --dpi 300",
        )
    size_options = [options.width_mm is not None, options.dpi is not None, options.own_dpi]
    if sum(size_options) > 1:
        raise DrawingError(
            "is given more than one size", file=file, mend="give --width, --dpi or --own-dpi alone"
        )
    if options.width_mm is not None:
        size = options.width_mm / width
        return Units("px", size, f"{width} pixels are {options.width_mm:g} mm wide, as asked")
    if options.dpi is not None:
        return Units("px", options.mm_per("px"), f"{options.dpi:g} pixels an inch, as asked")
    claim = ""
    if pixels.dpi is not None:
        claim = f"; the file itself says {pixels.dpi[0]:.6g} dpi: --own-dpi"
    if not options.own_dpi:
        raise DrawingError(
            f"is a picture of {width} x {pixels.ink.shape[0]} pixels, which have no size",
            file=file,
            mend=f"say how wide it is, --width 60mm, or --dpi 300{claim}",
        )
    if pixels.dpi is None or not is_square(pixels.dpi):
        complaint = "says no" if pixels.dpi is None else "says two different"
        raise DrawingError(
            f"{complaint} pixels an inch", file=file, mend="give --width 60mm or --dpi 300"
        )
    return Units("px", MM_PER_UNIT["in"] / pixels.dpi[0], f"{pixels.dpi[0]:.6g} pixels an inch")


def _check_tones(ink: Ink, options: ReadOptions, file: str) -> None:
    """Raise DrawingError where no pixel, or every one, is dark."""
    lightest, darkest = float(ink.min()), float(ink.max())
    if lightest < options.threshold <= darkest:
        return
    tone = "darker" if lightest >= options.threshold else "lighter"
    if darkest - lightest < MIN_DARKNESS_RANGE:
        mend = "it is of one tone: nothing in it can be told from the rest"
    else:
        other = "" if options.invert else ", or --invert where light lines are on dark"
        mend = f"--threshold {_otsu_threshold(ink):.2f} lies between its tones{other}"
    raise DrawingError(
        f"is {tone} than the threshold {options.threshold:g} everywhere "
        f"(it is between {lightest:.2f} and {darkest:.2f} dark)",
        file=file,
        mend=mend,
    )


def _otsu_threshold(ink: Ink) -> float:
    """Return the darkness that best divides the pixels into two classes (Otsu 1979: their means
    differ most)."""
    counts, edges = np.histogram(ink, BINS, (0.0, 1.0))
    tones = 0.5 * (edges[1:] + edges[:-1])
    below, sums = np.cumsum(counts), np.cumsum(counts * tones)
    above = below[-1] - below
    is_divided = (below > 0) & (above > 0)
    mean_gap = (
        sums[is_divided] / below[is_divided] - (sums[-1] - sums[is_divided]) / above[is_divided]
    )
    spread = below[is_divided] * above[is_divided] * mean_gap**2
    best = edges[1:][is_divided][spread >= spread.max() * (1.0 - 1e-9)]
    return float(best.mean())


def _is_large_enough(area: float, options: ReadOptions) -> bool:
    """Return True if a contour that encloses this area, pixels, is large enough to be drawn."""
    return abs(area) >= options.speckle_px


def _fill(dark: Bools, line: Floats, hole: bool) -> None:
    """Set the pixels within a small line, in place: dark if it is a `hole`, else light."""
    height = len(dark)
    low, high = np.floor(line.min(axis=0)).astype(int), np.ceil(line.max(axis=0)).astype(int)
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    inside = np.zeros(x.shape, dtype=np.bool_)
    for (ax, ay), (bx, y2) in zip(line, np.roll(line, -1, axis=0), strict=True):
        if ay != y2:
            inside ^= ((ay > y) != (y2 > y)) & (x < ax + (y - ay) * (bx - ax) / (y2 - ay))
    rows, columns = height - 1 - np.floor(y[inside]).astype(int), np.floor(x[inside]).astype(int)
    dark[rows, columns] = hole


def _piece(stroke: PixelStrokes, closed: bool, number: int, trace: str, mm_per_px: float) -> Piece:
    vertices = stroke.vertices * [mm_per_px, mm_per_px, 1.0]
    return Piece(vertices, closed, trace, "", f"{trace} {number}", off_mm=stroke.off * mm_per_px)


def _skipped(kind: str, count: int, reason: str) -> list[Skipped]:
    return [Skipped(kind, count, reason)] if count else []


def _too_noisy(file: str) -> DrawingError:
    return DrawingError(
        f"has more than {MAX_POINTS} pixels on edges: it is too rough to trace",
        file=file,
        mend="scale it down or blur it, give another --threshold, or a larger --speckle",
    )
