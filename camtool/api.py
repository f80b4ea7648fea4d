"""The Python API: what the commands do, as functions on values.

`import camtool` provides all of it. The result of one call is passed to the next; none of these
calls writes a file. Lengths are mm, angles rad, feeds mm/min, errors of reports µm. A mistake of
the caller raises a CamtoolError with one line that says what is wrong, where, and how to correct
it; what is wrong with a part is a finding in the result, not an exception."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict, Unpack

import numpy as np

from camtool.bounds import program_bytes
from camtool.calibration.calibrate import Calibration, to_text
from camtool.calibration.calibrate import calibrate as calibrated
from camtool.calibration.machine_file import machine_file
from camtool.calibration.measurements import Measurements, read_measurements
from camtool.comparison import Comparison, ProgramVariant, compare_program, variants_of
from camtool.errors import CamtoolError, OptionError
from camtool.geometry.drawing import Drawing
from camtool.geometry.facts import facts_of
from camtool.geometry.nesting import Nesting, oriented
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polylines
from camtool.importers.options import Reading, ReadOptions, options_of
from camtool.importers.read import content, read_bytes
from camtool.jobs.build import JobTables, job_of_file, read_job_file
from camtool.jobs.drawing import read_for_job, refuse_unmatched
from camtool.jobs.keys import field_value
from camtool.jobs.tools import Shop
from camtool.libraries.read import is_path, path_of, read_objects
from camtool.pictures.options import PictureOptions
from camtool.pictures.picture import Picture
from camtool.pictures.scene import Scene
from camtool.pipeline import Judging, convert_program, post_drawing, verify_program
from camtool.pipeline import post_by_setup as by_setup
from camtool.pipeline import post_by_tool as by_tool
from camtool.planning.job import Job, Operation, Placement, Stock, Tool
from camtool.planning.job import job_of as made
from camtool.records import replace
from camtool.run import Run, Shown, ShownDrawing, ShownToolpath
from camtool.simulation.motion import Effects
from camtool.stock.cut import CutStock
from camtool.stock.cut import cut_stock as stock_after
from camtool.tables import read_table
from camtool.target.loader import extended_by
from camtool.target.registry import ListedTarget, LoadedTarget, each_target, list_target
from camtool.target.registry import load_target as loaded
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.program import Program
from camtool.verification.report import Gates
from camtool.verification.verify import Verification
from camtool.waveforms.signals import Signals

if TYPE_CHECKING:
    from camtool.inspection.meet import Meeting
    from camtool.machine.model import Machine


__all__ = [
    "Calibration",
    "CamtoolError",
    "Comparison",
    "CutStock",
    "Drawing",
    "Effects",
    "Gates",
    "Job",
    "Judging",
    "ListedTarget",
    "LoadedTarget",
    "Looks",
    "Operation",
    "Picture",
    "Placement",
    "Reading",
    "Run",
    "Signals",
    "Stock",
    "Tool",
    "Toolpath",
    "Verification",
    "calibrate",
    "check",
    "compare",
    "convert",
    "cut_stock",
    "inspect",
    "job_of",
    "load_target",
    "meet",
    "offset",
    "plan",
    "post",
    "post_by_setup",
    "post_by_tool",
    "preview",
    "read_drawing",
    "read_job",
    "signals",
    "targets",
    "verify",
]


# Drawings, jobs and programs from files.

BYTES = "<bytes>"
"""The name in messages for a program that was given as bytes."""


def _patterns(patterns: str | Sequence[str]) -> tuple[str, ...]:
    """Return the patterns as a tuple; a single text counts as one pattern."""
    return (patterns,) if isinstance(patterns, str) else tuple(patterns)


Drawable: TypeAlias = Any
"""A Drawing; the path of a file; an object of ezdxf (document, layout), shapely, svgpathtools,
numpy ((N, 2) points, (N, 3) with bulges) or build123d (sketch, face, part, builder); a list of
such objects, or {layer: objects}. Objects count in mm if they have no unit of their own, or in the
`units` that `read_drawing` is given (docs/python.md)."""


def read_drawing(
    drawing: Drawable, *, target: str | LoadedTarget | None = None, **reading: Unpack[Reading]
) -> ShownDrawing:
    """Return the drawing in a DXF, SVG, point list, STEP file, build123d script, PNG or JPEG, or
    of objects of other libraries (`Drawable`); mm, Y up.

    `paths` holds M contours of lines and arcs in columns: `vertices` (N, 3) of x, y mm and bulge,
    `offsets` (M+1,), `closed` (M,); `layers`, `colours` and `sources` have M items each. Lines
    and arcs are exact; other curves become arcs within `tolerance_mm`, by default that of the
    `target` if one is given. Tolerances apply to the part: give its `scale` where a job scales it.
    Raises DrawingError, and OptionError for options that cannot be. Source: docs/formats.md."""
    options = options_of(reading, _machine_of(target))
    if isinstance(drawing, Drawing):
        raise OptionError("drawing is read already", mend="pass it on, or read its source anew")
    return ShownDrawing.of(_reader_of(drawing)(options))


def check(
    drawing: Drawable, *, target: str | LoadedTarget | None = None, **reading: Unpack[Reading]
) -> dict[str, Any]:
    """Return the facts about a drawing that `camtool check --json` writes: unit, size, layers, the
    smallest features, open ends, repairs and findings; mm.

    Options are those of `read_drawing`, and none for a drawing that is read already. Raises as
    `read_drawing` does. Source: docs/formats.md."""
    if isinstance(drawing, Drawing) and not reading and target is None:
        return facts_of(drawing)
    return facts_of(read_drawing(drawing, target=target, **reading))


def read_job(
    file: str | Path,
    *,
    operations: Sequence[str] = (),
    drawing: Drawable | None = None,
    target: str | LoadedTarget | None = None,
    libraries: Sequence[str | Path] = (),
) -> Job:
    """Return the job in a TOML file: tools, operations in order, placement, stock; mm, rad, s,
    mm/min.

    `operations`: only those, by name or number. With a `drawing`, layers and colours that it lacks
    are refused; its file is read as finely as the `target` needs. `libraries`: files of tools that
    the job may name, the nearest first. Raises OptionError, which names
    file, table, key and the correction. Source: docs/jobs.md."""
    job = job_of_file(Path(file), _patterns(operations), tuple(map(Path, libraries)))
    if isinstance(drawing, Drawing):
        refuse_unmatched(drawing, job)
    elif drawing is not None:
        as_drawing(drawing, target, job)
    return job


def as_drawing(drawing: Drawable, target: str | LoadedTarget | None, job: Job) -> Drawing:
    """Return the drawing; one that is not read yet is read, with the layers of the job's
    operations."""
    if isinstance(drawing, Drawing):
        return drawing
    options = options_of({"text": job.text} if job.text else {}, _machine_of(target))
    return ShownDrawing.of(read_for_job(_reader_of(drawing), options, job))


def _reader_of(drawing: Drawable) -> Callable[[ReadOptions], Drawing]:
    """Return the function that reads the file or the objects with given options."""
    if not is_path(drawing):
        return partial(read_objects, drawing)
    return partial(read_bytes, *content(path_of(drawing)))


def as_bytes(program: bytes | Program | str | Path) -> tuple[bytes, str]:
    """Return the bytes of a program and its name for messages; ProgramError if its file cannot be
    read."""
    if isinstance(program, bytes):
        return program, BYTES
    if isinstance(program, Program):
        return program.data, BYTES
    return program_bytes(Path(program), str(program)), str(program)


# Jobs from Python: values as numbers, or as texts with units, as a job file has them.


def job_of(**settings: Any) -> Job:
    """Return the job of one operation: fields of Operation, Job and Placement by name, and those
    of its Tool with the prefix `tool_` (`tool_diameter_mm=0.2`).

    Texts and lists are read as in a job file: `depth_mm="1/8in"`, `tabs="4:3mm:1mm"`,
    `layers="CUT"` (one layer; several are separated by commas); so are the numbers of `tabs`,
    `lead_in` and the like. Other numbers are mm, rad, s and mm/min. Raises TypeError for an
    unknown name, and OptionError, which names the field, for a value that it cannot have."""
    return made(**{name: field_value(name, value) for name, value in settings.items()})


# Offsets.


def offset(
    drawing: Drawable,
    distance_mm: float,
    *,
    joins: Literal["round", "mitre", "sharp"] = "round",
    mitre_limit: float = 2.0,
) -> ShownDrawing:
    """Return the closed contours of a drawing, grown by a distance in mm, or shrunk by one below
    0; each layer is a region, in which holes become smaller as the part grows. Arcs stay arcs.

    `joins`: what is about outer corners; a "mitre" longer than `mitre_limit` times the distance
    is cut off. Open contours and marks are left out. Raises OptionError for joins that do not
    exist, and where nothing is left. Source: camtool/geometry/offset.py."""
    read = as_drawing(drawing, None, Job())
    layers = np.array(read.layers, dtype=object)
    parts: list[Polylines] = []
    names: list[str] = []
    for layer in dict.fromkeys(read.layers):
        rows = np.flatnonzero((layers == layer) & read.paths.closed)
        region = oriented(Nesting(read.paths.select(rows)))
        parts.append(offset_shape(region, -distance_mm, joins=joins, mitre_limit=mitre_limit))
        names += [layer] * len(parts[-1])
    if not names:
        raise OptionError(
            f"an offset of {distance_mm:g} mm leaves nothing", mend="give a smaller distance"
        )
    source = f"offset {distance_mm:g} mm"
    columns = tuple(names), ("",) * len(names), (source,) * len(names)
    return ShownDrawing(Polylines.joined(parts), *columns, file=read.file, units=read.units)


# Machines.


def targets() -> list[ListedTarget]:
    """Return the installed machines, sorted by name: title, extension, and the keys that the
    user's machine file must give. A plug-in that cannot be loaded is left out with a warning."""
    broken: list[CamtoolError] = []
    listed_targets = [listed for _, listed in each_target(list_target, broken=broken)]
    for error in broken:
        warnings.warn(str(error), stacklevel=2)
    return listed_targets


