"""What is read from files: drawings, jobs, programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack

from camtool.api.machines import as_target
from camtool.errors import ProgramError
from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.machine.registry import LoadedTarget
from camtool.planning.job import Job
from camtool.results import Drawing, extended
from camtool.toolpath.program import Program
from camtool.units import parse_length

BYTES = "<bytes>"
"""What messages call a program that was given as bytes."""


class Reading(TypedDict, total=False):
    """How a drawing is read: the fields of `camtool.importers.ReadOptions`, and of its
    `Selection` (patterns of layers, colours and line types; none takes all)."""

    units: str | None
    tolerance_mm: float
    gap_mm: float
    scale: float
    dpi: float | None
    format: str | None
    chain_gaps: bool
    across_layers: bool
    text: str
    recognise_arcs: bool
    layout: str | None
    dimensions: bool
    section_z_mm: float | None
    allow_scripts: bool
    layers: Sequence[str]
    exclude_layers: Sequence[str]
    colours: Sequence[str]
    line_types: Sequence[str]


_SELECTION = ("layers", "exclude_layers", "colours", "line_types")
_LENGTHS = ("tolerance_mm", "gap_mm", "section_z_mm")


def _patterns(given: str | Sequence[str]) -> tuple[str, ...]:
    """Several patterns, or one as it is."""
    return (given,) if isinstance(given, str) else tuple(given)


def read_drawing(
    file: str | Path, *, target: str | LoadedTarget | None = None, **reading: Unpack[Reading]
) -> Drawing:
    """The drawing in a DXF, SVG, point list, STEP file or build123d script; mm, Y up.

    `paths` holds M contours of lines and arcs in columns: `vertices` (N, 3) of x, y mm and bulge,
    `offsets` (M+1,), `closed` (M,); `layers`, `colours` and `sources` have M items each. Lines
    and arcs are exact, other curves become arcs within `tolerance_mm`: that of the `target` if
    one is given. Tolerances are of the part: give its `scale` where a job scales it. Raises
    DrawingError, and OptionError for a way of reading that cannot be. Source: docs/formats.md.
    """
    from camtool.importers.options import ReadOptions, Selection
    from camtool.importers.pieces import colour_named
    from camtool.importers.read import read_drawing as read

    settings: dict[str, Any] = {}
    if target is not None:
        defaults = as_target(target).machine.defaults
        settings = {"tolerance_mm": defaults.fit_tolerance_mm, "gap_mm": defaults.gap_mm}
    settings.update(reading)
    for key in _LENGTHS:
        if isinstance(settings.get(key), str):
            settings[key] = parse_length(settings[key], name=key)
    chosen = {key: _patterns(settings.pop(key, ())) for key in _SELECTION}
    chosen["colours"] = tuple(colour_named(colour) for colour in chosen["colours"])
    options = ReadOptions(**settings, select=Selection(**chosen))
    return extended(Drawing, read(Path(file), options=options))


def read_job(
    file: str | Path,
    *,
    operations: Sequence[str] = (),
    drawing: DrawingRecord | str | Path | None = None,
    target: str | LoadedTarget | None = None,
) -> Job:
    """The job that a TOML file says: tools, operations in order, placement, stock; mm, rad, s,
    mm/min.

    `operations`: only those, by name or number. Layers and colours that the `drawing` has not are
    refused, where one is given; its file is read as finely as the `target` needs. Raises
    OptionError, which names file, table, key and mend. Source: docs/jobs.md.
    """
    from camtool.jobs.build import job_of_file
    from camtool.jobs.drawing import refuse_unmatched

    job = job_of_file(Path(file), _patterns(operations))
    if isinstance(drawing, DrawingRecord):
        refuse_unmatched(drawing, job)
    elif drawing is not None:
        as_drawing(drawing, target, job)
    return job


def as_drawing(
    drawing: DrawingRecord | str | Path, target: str | LoadedTarget | None, job: Job
) -> DrawingRecord:
    """The drawing, or what is in its file on the layers that the job's operations take."""
    from camtool.importers.pieces import NoMatchError
    from camtool.jobs.drawing import layers_of, read_to_scale, refuse_unmatched, unmatched

    if isinstance(drawing, DrawingRecord):
        return drawing
    try:
        read = read_to_scale(
            lambda scale: read_drawing(drawing, target=target, layers=layers_of(job), scale=scale),
            job,
        )
    except NoMatchError as error:
        raise unmatched(error, job) from error
    refuse_unmatched(read, job)
    return read


def as_bytes(program: bytes | Program | str | Path) -> tuple[bytes, str]:
    """The program and what messages call it; ProgramError when its file cannot be read."""
    if isinstance(program, bytes):
        return program, BYTES
    if isinstance(program, Program):
        return program.data, BYTES
    try:
        return Path(program).read_bytes(), str(program)
    except OSError as error:
        raise ProgramError(
            f"cannot be read ({error.strerror})", file=str(program), mend="check the path"
        ) from error
