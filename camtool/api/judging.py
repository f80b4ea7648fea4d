"""Programs judged, one way or several, and machines measured."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from camtool.api.machines import as_target, load_target
from camtool.api.reading import as_bytes, as_drawing
from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.machine.registry import LoadedTarget
from camtool.pipeline import Judging
from camtool.planning.job import Job
from camtool.results import Calibration, Comparison, Verification, extended
from camtool.toolpath.program import Program

if TYPE_CHECKING:
    from camtool.calibration.measurements import Measurements


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
    with that drawing, planned with `job`, and the program with what that job asks for: places,
    direction, feeds, spindle, tool, clearance, end. `report` holds errors in µm, sizes in mm,
    times in s. Raises ProgramError with block and column, and OptionError. Source:
    docs/verifying.md.
    """
    from camtool.pipeline import verify_program

    loaded, wanted = as_target(target), job or Job()
    data, source = as_bytes(program)
    read = None if against is None else as_drawing(against, loaded, wanted)
    decoded, found = verify_program(
        data, loaded, source=source, drawing=read, job=wanted, judging=judging
    )
    context = {"target": loaded, "drawing": read, "job": wanted}
    return extended(Verification, found, data=data, decoded=decoded, **context)


def compare(
    program: bytes | Program | str | Path,
    target: str | LoadedTarget,
    ways: str | Mapping[str, str | LoadedTarget],
    *,
    against: DrawingRecord | str | Path | None = None,
    job: Job | None = None,
    judging: Judging | None = None,
) -> Comparison:
    """A program of the target, run and judged several ways, side by side.

    `ways`: "interpolators", "mechanics", values of a key such as "backlash=0,0.1,0.2" (mm), or
    targets by names of your own. `rows` holds errors in µm, times in s; `verdicts` the whole
    verdict on each way. Raises ProgramError with block and column, OptionError for ways that are
    none, and MachineError for values that the machine cannot have. Source: docs/verifying.md.
    """
    from camtool.pipeline import Way, compare_program
    from camtool.pipeline.ways import altered, ways_of

    loaded, wanted, how = as_target(target), job or Job(), judging or Judging()
    data, source = as_bytes(program)
    read = None if against is None else as_drawing(against, loaded, wanted)
    if isinstance(ways, str):
        chosen = ways_of(ways, lambda settings: altered(loaded, settings), how)
    else:
        chosen = [Way(name, as_target(each), how) for name, each in ways.items()]
    if not chosen:
        raise OptionError("there is nothing to compare", mend="give a target for each way")
    found = compare_program(data, chosen, source=source, drawing=read, job=wanted)
    return Comparison(data, source, tuple(chosen), tuple(found))


def calibrate(
    measurements: Measurements | str | Path,
    target: str | None = None,
    *,
    machine: str | Path | None = None,
) -> Calibration:
    """The machine's steps, play (mm) and squareness (rad) from measured coupons, each with its
    standard uncertainty.

    `measurements`: the TOML file that `camtool coupon --measurements` begins; it names its target
    unless one is given. `machine`: what is known so far, a file that extends the target.
    `machine_file` of the result is the text of a new one. Raises InputError, which names file,
    table and key, OptionError and MachineError. Source: docs/calibration.md.
    """
    from camtool.calibration.calibrate import calibrate as calibrated
    from camtool.calibration.measurements import Measurements, read_measurements
    from camtool.machine.loader import extended_by, read_table

    own = None if machine is None else Path(machine)
    said = measurements
    if not isinstance(said, Measurements):
        said = read_measurements(Path(said))
    name = target or (said.target if own is None else extended_by(own))
    if not name:
        raise OptionError(
            "no machine is named", file=said.file, mend="give target, or name it in the file"
        )
    known = load_target(name, machine=own).machine
    return extended(
        Calibration,
        calibrated(said, known),
        measurements=said,
        machine=known,
        extends={"extends": name} if own is None else read_table(own),
    )
