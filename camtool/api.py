"""The house from Python: what the commands do, as functions on values.

`import camtool` gives all of it. Values go from one call to the next; none of these calls writes
a file. Lengths are mm, angles rad, feeds mm/min, errors of reports µm. Whatever a user can do
wrong raises a CamtoolError with one line that says what, where, and how to mend it; what is wrong
with a part is no exception but a finding in the result.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from camtool.errors import CamtoolError, MachineError, ProgramError
from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.machine.registry import ListedTarget, LoadedTarget, list_target, target_names
from camtool.pipeline import Judging
from camtool.pipeline.judge import Posted as PostedRecord
from camtool.planning.job import Job, Operation, Placement, Tool, job_of
from camtool.results import Drawing, Picture, Posted, Toolpath, Verification, extended
from camtool.toolpath.moves import Toolpath as ToolpathRecord
from camtool.toolpath.program import Program

if TYPE_CHECKING:
    from camtool.verify.gates import Gates

__all__ = [
    "CamtoolError",
    "Drawing",
    "Job",
    "Judging",
    "ListedTarget",
    "LoadedTarget",
    "Looks",
    "Operation",
    "Picture",
    "Placement",
    "Posted",
    "Reading",
    "Tool",
    "Toolpath",
    "Verification",
    "job_of",
    "load_target",
    "plan",
    "post",
    "preview",
    "read_drawing",
    "targets",
    "verify",
]

BYTES = "<bytes>"
"""What messages call a program that was given as bytes."""


class Reading(TypedDict, total=False):
    """How a drawing is read: the fields of `camtool.importers.ReadOptions`, and of its
    `Selection` (patterns of layers, colours and line types; none takes all)."""

    units: str | None
    tolerance_mm: float
    gap_mm: float
    dpi: float
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


class Looks(TypedDict, total=False):
    """How a picture looks: the fields of `camtool.preview.options.Options`. `size_px` is its
    width, `crop_mm` the part (x, y, width, height) that it shows, `exaggerate` how many times as
    far from the wanted path the predicted one is drawn, `layers` the names of those to show,
    `polar` the circle, from 1, of which the radial errors are plotted instead."""

    size_px: int | None
    crop_mm: tuple[float, float, float, float] | None
    dark: bool
    exaggerate: float
    layers: frozenset[str]
    polar: int | None


_SELECTION = ("layers", "exclude_layers", "colours", "line_types")


def targets() -> list[ListedTarget]:
    """The machines that camtool knows, by name: title, extension, and what a machine file must
    still say of them. A plug-in that cannot be loaded is left out with a warning."""
    found = []
    for name in target_names():
        try:
            found.append(list_target(name))
        except MachineError as error:
            warnings.warn(str(error), stacklevel=2)
    return found


def load_target(
    name: str,
    *,
    machine: str | Path | None = None,
    settings: Mapping[str, Any] | Sequence[str] = (),
) -> LoadedTarget:
    """The target `name`, with a user's `machine` file and `settings` over it.

    `settings`: {"axes.x.backlash_mm": 0.2}, or as `--set` takes them. Units are those that the
    keys end on. Raises UnknownTargetError (with the nearest names) and MachineError.
    """
    from camtool.machine.registry import load_target as loaded

    if isinstance(settings, Mapping):
        settings = [f"{key}={_as_toml(value)}" for key, value in settings.items()]
    file = None if machine is None else Path(machine)
    return loaded(name, machine_file=file, settings=settings)


def read_drawing(
    file: str | Path, *, target: str | LoadedTarget | None = None, **reading: Unpack[Reading]
) -> Drawing:
    """The drawing in a DXF, SVG, point list, STEP file or build123d script; mm, Y up.

    `paths` holds M contours of lines and arcs in columns: `vertices` (N, 3) of x, y mm and bulge,
    `offsets` (M+1,), `closed` (M,); `layers`, `colours` and `sources` have M items each. Lines
    and arcs are exact, other curves become arcs within `tolerance_mm`: that of the `target` if one
    is given. Raises DrawingError, and OptionError for a way of reading that cannot be. Source:
    docs/formats.md.
    """
    from camtool.importers.options import ReadOptions, Selection
    from camtool.importers.read import read_drawing as read
    from camtool.importers.select import colour_named

    settings: dict[str, Any] = {}
    if target is not None:
        defaults = _target(target).machine.defaults
        settings = {"tolerance_mm": defaults.fit_tolerance_mm, "gap_mm": defaults.gap_mm}
    settings.update(reading)
    chosen = {key: tuple(settings.pop(key, ())) for key in _SELECTION}
    chosen["colours"] = tuple(colour_named(colour) for colour in chosen["colours"])
    options = ReadOptions(**settings, select=Selection(**chosen))
    return extended(Drawing, read(Path(file), options=options))


def plan(
    drawing: DrawingRecord | str | Path, target: str | LoadedTarget, job: Job | None = None
) -> Toolpath:
    """The moves that cut the drawing: work frame, mm, mm/min, in order of execution.

    N rows in columns: `kind` (N,), `end` (N, 3), `centre` (N, 2), `feed` (N,). Without a job, all
    lines are followed with a tool of no width; `job_of(tool_diameter_mm=0.2, side="auto")` makes
    a simple one. Raises OptionError for what the job asks and the drawing or the machine cannot
    give. Source: docs/toolpaths.md.
    """
    from camtool.planning.plan import plan as planned

    loaded = _target(target)
    read, wanted = _drawing(drawing, loaded), job or Job()
    made = planned(read, wanted, loaded.machine)
    return extended(Toolpath, made, drawing=read, job=wanted, target=loaded)


def post(
    drawing: DrawingRecord | str | Path,
    target: str | LoadedTarget,
    job: Job | None = None,
    *,
    check: bool = True,
    compensate: bool = False,
    gates: Gates | None = None,
) -> Posted:
    """The drawing as a program of the target, read back, simulated and judged.

    `data` are the program's bytes, `verification` the verdict (None with `check=False`),
    `findings` those of all stages. `compensate` bends the path against play, scale and
    squareness; `gates` are limits whose excess is a finding. Raises OptionError, and PostError
    for what the machine or its dialect cannot do. Source: docs/verifying.md.
    """
    from camtool.pipeline import post_drawing

    loaded = _target(target)
    read, wanted = _drawing(drawing, loaded), job or Job()
    made = post_drawing(read, wanted, loaded, check=check, compensate=compensate, gates=gates)
    verdict = None
    if made.verification is not None and made.decoded is not None:
        verdict = extended(
            Verification,
            made.verification,
            data=b"" if made.program is None else made.program.data,
            decoded=made.decoded,
            target=loaded,
            drawing=read,
            job=wanted,
        )
    context = {"drawing": read, "job": wanted, "target": loaded}
    return extended(Posted, made, verification=verdict, **context)


def verify(
    program: bytes | Program | str | Path,
    target: str | LoadedTarget,
    *,
    against: DrawingRecord | str | Path | None = None,
    job: Job | None = None,
    judging: Judging | None = None,
) -> Verification:
    """Any program of the target, run by a model of its controller and mechanics, and judged.

    `program`: its bytes, or the file they are in. With `against`, the slides' path is compared
    with that drawing, planned with `job`. `report` holds errors in µm, sizes in mm, times in s.
    Raises ProgramError with block and column, and OptionError. Source: docs/verifying.md.
    """
    from camtool.pipeline import verify_program

    loaded = _target(target)
    data, source = _bytes(program)
    read = None if against is None else _drawing(against, loaded)
    decoded, found = verify_program(
        data, loaded, source=source, drawing=read, job=job, judging=judging
    )
    context = {"target": loaded, "drawing": read, "job": job or Job()}
    return extended(Verification, found, data=data, decoded=decoded, **context)


def preview(
    what: DrawingRecord | ToolpathRecord | PostedRecord | Verification,
    **looks: Unpack[Looks],
) -> Picture:
    """The picture of what any of these calls gave: the drawing, its toolpath, or the path that
    the slides are predicted to take, coloured by its error (µm, with scale).

    Raises OptionError for looks that make no picture. Source: docs/viewer.md, docs/overview.md.
    """
    from camtool.preview.options import Options

    return Picture(_shown(what)._scene(), Options(**looks))


def _shown(what: Any) -> Drawing | Toolpath | Posted | Verification:
    """The value, as one that has a picture."""
    if isinstance(what, Drawing | Toolpath | Posted | Verification):
        return what
    if isinstance(what, DrawingRecord):
        return extended(Drawing, what)
    if isinstance(what, ToolpathRecord):
        return extended(Toolpath, what)
    if isinstance(what, PostedRecord):
        return extended(Toolpath, what.decoded or what.wanted)
    raise TypeError(f"{type(what).__name__} has no picture")


def _target(target: str | LoadedTarget) -> LoadedTarget:
    return load_target(target) if isinstance(target, str) else target


def _drawing(drawing: DrawingRecord | str | Path, target: LoadedTarget) -> DrawingRecord:
    if isinstance(drawing, DrawingRecord):
        return drawing
    return read_drawing(drawing, target=target)


def _bytes(program: bytes | Program | str | Path) -> tuple[bytes, str]:
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


def _as_toml(value: Any) -> str:
    """A value as `--set` takes it."""
    import json

    return json.dumps(value, ensure_ascii=False)