def load_target(
    name: str | None = None,
    *,
    machine: str | Path | None = None,
    settings: Mapping[str, Any] | Sequence[str] = (),
) -> LoadedTarget:
    """Return the target `name` with the values of a user's `machine` file and of `settings`;
    without a name, the target that the file extends.

    `settings`: {"axes.x.backlash_mm": 0.2}, or a list as for `--set`. The suffix of a key says its
    unit. Raises UnknownTargetError (with the nearest names) and MachineError."""
    if isinstance(settings, Mapping):
        settings = [f"{key}={_as_toml(value)}" for key, value in settings.items()]
    file = None if machine is None else Path(machine)
    if name is None:
        if file is None:
            raise TypeError("load_target needs a name, or a machine file that extends one")
        name = extended_by(file)
    return loaded(name, machine_file=file, settings=settings)


def as_target(target: str | LoadedTarget) -> LoadedTarget:
    """Return the target as given, or loaded by its name."""
    return load_target(target) if isinstance(target, str) else target


def _machine_of(target: str | LoadedTarget | None) -> Machine | None:
    """Return the machine of a target, None if no target is given."""
    return None if target is None else as_target(target).machine


def _as_toml(value: Any) -> str:
    """Return a Python value as the TOML text that `--set` takes."""
    import json

    return json.dumps(value, ensure_ascii=False)


