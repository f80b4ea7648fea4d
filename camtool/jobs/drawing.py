"""The drawing that a job is for: read as finely as the part needs, of the layers that are cut.

A layer or colour of an operation that chooses nothing is an error that names what there is: a
misspelt layer must not leave a part of the work undone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

from camtool.errors import OptionError
from camtool.importers.options import Selection
from camtool.importers.pieces import NAMED, NoMatchError
from camtool.patterns import guess, matches
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.importers.options import ReadOptions
    from camtool.planning.job import Job, Operation


MAX_LOOKS = 4
"""A drawing whose scale follows from its own size is read at most this many times; each reading
gives the size to within the tolerance of the reading before."""


def read_for_job(
    read: Callable[[ReadOptions], Drawing], options: ReadOptions, job: Job
) -> Drawing:
    """Return the drawing that `read` gives, of the layers that the job's operations take, in all
    set-ups of the part, or of those that `options` select. OptionError for a layer or colour of
    the job that the drawing has not, unless `options` select some."""
    job = job.whole
    selection, wanted_layers = options.select, layers_of(job)
    options = replace(options, select=replace(selection, layers=selection.layers or wanted_layers))
    try:
        drawing = read_to_scale(read, options, job)
    except NoMatchError as error:
        if selection.layers or error.pattern not in wanted_layers:
            raise
        raise _unmatched(error, job) from error
    if not (selection.layers or selection.exclude_layers or selection.colours):
        refuse_unmatched(drawing, job)
    return drawing


def read_to_scale(
    read: Callable[[ReadOptions], Drawing], options: ReadOptions, job: Job
) -> Drawing:
    """Read a drawing at the scale of the job. If the job fits the drawing into a size, the scale
    is computed from the drawing, which is read again until its scale and the fit agree; at first
    only for its box, where the job takes all of it."""
    if job.placement.fit_mm is None:
        return read(replace(options, scale=job.placement.scale))
    from camtool.planning.place import SCALE_SHARE, part_scale

    box_only = _takes_all(job, options)
    drawing = read(replace(options, scale=1.0, box_only=box_only))
    for _ in range(MAX_LOOKS - 1):
        scale = made_for = drawing.made_for
        with suppress(OptionError):  # planning reports it, with its place in the job
            scale = part_scale(drawing, job)
        if abs(scale - made_for) <= SCALE_SHARE * made_for:
            if not box_only:
                return drawing
            scale = made_for
        drawing, box_only = read(replace(options, scale=scale)), False
    return drawing


def _takes_all(job: Job, options: ReadOptions) -> bool:
    """Return True if the job takes all that is drawn, and the box of that is parallel to the axes
    of the drawing."""
    quarters = job.placement.rotate_rad / (0.5 * math.pi)
    return (
        options.select == Selection()
        and quarters == round(quarters)
        and not any(operation.layers or operation.colours for operation in job.operations)
    )


def layers_of(job: Job) -> tuple[str, ...]:
    """Return the layer patterns of all operations, to read only those layers; () if an operation
    takes any layer."""
    if not all(operation.layers for operation in job.operations):
        return ()
    return tuple(dict.fromkeys(p for operation in job.operations for p in operation.layers))


def refuse_unmatched(drawing: Drawing, job: Job) -> None:
    """Raise OptionError for a layer or colour pattern of an operation that matches no path and no
    mark of the drawing."""
    layers = {*drawing.layers, *(mark.layer for mark in drawing.marks)}
    colours = {*drawing.colours, *(mark.colour for mark in drawing.marks)}
    for number, operation in enumerate(job.operations, start=1):
        for subject, patterns, names in (
            ("layer", operation.layers, layers),
            ("colour", operation.colours, colours),
        ):
            for pattern in patterns:
                if not any(matches((pattern,), name) for name in names):
                    raise OptionError(
                        f"no {subject} matches {pattern!r}",
                        file=drawing.file,
                        where=f"{_name_words(operation, number)}key {subject}s",
                        mend=f"{guess(pattern, names)}it has {_listed(names)}",
                    )


def _unmatched(error: NoMatchError, job: Job) -> OptionError:
    """Return the error for a layer pattern that matches nothing, with the operation that
    names it."""
    rows = enumerate(job.operations, start=1)
    operation_place = next(
        _name_words(each, n) for n, each in rows if error.pattern in each.layers
    )
    return OptionError(
        error.message, file=error.file, where=f"{operation_place}key layers", mend=error.mend
    )


def _name_words(operation: Operation, number: int) -> str:
    return f"operation {number} {operation.name!r}, " if operation.name else ""


def _listed(names_known: Iterable[str]) -> str:
    names = sorted(name or '""' for name in names_known)
    return (", ".join(names[:NAMED]) + (" …" if len(names) > NAMED else "")) or "none"
