"""`camtool servo`: the motors of servo axes from measured steps, and the gains of their loops."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_new, check_places, read_bytes, write_all
from camtool.cli.messages import say, show_text
from camtool.cli.options import (
    MachineFlags,
    SectionedCommand,
    duration,
    machine_options,
    talk_options,
)
from camtool.errors import OptionError
from camtool.plain import one_line, to_json
from camtool.records import replace
from camtool.tables import toml_lines

if TYPE_CHECKING:
    from camtool.calibration.servo import Identification, LoopDesign, LoopStep
    from camtool.machine.servo import MotorModel, SpeedLoop
    from camtool.target.registry import LoadedTarget

AXES = "xyz"

_AXIS = click.Choice(list(AXES), case_sensitive=False)


@click.group(short_help="Servo axes: their motors, and the gains of their loops.")
def servo() -> None:
    """Identify the motor of a servo axis from measured steps, and design the gains of its speed
    loop as the controller stores them.

    \b
    camtool servo identify step.csv -t matlab-router --axis x --drive 70
    camtool servo design -t matlab-router --settling 250ms --damping 0.707
    """


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

    Two drives, or a motor that coasts to rest at the end, determine the friction.
    """
    from camtool.calibration.servo import identify as identified
    from camtool.calibration.servo import read_response

    check_places([*responses, *machine.files()], [output, report])
    if output is not None and output != STDOUT:
        check_new(output)
    loaded = machine.load()
    loop = _loop(loaded)
    tables = [
        read_response(read_bytes(name).decode("utf-8", "replace"), name, drive)
        for name in responses
    ]
    result = identified(tables, loop.tick_s)
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
    from camtool.calibration.servo import design as designed
    from camtool.calibration.servo import simulate_step

    check_places(machine.files(), [output, report])
    if output is not None and output != STDOUT:
        check_new(output)
    loaded = machine.load()
    loop = _loop(loaded)
    kid, kpd = [*loop.kid], [*loop.kpd]
    designs: dict[str, tuple[LoopDesign, LoopStep]] = {}
    for index, name in enumerate(AXES):
        if axis is None or name == axis.lower():
            gains = designed(loop.motors[index], loop, settling, damping)
            step = simulate_step(loop.motors[index], loop, gains.stored, reference)
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


def _loop(loaded: LoadedTarget) -> SpeedLoop:
    """Return the speed loops of the machine; OptionError for a machine without any."""
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
    """Return the text of a machine file with this loop over what the user's file says."""
    from camtool.tables import read_table

    table: dict[str, Any] = {"extends": str(flags.name())}
    if flags.machine is not None:
        table = read_table(Path(flags.machine))
    controller = {**table.get("controller", {}), **loaded.target.loop_keys(loop)}
    head = f"# {loaded.machine.target.name}: {origin}"
    return "\n".join([head, "", *toml_lines({**table, "controller": controller}), ""]).encode()


def _motor_lines(axis: str, found: Identification, before: MotorModel) -> Iterator[str]:
    motor = found.motor
    rows = [
        ("gain", before.gain, motor.gain, "counts in a tick per %", "gain"),
        ("time constant", before.time_constant_s, motor.time_constant_s, "s", "time_constant_s"),
        ("dead time", before.dead_time_s, motor.dead_time_s, "s", "dead_time_s"),
        ("friction", before.friction_percent, motor.friction_percent, "%", "friction_percent"),
    ]
    yield f"axis {axis}          before  identified  ± standard uncertainty"
    for name, old, new, unit, key in rows:
        sigma = found.uncertainty[key]
        sigma_words = "not determined" if sigma is None else f"± {sigma:.2g} {unit}"
        yield f"{name:<14}{old:>9.4g}{new:>12.5g}  {sigma_words}"
    yield f"{found.samples} samples, residuals {found.residual:.3g} rms"


def _motor_data(axis: str, found: Identification) -> dict[str, Any]:
    motor = found.motor
    return {
        "axis": axis,
        "gain": motor.gain,
        "time_constant_s": motor.time_constant_s,
        "dead_time_s": motor.dead_time_s,
        "friction_percent": motor.friction_percent,
        "uncertainty": found.uncertainty,
        "residual_rms": found.residual,
        "samples": found.samples,
        "notes": list(found.notes),
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