# Toolpaths and programs.


def plan(drawing: Drawable, target: str | LoadedTarget, job: Job | None = None) -> ShownToolpath:
    """Return the moves that cut the drawing: work frame, mm, mm/min, in order of execution.

    N rows in columns: `kind` (N,), `end` (N, 3), `centre` (N, 2), `feed` (N,). Without a job, a
    tool of no width follows all lines; `job_of(tool_diameter_mm=0.2, side="auto")` makes a simple
    one. Of a file, only the layers that the operations name are cut. Raises OptionError where the
    drawing or the machine does not allow what the job asks. Source: docs/toolpaths.md."""
    from camtool.planning.plan import plan as planned

    loaded_target, job_used = as_target(target), job or Job()
    read = as_drawing(drawing, loaded_target, job_used)
    toolpath = planned(read, job_used, loaded_target.machine)
    return ShownToolpath.of(toolpath, read, job_used, loaded_target)


def post(
    drawing: Drawable,
    target: str | LoadedTarget,
    job: Job | None = None,
    *,
    check: bool = True,
    compensate: bool = False,
    gates: Gates | None = None,
) -> Run:
    """Return the drawing as a program of the target, read back, simulated and judged.

    `data` are the bytes of the program, `verification` its figures (None with `check=False`),
    `findings` those of all stages. `compensate`, as the job's, corrects the path for
    backlash, scale and squareness; exceeding one of the `gates` is a finding. Raises OptionError,
    and PostError for what the machine or its dialect cannot do. Source: docs/verifying.md."""
    loaded_target, job_used = as_target(target), _with_compensation(job, compensate)
    read = as_drawing(drawing, loaded_target, job_used)
    return post_drawing(read, job_used, loaded_target, check=check, gates=gates)


