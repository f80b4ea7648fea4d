"""`camtool servo`: the motors of servo axes from measured steps, and the gains of their loops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_new, check_places, display_name, read_bytes, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, show_text
from camtool.cli.options import (
    MachineFlags,
    SectionedCommand,
    duration,
    machine_options,
    talk_options,
)
from camtool.errors import OptionError
from camtool.pictures.options import PictureOptions
from camtool.plain import one_line, to_json
from camtool.records import replace
from camtool.tables import read_table, toml_lines

if TYPE_CHECKING:
    from camtool.arrays import Floats
    from camtool.calibration.servo import Identification, LoopDesign, LoopStep
    from camtool.machine.servo import MotorModel, SpeedLoop
    from camtool.target.registry import LoadedTarget
    from camtool.waveforms.servo import AxisMove, ServoRun, StepAnswer

AXES = "xyz"

_AXIS = click.Choice(list(AXES), case_sensitive=False)


@click.group(short_help="Servo axes: their motors, and the gains of their loops.")
def servo() -> None:
    """Identify the motor of a servo axis from measured steps, design the gains of its speed loop
    as the controller stores them, and show how the axes follow a program.

    \b
    camtool servo identify step.csv -t matlab-router --axis x --drive 70
    camtool servo design -t matlab-router --settling 250ms --damping 0.707
    camtool servo step -t matlab-router --speed 3515
    camtool servo show star.m -t matlab-router -o servo.svg --from 2s --span 1s"""


@servo.command(cls=SectionedCommand, short_help="The motor of an axis, from measured steps.")
@click.argument("responses", metavar="FILE...", nargs=-1, required=True)
@machine_options
@click.option("--axis", type=_AXIS, required=True, help="The axis that was measured.")
@click.option(
    "--drive",
    type=click.FloatRange(-100.0, 100.0),
    metavar="PERCENT",
    help="The drive from the first sample on, for files without a column of it.",
)
@click.option("-o", "--output", metavar="FILE", help="The machine file to write; - is stdout.")
@click.option("--json", "report", metavar="FILE", help="The result as JSON; - is stdout.")
@talk_options
def identify(
    responses: tuple[str, ...],
    machine: MachineFlags,
    axis: str,
    drive: float | None,
    output: str | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Identify gain, time constant, dead time and friction of a motor from the steps in FILE
    (- is stdin): a table with a head of time_s (or time_ms), speed (counts in a tick) or counts
    (of the encoder), and drive (percent).

    Two drives, or a motor that coasts to rest at the end, determine the friction."""
    from camtool.calibration import servo as bench

    check_places([*responses, *machine.files()], [output, report])
    if output is not None and output != STDOUT:
        check_new(output)
    loaded = machine.load()
    loop = _loop(loaded)
    tables = [
        bench.read_response(read_bytes(name).decode("utf-8", "replace"), name, drive)
        for name in responses
    ]
    result = bench.identify(tables, loop.tick_s)
    index = AXES.index(axis)
    motors = [*loop.motors]
    motors[index] = result.motor
    changed = replace(loop, motors=tuple(motors))
    files: dict[str, bytes] = {}
    if output is not None:
        files[output] = _machine_file(machine, loaded, changed, "identified from measured steps")
    if report is not None:
        files[report] = to_json(_motor_data(axis, result)).encode()
    write_all(files)
    if STDOUT not in files and not quiet:
        for line in _motor_lines(axis, result, loop.motors[index]):
            show_text(one_line(line))
    for note in result.notes:
        say(f"camtool: note: {note}", quiet=quiet)
    if output is not None:
        if result.motor.dead_time_s > 0.1 * loop.tick_s:
            late_ms = result.motor.dead_time_s * 1e3
            say(f"camtool: note: the dead time of {late_ms:.1f} ms is in no key", quiet=quiet)
        say(f"written: {'stdout' if output == STDOUT else output}", quiet=quiet)


