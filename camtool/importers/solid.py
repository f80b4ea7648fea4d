"""Solid models through build123d: STEP and BREP files, and build123d scripts.

A model becomes a drawing in one of two ways:

    as it comes           the outlines of the highest level face of each solid
    options.section_z_mm  the section of all solids by the plane at that height

A sketch gives the outlines of all its faces, a bare wire gives itself. Lines and circular arcs
stay exact; ellipses, splines and all other curves are fitted within the tolerance.

A script is a program with all the rights of its user: it is run only when the caller allows it.
"""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from camtool.errors import DrawingError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.fit import Fit, overall
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.assemble import Piece, assemble
from camtool.importers.options import ReadOptions
from camtool.importers.read_format import is_brep, is_step, text_head

if TYPE_CHECKING:
    from camtool.importers.solid_outline import Outline
    from camtool.importers.solid_shapes import Model


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing of a solid model; DrawingError when it cannot be read, or is not cut."""
    model = _model(data, file, options)
    from camtool.importers.solid_outline import outlines
    from camtool.importers.solid_shapes import quiet

    scale = model.scale(options, file)
    height = None if options.section_z_mm is None else options.section_z_mm / scale
    tolerance = max(options.tolerance_mm / scale, POSITION_EPS_MM)
    with quiet():
        found = outlines(model.bodies, height, tolerance, file)
    pieces: list[Piece] = []
    fits: list[Fit] = []
    for outline in found.outlines:
        for number, path in enumerate(outline.paths, start=1):
            vertices = path.vertices * np.array([scale, scale, 1.0])
            source = f"{outline.kind} {outline.number} wire {number}"
            pieces.append(Piece(vertices, path.closed, outline.layer, outline.colour, source))
            fits.extend(path.fits)
    return assemble(
        pieces,
        file=file,
        units=_units(model, options),
        fit=overall(fits),
        used=_used(found.outlines),
        skipped=[*model.skipped, *found.skipped],
        findings=[*model.findings, *_chosen(found.levels, found.span, scale, height)],
        options=options,
    )


def _model(data: bytes, file: str, options: ReadOptions) -> Model:
    """The shapes in the file, by what its content is."""
    suffix = PurePath(file).suffix.lower()
    head = text_head(data)
    if is_step(head):
        from camtool.importers.solid_load import load_step

        return load_step(data, file)
    if is_brep(head):
        from camtool.importers.solid_load import load_brep

        return load_brep(data, file)
    if suffix in (".step", ".stp", ".brep", ".brp") or "\x00" in head or "\ufffd" in head:
        raise DrawingError(
            "is neither STEP nor BREP", file=file, mend="export it again as STEP (AP214 or AP242)"
        )
    if not options.allow_scripts:
        raise DrawingError(
            "is a script: a program that runs with all your rights",
            file=file,
            mend="read it, and if you trust it give --allow-scripts",
        )
    from camtool.importers.solid_script import run_script

    return run_script(data, file)


def _units(model: Model, options: ReadOptions) -> Units:
    if options.units is not None:
        return Units(options.units.lower(), options.mm_per(options.units), "as asked")
    return Units("mm", 1.0, model.why)


def _used(outlines: list[Outline]) -> dict[str, int]:
    """How many outlines of each kind."""
    counts: dict[str, int] = {}
    for outline in outlines:
        counts[outline.kind] = counts.get(outline.kind, 0) + 1
    return counts


def _chosen(
    levels: list[float], span: tuple[float, float], scale: float, height: float | None
) -> list[Finding]:
    """SECTION_CHOSEN: what was taken, at which height, and how high the model is."""
    if not levels:
        return []
    low, high = scale * min(levels), scale * max(levels)
    place = f"z = {low:.6g}" if high - low <= POSITION_EPS_MM else f"z = {low:.6g} to {high:.6g}"
    what = "the section" if height is not None else "the highest level face of each solid"
    return [
        Finding(
            Code.SECTION_CHOSEN,
            Severity.INFO,
            f"{what} at {place} mm is drawn; the model spans z = {scale * span[0]:.6g} to "
            f"{scale * span[1]:.6g} mm; --section-z chooses another height",
            measured=high,
            unit="mm",
        )
    ]