def post_by_tool(
    drawing: Drawable,
    target: str | LoadedTarget,
    job: Job | None = None,
    *,
    check: bool = True,
    compensate: bool = False,
    gates: Gates | None = None,
) -> tuple[Run, ...]:
    """Return a drawing as several programs, one for each stretch between tool changes, for
    machines without a tool changer; otherwise as `post`.

    All of them are planned together, in one work frame; each is complete, and judged alone against
    what its operations ask for. Raises as `post` does. Source: docs/verifying.md."""
    loaded_target, job_used = as_target(target), _with_compensation(job, compensate)
    read = as_drawing(drawing, loaded_target, job_used)
    return by_tool(read, job_used, loaded_target, check=check, gates=gates)


def post_by_setup(
    drawing: Drawable,
    target: str | LoadedTarget,
    job: Job,
    *,
    check: bool = True,
    compensate: bool = False,
    gates: Gates | None = None,
) -> tuple[Run, ...]:
    """Return a drawing as several programs, one for each set-up of the job, in the order of the
    job; otherwise as `post`.

    `job.setup(NAME)` is the job of one of them. Raises as `post` does, and OptionError for a job
    without set-ups. Source: docs/jobs.md."""
    loaded_target, job_used = as_target(target), _with_compensation(job, compensate)
    read = as_drawing(drawing, loaded_target, job_used)
    return by_setup(read, job_used, loaded_target, check=check, gates=gates)


def _with_compensation(job: Job | None, compensate: bool) -> Job:
    """Return the job with compensation switched on if `compensate` is set; a job that compensates
    already is returned unchanged."""
    job_used = job or Job()
    return replace(job_used, compensate=True) if compensate else job_used


def inspect(
    run: Run,
    tolerances: str | Path | None = None,
    *,
    require: Literal["in", "not-out"] | None = None,
) -> Run:
    """Return the run with a verdict on each dimension of its part: `report.inspection`, in mm and
    µm.

    `tolerances`: the file that names them besides those of the drawing; None: these alone. What
    falls short of `require` is an error of `findings`. Raises OptionError for a wrong file,
    and where the job scales the part. Source: docs/tolerances.md, ISO 14253-1."""
    from camtool.inspection.tolerances import dimensions_of
    from camtool.inspection.verdicts import Tolerances
    from camtool.inspection.verdicts import inspect as inspected

    if run.drawing is None:
        raise OptionError("a run without a drawing has no dimensions", mend="post a drawing")
    file = None if tolerances is None else Path(tolerances)
    dimensions, findings = dimensions_of(run.drawing, file)
    return inspected(run, Tolerances(dimensions, findings, require))


def meet(
    drawing: Drawable,
    target: str | LoadedTarget,
    tolerances: str | Path | None = None,
    *,
    job: str | Path | None = None,
    max_trials: int | None = None,
) -> Meeting:
    """Return the cheapest change of a job file after which all dimensions of the part hold.

    `tolerances` as for `inspect`; `job`: the file (None: a tool of no width follows all lines).
    `max_trials` programs are tried (None: 100). `text` is the new job file, `run` its program;
    `certificate` says why no job does, None where one does. Raises OptionError where the job
    has errors, and where no dimension has limits. Source: docs/tolerances.md."""
    from camtool.inspection.meet import DEFAULT_TRIALS, MeetingCase
    from camtool.inspection.meet import meet as met
    from camtool.inspection.tolerances import dimensions_of
    from camtool.inspection.verdicts import Tolerances
    from camtool.jobs.changes import job_of_tables, merged_tables

    loaded_target, place = as_target(target), Path("job.toml" if job is None else job)
    file = JobTables() if job is None else read_job_file(place)
    tables = merged_tables(file, JobTables(), place.parent)
    job_of = partial(job_of_tables, place=place, shop=Shop())
    read = as_drawing(drawing, loaded_target, job_of(tables))
    tolerances_file = None if tolerances is None else Path(tolerances)
    case = MeetingCase(
        read, loaded_target, tables, job_of, Tolerances(*dimensions_of(read, tolerances_file))
    )
    return met(case, max_trials or DEFAULT_TRIALS)


