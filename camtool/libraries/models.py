"""Shapes and builders of build123d, outlined as the model of a file is, in this process."""

from __future__ import annotations

from typing import Any

from camtool.errors import DrawingError, OptionError
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.assemble import Found
from camtool.importers.options import ReadOptions
from camtool.importers.solid.bodies import Body, shape_bodies, shapes_in
from camtool.importers.solid.reader import found_in, script_unit
from camtool.importers.solid.worker import outlines_of


def read(value: Any, name: str, options: ReadOptions) -> Found:
    """Return the outlines of sketches and faces, the highest level faces of parts, or their
    section at `options.section_z_mm`. DrawingError where OpenCASCADE fails, OptionError for other
    objects of build123d."""
    try:
        shapes = shapes_in(value)
    except TypeError as error:
        raise OptionError(
            f"{name} is of type {error} of build123d, and no shape",
            mend="give a sketch, face, wire, edge, part or builder",
        ) from error
    unit = script_unit()
    scale = unit.scale(options, name)
    height = None if options.section_z_mm is None else options.section_z_mm / scale

    def bodies() -> list[Body]:
        parts = [body for shape in shapes for body in shape_bodies(shape)]
        if not parts:
            raise DrawingError("is empty", mend="give a shape with edges")
        return parts

    tolerance = max(options.tolerance_mm / scale, POSITION_EPS_MM)
    try:
        answer = outlines_of(bodies, height, tolerance, script=True)
    except DrawingError as error:
        error.file = error.file or name
        raise
    return found_in(answer | {"complaint": ""}, unit.why, scale, options)