@servo.command(cls=SectionedCommand, short_help="The gains for a settling time and a damping.")
@machine_options
@click.option(
    "--settling",
    required=True,
    metavar="TIME",
    callback=duration,
    help="Until the speed is within 2 % of its reference, such as 250ms.",
)
@click.option(
    "--damping",
    type=click.FloatRange(0.05, 2.0),
    default=0.707,
    show_default=True,
    metavar="ZETA",
    help="Of the closed loop; 0.707 overshoots by 4.3 %.",
)
@click.option("--axis", type=_AXIS, help="Only this axis.")
@click.option(
    "--reference",
    type=click.FloatRange(min=1.0),
    default=300.0,
    show_default=True,
    metavar="COUNTS",
    help="The step of the simulated speed, counts in a tick.",
)
@click.option("-o", "--output", metavar="FILE", help="The machine file to write; - is stdout.")
@click.option("--json", "report", metavar="FILE", help="The result as JSON; - is stdout.")
@talk_options
def design(
    machine: MachineFlags,
    settling: float,
    damping: float,
    axis: str | None,
    reference: float,
    output: str | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Compute Ki, Kp and the digital Kid, Kpd for the motors of the machine, and what the rounding
    of stored gains and the sampling make of settling time, damping and overshoot."""
    from camtool.calibration import servo as bench

    check_places(machine.files(), [output, report])
    if output is not None and output != STDOUT:
        check_new(output)
    loaded = machine.load()
    loop = _loop(loaded)
    kid, kpd = [*loop.kid], [*loop.kpd]
    designs: dict[str, tuple[LoopDesign, LoopStep]] = {}
    for index, name in enumerate(AXES):
        if axis is None or name == axis.lower():
            gains = bench.design(loop.motors[index], loop, settling, damping)
            step = bench.simulate_step(loop.motors[index], loop, gains.stored, reference)
            designs[name] = gains, step
            kid[index], kpd[index] = gains.stored
    changed = replace(loop, kid=tuple(kid), kpd=tuple(kpd))
    files: dict[str, bytes] = {}
    if output is not None:
        what = f"gains for {settling * 1e3:g} ms and a damping of {damping:g}"
        files[output] = _machine_file(machine, loaded, changed, what)
    if report is not None:
        files[report] = to_json(_design_data(designs, loop)).encode()
    write_all(files)
    if STDOUT not in files and not quiet:
        for line in _design_lines(designs, loop, reference):
            show_text(one_line(line))
    if output is not None:
        say(f"written: {'stdout' if output == STDOUT else output}", quiet=quiet)


@servo.command(cls=SectionedCommand, short_help="The answer of motors to a step.")
@machine_options
@click.option(
    "--drive",
    type=click.FloatRange(-100.0, 100.0),
    metavar="PERCENT",
    help="A step of the drive, without the loop.",
)
@click.option(
    "--speed",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="RPM",
    help="A step of the commanded speed of the motor, with the stored gains.",
)
@click.option("--axis", type=_AXIS, help="Only this axis.")
@click.option(
    "-o",
    "--output",
    "pictures",
    multiple=True,
    metavar="FILE",
    help="A .svg or .png of speed, position and drive; may be given several times.",
)
@click.option("--json", "report", metavar="FILE", help="The answers as JSON; - is stdout.")
@click.option("--size", type=click.INT, metavar="PX", help="Width of a picture in pixels.")
@click.option("--dark", is_flag=True, help="A picture on a dark ground.")
@talk_options
def step(
    machine: MachineFlags,
    drive: float | None,
    speed: float | None,
    axis: str | None,
    pictures: tuple[str, ...],
    report: str | None,
    size: int | None,
    dark: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Show how the motors of the machine answer a step, for a second: of the drive (--drive), or
    of the speed with their loop (--speed)."""
    if (drive is None) == (speed is None):
        raise click.UsageError("give --drive PERCENT or --speed RPM")
    _check_pictures(pictures, {"--size": size is not None, "--dark": dark})
    check_places(machine.files(), [*pictures, report])

    from camtool.waveforms.servo import StepAnswer, steps_picture

    loaded = machine.load()
    loop = _loop(loaded)
    chosen = [name for name in AXES if axis is None or name == axis.lower()]
    answers = [StepAnswer(name, *_answer(loop, name, drive, speed)) for name in chosen]
    what = f"{drive:g} % drive" if drive is not None else f"{speed:g} rpm"
    title = f"{loaded.machine.target.name}: a step of {what}"
    options = PictureOptions(size_px=size, dark=dark)
    files: dict[str, bytes] = {
        name: steps_picture(name, title, answers, loop.tick_s, options) for name in pictures
    }
    figures = [_answer_figures(answer, loop) for answer in answers]
    if report is not None:
        files[report] = to_json({"tick_s": loop.tick_s, "axes": figures}).encode()
    write_all(files)
    if STDOUT not in files and not quiet:
        show_text("axis    end speed            peak rpm  overshoot  63.2 % after  settling")
        for each in figures:
            settled = "never" if each["settling_s"] is None else f"{each['settling_s']:.3f} s"
            show_text(
                f"{each['axis']}{each['end_counts']:8.1f} = {each['end_rpm']:7.1f} rpm"
                f"{each['peak_rpm']:12.1f}{100.0 * each['overshoot']:9.1f} %"
                f"{each['rise_s']:12.3f} s{settled:>10}"
            )
    if files:
        say(f"written: {', '.join(name for name in files if name != STDOUT)}", quiet=quiet)


def _check_pictures(names: Sequence[str], looks: dict[str, bool]) -> None:
    """Raise a usage error for names that are no pictures, and for `looks` without any."""
    for name in names:
        if PurePath(name).suffix.lower() not in (".svg", ".png"):
            raise click.UsageError(f"-o {name}: a picture is .svg or .png")
    flags = [flag for flag, is_given in looks.items() if is_given]
    if flags and not names:
        raise click.UsageError(f"{', '.join(flags)}: for pictures; give -o FILE.svg")


STEP_S = 1.0


def _answer(
    loop: SpeedLoop, axis: str, drive: float | None, speed: float | None
) -> tuple[Floats, Floats, Floats]:
    """Return speed and reference (rpm) and drive (percent) of an axis, tick by tick, in answer to
    a step of its drive (percent) or of its speed (rpm)."""
    import numpy as np

    from camtool.calibration.servo import respond, simulate_step

    index = AXES.index(axis)
    motor, ticks = loop.motors[index], round(STEP_S / loop.tick_s)
    rpm = 60.0 / (loop.tick_s * loop.counts_per_turn)
    if speed is not None:
        gains = loop.kid[index], loop.kpd[index]
        answer = simulate_step(motor, loop, gains, speed / rpm)
        reference = np.full(ticks, speed)
        return answer.speed[:ticks] * rpm, reference, answer.drive[:ticks]
    drives = np.full(ticks + 1, float(drive or 0.0))
    at_s = loop.tick_s * np.arange(ticks + 1, dtype=np.float64)
    _, counts = respond(motor, at_s, drives, loop.tick_s)
    return np.diff(counts) * rpm, np.full(ticks, np.nan), drives[1:]


def _answer_figures(answer: StepAnswer, loop: SpeedLoop) -> dict[str, Any]:
    """Return the figures of a step response: final speed, peak and overshoot (beyond the commanded
    speed; in open loop beyond the final speed), time to 63.2 %, and time until it stays within 2
    %."""
    import numpy as np

    rpm = 60.0 / (loop.tick_s * loop.counts_per_turn)
    size = np.abs(answer.speed)
    end = float(np.nan_to_num(np.abs(answer.reference[-1]), nan=size[-1])) or 1.0
    off = np.flatnonzero(np.abs(size - end) > 0.02 * end)
    after = int(off[-1]) + 1 if len(off) else 0
    return {
        "axis": answer.axis,
        "end_counts": float(answer.speed[-1]) / rpm,
        "end_rpm": float(answer.speed[-1]),
        "peak_rpm": float(size.max()),
        "overshoot": float(size.max()) / end - 1.0,
        "rise_s": (int((size >= (1.0 - np.exp(-1.0)) * end).argmax()) + 1) * loop.tick_s,
        "settling_s": after * loop.tick_s if after < len(size) else None,
    }


MOVES_SHOWN = 20


@servo.command(cls=SectionedCommand, short_help="How the axes follow a program.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option(
    "-o",
    "--output",
    "pictures",
    multiple=True,
    metavar="FILE",
    help="A .svg or .png of ω, θ and the error along the path; may be given several times.",
)
@click.option("--csv", "table", metavar="FILE", help="A table of all ticks; - is stdout.")
@click.option("--json", "report", metavar="FILE", help="The figures as JSON; - is stdout.")
@click.option(
    "--from", "start", metavar="TIME", callback=duration, help="Begin so long after the start."
)
@click.option("--span", metavar="TIME", callback=duration, help="Only so long.")
@click.option("--axes", metavar="NAME,...", help="Only these axes in a picture, such as X,Y.")
@click.option("--size", type=click.INT, metavar="PX", help="Width of a picture in pixels.")
@click.option("--dark", is_flag=True, help="A picture on a dark ground.")
@talk_options
def show(
    program: str,
    machine: MachineFlags,
    pictures: tuple[str, ...],
    table: str | None,
    report: str | None,
    start: float | None,
    span: float | None,
    axes: str | None,
    size: int | None,
    dark: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Show speed and position of each motor, commanded and reached, and the error along the path,
    while the machine runs PROGRAM (- is stdin)."""
    names = None if axes is None else [name.strip() for name in axes.split(",")]
    options = PictureOptions(size_px=size, dark=dark)
    _check_pictures(
        pictures, {"--axes": names is not None, "--size": size is not None, "--dark": dark}
    )
    check_places([program, *machine.files()], [*pictures, table, report])

    from camtool.waveforms.servo import ServoRun

    loaded = machine.load()
    loop = _loop(loaded)
    progress().begin("reading the program")
    toolpath = loaded.target.read(read_bytes(program), loaded.machine)
    shown = display_name(PurePath(program).name)
    run = ServoRun(loaded, toolpath, loop, shown, start or 0.0, span)
    progress().begin("running the controller")
    files: dict[str, bytes] = {name: run.picture(name, options, names) for name in pictures}
    if table is not None:
        files[table] = b"".join(run.table())
    moves = tuple(run.moves())
    if report is not None:
        files[report] = to_json(_run_data(run, moves)).encode()
    write_all(files)
    if STDOUT not in files and not quiet:
        for line in _run_lines(run, moves):
            show_text(one_line(line))
    if files:
        say(f"written: {', '.join(name for name in files if name != STDOUT)}", quiet=quiet)


def _run_lines(run: ServoRun, moves: Sequence[AxisMove]) -> Iterator[str]:
    """Yield lines of text with the figures of the moves, and the extremes over all moves."""
    yield "      at s  block  axis    reference    peak rpm  overshoot  settling   steady  end µm"
    for move in moves[:MOVES_SHOWN]:
        settling = "never" if move.settling_s is None else f"{move.settling_s * 1e3:.0f} ms"
        steady = "" if move.steady_error is None else f"{move.steady_error * 100.0:+.2f} %"
        yield (
            f"{move.at_s:10.3f}{move.block:7}  {move.axis:>4}{move.reference_rpm:13.1f}"
            f"{move.peak_rpm:12.1f}{move.overshoot * 100.0:9.1f} %{settling:>10}{steady:>9}"
            f"{move.end_error_um:8.0f}"
        )
    if len(moves) > MOVES_SHOWN:
        yield f"and {len(moves) - MOVES_SHOWN} more; --json lists them"
    for axis in AXES.upper():
        own = [move for move in moves if move.axis == axis]
        if own:
            fastest = max(own, key=lambda move: abs(move.peak_rpm))
            farthest = max(own, key=lambda move: abs(move.end_error_um))
            yield (
                f"{axis}: at most {abs(fastest.peak_rpm):.0f} rpm at {fastest.at_s:.3f} s; "
                f"at most {abs(farthest.end_error_um):.0f} µm beside its place, in the move at "
                f"{farthest.at_s:.3f} s"
            )


def _run_data(run: ServoRun, moves: Sequence[AxisMove]) -> dict[str, Any]:
    """Return the figures of a run as data for JSON."""
    from_s, to_s = run.shown_s
    return {
        "tick_s": run.loop.tick_s,
        "from_s": from_s,
        "to_s": to_s,
        "moves": [
            {name: getattr(move, name) for name in move.__struct_fields__} for move in moves
        ],
    }


def _loop(loaded: LoadedTarget) -> SpeedLoop:
    """Return the speed loops of the machine's servo axes; OptionError for a machine
    without any."""
    loop = loaded.target.speed_loop(loaded.machine)
    if loop is None:
        raise OptionError(
            f"{loaded.machine.target.name} has no speed loops that camtool knows",
            where="--target",
            mend="matlab-router has them, with its own controller.model",
        )
    return loop


def _machine_file(
    flags: MachineFlags, loaded: LoadedTarget, loop: SpeedLoop, origin: str
) -> bytes:
    """Return the text of a machine file with this loop in addition to the user's values."""
    table: dict[str, Any] = {"extends": str(flags.name())}
    if flags.machine is not None:
        table = read_table(Path(flags.machine))
    controller = {**table.get("controller", {}), **loaded.target.loop_keys(loop)}
    head = f"# {loaded.machine.target.name}: {origin}"
    return "\n".join([head, "", *toml_lines({**table, "controller": controller}), ""]).encode()


def _motor_lines(axis: str, result: Identification, before: MotorModel) -> Iterator[str]:
    motor = result.motor
    rows = [
        ("gain", before.gain, motor.gain, "counts in a tick per %", "gain"),
        ("time constant", before.time_constant_s, motor.time_constant_s, "s", "time_constant_s"),
        ("dead time", before.dead_time_s, motor.dead_time_s, "s", "dead_time_s"),
        ("friction", before.friction_percent, motor.friction_percent, "%", "friction_percent"),
    ]
    yield f"axis {axis}          before  identified  ± standard uncertainty"
    for name, old, new, unit, key in rows:
        sigma = result.uncertainty[key]
        sigma_words = "not determined" if sigma is None else f"± {sigma:.2g} {unit}"
        yield f"{name:<14}{old:>9.4g}{new:>12.5g}  {sigma_words}"
    yield f"{result.samples} samples, residuals {result.residual:.3g} rms"


def _motor_data(axis: str, result: Identification) -> dict[str, Any]:
    motor = result.motor
    return {
        "axis": axis,
        "gain": motor.gain,
        "time_constant_s": motor.time_constant_s,
        "dead_time_s": motor.dead_time_s,
        "friction_percent": motor.friction_percent,
        "uncertainty": result.uncertainty,
        "residual_rms": result.residual,
        "samples": result.samples,
        "notes": list(result.notes),
    }


def _design_lines(
    designs: dict[str, tuple[LoopDesign, LoopStep]], loop: SpeedLoop, reference: float
) -> Iterator[str]:
    yield "axis      ωn       Ki       Kp       Kid       Kpd  stored Kid, Kpd"
    for axis, (gains, _) in designs.items():
        yield (
            f"{axis}     {gains.wanted[0]:5.2f}{gains.ki:9.4f}{gains.kp:9.4f}{gains.kid:10.6f}"
            f"{gains.kpd:10.6f}  {gains.stored[0]:g}, {gains.stored[1]:g}"
        )
    yield ""
    yield f"a step to {reference:g} counts in a tick of {loop.tick_s * 1e3:g} ms:"
    yield "axis  ωn, ζ, settling: wanted    with stored gains       simulated: settling, overshoot"
    for axis, (gains, step) in designs.items():
        settled = "never" if step.settling_s is None else f"{step.settling_s * 1e3:.0f} ms"
        yield (
            f"{axis}       {_character(gains.wanted)}  {_character(gains.got)}"
            f"      {settled:>7}, {step.overshoot * 100.0:.1f} %"
            + ("; the drive is at its limit" if step.drive.max() >= 100.0 else "")
        )


def _character(values: Sequence[float]) -> str:
    natural, damping, settling_s = values
    return f"{natural:6.2f} {damping:6.3f} {settling_s * 1e3:6.0f} ms"


def _design_data(
    designs: dict[str, tuple[LoopDesign, LoopStep]], loop: SpeedLoop
) -> dict[str, Any]:
    return {
        "tick_s": loop.tick_s,
        "gain_unit": loop.gain_unit,
        "axes": [
            {
                "axis": axis,
                "ki": gains.ki,
                "kp": gains.kp,
                "kid": gains.kid,
                "kpd": gains.kpd,
                "stored_kid": gains.stored[0],
                "stored_kpd": gains.stored[1],
                "poles": [[pole.real, pole.imag] for pole in gains.poles],
                "natural_rad_s": {"wanted": gains.wanted[0], "stored": gains.got[0]},
                "damping": {"wanted": gains.wanted[1], "stored": gains.got[1]},
                "settling_s": {
                    "wanted": gains.wanted[2],
                    "stored": gains.got[2],
                    "simulated": step.settling_s,
                },
                "overshoot": step.overshoot,
                "max_drive_percent": float(step.drive.max()),
            }
            for axis, (gains, step) in designs.items()
        ],
    }