def convert(
    program: bytes | Program | str | Path,
    from_: str | LoadedTarget,
    to: str | LoadedTarget,
    *,
    feed_mm_min: float | None = None,
    check: bool = True,
) -> Run:
    """Return a program of the machine `from_` as one of the machine `to`, read back, simulated and
    compared with the moves of the first program.

    `program`: its bytes or its file. `feed_mm_min` replaces all feeds. Of the result, `data` are
    the new bytes and `verification` the figures (None with `check=False`). Raises ProgramError
    with block and column, and PostError for what the second machine cannot do. Source:
    docs/verifying.md, docs/dialects."""
    before, after = as_target(from_), as_target(to)
    data, source = as_bytes(program)
    return convert_program(data, before, after, file=source, feed_mm_min=feed_mm_min, check=check)


def cut_stock(run: Run, job: Job | None = None) -> CutStock:
    """Return the stock after the program of a run, cut by the simulated path of the slides.

    `heights(points)` gives the exact height over points (J, 2), 0 at the top, and `bounds(points)`
    what it may be; `section("x", 20.0)` a profile, `removed_mm3()` the volume between two bounds.
    The tools are those of the run's job, or of `job`. Raises OptionError where a tool is not
    known. Source: docs/stock.md."""
    if run.decoded is None or run.target is None:
        raise OptionError("a run without a program leaves no stock", mend="post a drawing")
    return stock_after(run.decoded, run.target, run.job if job is None else job)


# Verification of programs, comparison of variants, and calibration of machines.


def verify(
    program: bytes | Program | str | Path,
    target: str | LoadedTarget,
    *,
    against: Drawable | None = None,
    job: Job | None = None,
    judging: Judging | None = None,
) -> Run:
    """Simulate a program on the target's controller and mechanics, and judge the result.

    `program`: its bytes, a Program, or the path of its file. With `against`, that drawing is
    planned with `job`; the simulated path of the machine's slides is compared with the plan, and
    the program is checked against what the job asks for: cuts, direction, feeds, spindle, tool,
    clearance, end. A failed check is in `report`, not raised. `report` holds errors
    in µm, sizes in mm, times in s. Raises ProgramError with block and column, and OptionError.
    Source: docs/verifying.md."""
    loaded_target, job_used = as_target(target), job or Job()
    data, source = as_bytes(program)
    read = None if against is None else as_drawing(against, loaded_target, job_used)
    return verify_program(
        data, loaded_target, source=source, drawing=read, job=job_used, judging=judging
    )


def signals(program: bytes | Program | str | Path, target: str | LoadedTarget) -> Signals:
    """Return the lines of the target's controller over time while it runs a program: step and
    direction lines, or the coils of its motors.

    `count()` gives the steps of each motor and the time in s, `levels()` the bytes of all ports in
    chunks, `save("a.vcd")` a dump, a table (.csv) or a picture (.svg, .png). Raises MachineError
    for a target without steps, ProgramError with block and column. Source: docs/signals.md."""
    data, source = as_bytes(program)
    return Signals.of(data, as_target(target), Path(source).name)


def compare(
    program: bytes | Program | str | Path,
    target: str | LoadedTarget,
    ways: str | Mapping[str, str | LoadedTarget],
    *,
    against: Drawable | None = None,
    job: Job | None = None,
    judging: Judging | None = None,
) -> Comparison:
    """Return a program of the target, simulated and judged as several variants, side by side.

    `ways` are the variants: "interpolators", "mechanics", values of a key such as
    "backlash=0,0.1,0.2" (mm), or targets by names of your own. `rows` holds errors in µm and times
    in s, `verdicts` the verification of each variant. Raises ProgramError with block and column,
    OptionError for unknown variants, and MachineError for values that the machine cannot have.
    Source: docs/verifying.md."""
    loaded_target, job_used, judging_used = as_target(target), job or Job(), judging or Judging()
    data, source = as_bytes(program)
    read = None if against is None else as_drawing(against, loaded_target, job_used)
    if isinstance(ways, str):
        variants = variants_of(
            ways, lambda settings: loaded_target.with_settings(settings), judging_used
        )
    else:
        variants = [
            ProgramVariant(name, as_target(each), judging_used) for name, each in ways.items()
        ]
    if not variants:
        raise OptionError("there is nothing to compare", mend="give a target for each way")
    return compare_program(data, variants, source=source, drawing=read, job=job_used)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Calibrated(Calibration):
    """Estimates of the values of `machine` from `measurements`
    (`camtool.calibration.calibrate.Calibration`), with uncertainties, mm and rad. `extends` is the
    table of the user's machine file, on which `machine_file` builds."""

    measurements: Measurements
    machine: Machine
    extends: Mapping[str, object]

    @property
    def machine_file(self) -> str:
        """TOML text for `load_target(..., machine=FILE)`: the estimates replace earlier values,
        each with its uncertainty and source in a comment."""
        return machine_file(self, self.measurements, self.machine, dict(self.extends))

    def __str__(self) -> str:
        return to_text(self, self.machine)

    def __repr__(self) -> str:
        names = ", ".join(each.name for each in self.estimates if not each.region)
        return f"<Calibration of {self.target} from {self.file}: {names or 'nothing'}>"


def calibrate(
    measurements: Measurements | str | Path,
    target: str | None = None,
    *,
    machine: str | Path | None = None,
) -> Calibrated:
    """Return the machine's steps, backlash (mm) and squareness (rad) from measured coupons, with
    standard uncertainties.

    `measurements`: the TOML file that `camtool coupon --measurements` begins; it names the target
    unless one is given. `machine`: a file that extends the target with what is known so far.
    `machine_file` of the result is the text of a new one. Raises InputError, which names file,
    table and key, OptionError and MachineError. Source: docs/calibration.md."""
    machine_path = None if machine is None else Path(machine)
    if not isinstance(measurements, Measurements):
        measurements = read_measurements(Path(measurements))
    name = target or (measurements.target if machine_path is None else extended_by(machine_path))
    if not name:
        raise OptionError(
            "no machine is named",
            file=measurements.file,
            mend="give target, or name it in the file",
        )
    known_machine = load_target(name, machine=machine_path).machine
    calibration = calibrated(measurements, known_machine)
    values = {each.name: getattr(calibration, each.name) for each in fields(calibration)}
    extends = {"extends": name} if machine_path is None else read_table(machine_path)
    return Calibrated(**values, measurements=measurements, machine=known_machine, extends=extends)


# Pictures of the results of the other calls.


class Looks(TypedDict, total=False):
    """The look of a picture: the fields of `camtool.pictures.options.PictureOptions`.

    `size_px` is its width, `crop_mm` the rectangle (x, y, width, height) that it shows,
    `exaggerate` the factor by which deviations from the wanted path are enlarged, `layers` the
    names of the layers to show, `polar` the number (from 1) of the circle whose radial errors are
    plotted instead. `view`: "plan" (the moves from above), or the stock after them: "iso",
    "front", "side", "top", "leftover" or "gouge"."""

    size_px: int | None
    crop_mm: tuple[float, float, float, float] | None
    dark: bool
    exaggerate: float
    layers: frozenset[str] | None
    polar: int | None
    view: str


def preview(
    what: Toolpath | Shown | Drawable,
    *others: Toolpath | Shown | Drawable,
    titles: Sequence[str] = (),
    **looks: Unpack[Looks],
) -> Picture:
    """Return the picture of a drawing, also of a file or of objects, or of the result of another
    call: a toolpath, the predicted path of the slides in colours of its error (µm, with a scale),
    or several such paths.

    Several values are drawn side by side, at one scale and with one scale of errors;
    `titles` replace their own, in order. Raises OptionError for looks that make no picture.
    Source: docs/pictures.md, docs/viewer.md."""
    scenes = [_as_shown(each).scene() for each in (what, *others)]
    if len(titles) > len(scenes):
        raise TypeError(f"{len(titles)} titles for {len(scenes)} values")
    for row, title in enumerate(titles):
        scenes[row] = replace(scenes[row], title=title)
    options = PictureOptions(**looks)
    if not others:
        return Picture(scenes[0], options)
    for value, scene in zip((what, *others), scenes, strict=True):
        if not isinstance(scene, Scene):
            raise TypeError(f"a {type(value).__name__} stands beside no other picture")
    return Picture(tuple(scene for scene in scenes if isinstance(scene, Scene)), options)


def _as_shown(value: Any) -> Shown:
    """Return the value as one that shows a picture in a notebook; files and objects are read as a
    drawing."""
    if isinstance(value, Shown):
        return value
    if isinstance(value, Drawing):
        return ShownDrawing.of(value)
    if isinstance(value, Toolpath):
        return ShownToolpath.of(value)
    return read_drawing(value)
