"""Servo axes: identify a motor from measured steps, and design the gains of its speed loop.

step.csv ─read_response─▶ MeasuredResponse ─identify─▶ Identification ─design─▶ LoopDesign

The motor is that of `MotorModel`; the loop is the IP controller of the thesis on matlab-router
(eq. 4.19-4.45, L2267-2880), whose integral alone sees the reference."""

from __future__ import annotations

import cmath
import csv
import io
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import InputError, OptionError
from camtool.machine.servo import MotorModel, SpeedLoop

# The measured response of a motor to a drive that changes in steps.

MAX_DRIVE_PERCENT = 100.0

MIN_SAMPLES = 8
"""Fewer samples do not determine gain, time constant and dead time."""

TIMES = {"time_s": 1.0, "t": 1.0, "time": 1.0, "time_ms": 1e-3}
"""Names of the column of times, with the second in each."""


class MeasuredResponse(Struct, frozen=True, eq=False):
    """K samples of a motor: `time_s` ascending; `drive` in percent, held until the next sample;
    `value` is the speed, counts in a tick, or with `is_count` the count of the encoder."""

    file: str
    time_s: Floats
    drive: Floats
    value: Floats
    is_count: bool


def read_response(text: str, file: str, drive_percent: float | None) -> MeasuredResponse:
    """Read a table of samples: columns `time_s` (or `time_ms`), `speed` or `counts`, and `drive`.

    Without a head the columns are seconds, speed and drive. Without a column of the drive it is
    `drive_percent` from the first sample on. InputError, which names the line."""
    rows = [
        (number, [cell.strip() for cell in row])
        for number, row in enumerate(csv.reader(io.StringIO(text), delimiter=_delimiter(text)), 1)
        if any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#")
    ]
    names = ["time_s", "speed", "drive"][: len(rows[0][1]) if rows else 3]
    if rows and not _is_number(rows[0][1][0]):
        names = [name.lower() for name in rows.pop(0)[1]]
    if "drive" in names and drive_percent is not None:
        raise OptionError(
            "the file has a column of the drive", where="--drive", mend="leave it out"
        )
    time, value, drive = _columns(names, file, needs_drive=drive_percent is None)
    table = [_numbers(row, number, (time, value, drive), file) for number, row in rows]
    if len(table) < MIN_SAMPLES:
        raise InputError(
            f"has {len(table)} samples; a step needs at least {MIN_SAMPLES}",
            file=file,
            mend="record one each tick, until the speed is steady",
        )
    columns = np.array(table).T
    time_s = columns[0] * TIMES[names[time]]
    drives = columns[2] if drive is not None else np.full(len(time_s), float(drive_percent or 0.0))
    for (number, _), step in zip(rows[1:], np.diff(time_s).tolist(), strict=True):
        if step <= 0.0:
            raise InputError("the time does not go on", file=file, where=f"line {number}")
    if np.abs(drives).max() > MAX_DRIVE_PERCENT or not drives.any():
        raise InputError(
            f"drives run from {drives.min():g} to {drives.max():g} %",
            file=file,
            mend=f"give percent of the full drive, at most {MAX_DRIVE_PERCENT:g}",
        )
    return MeasuredResponse(file, time_s, drives, columns[1], names[value] == "counts")


def _delimiter(text: str) -> str:
    return next((sign for sign in ";\t" if sign in text), ",")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _columns(names: Sequence[str], file: str, *, needs_drive: bool) -> tuple[int, int, int | None]:
    """Return the columns of times, of values and of drives."""
    time = next((names.index(name) for name in TIMES if name in names), None)
    value = next((names.index(name) for name in ("counts", "speed") if name in names), None)
    drive = names.index("drive") if "drive" in names else None
    if time is None or value is None or (needs_drive and drive is None):
        raise InputError(
            f"has the columns {', '.join(names)}",
            file=file,
            mend="name time_s (or time_ms), speed (or counts) and drive; --drive says a drive "
            "that is the same from the first sample on",
        )
    return time, value, drive


def _numbers(
    row: Sequence[str], number: int, columns: Sequence[int | None], file: str
) -> tuple[float, ...]:
    """Return the numbers of a row in these columns; InputError if one is not finite."""
    values = []
    for column in columns:
        if column is None:
            continue
        cell = row[column] if column < len(row) else ""
        if not _is_number(cell) or not math.isfinite(float(cell)):
            raise InputError(
                f"{cell!r} is no number" if cell else "a number is missing",
                file=file,
                where=f"line {number}, column {column + 1}",
            )
        values.append(float(cell))
    return tuple(values)


# The response of the model, in closed form between the changes of the drive.
#
# With u held, the sense s of the motion and V = gain · (u − friction · s):
#
#     ω(t) = V + (ω₀ − V) e^(−t/τ),    ∫ω = V t + (ω₀ − V) τ (1 − e^(−t/τ))
#
# until ω = 0 at τ ln(1 − ω₀/V), where the motor rests if |u| ≤ friction, and else turns back.


def respond(
    motor: MotorModel, time_s: Floats, drive: Floats, tick_s: float
) -> tuple[Floats, Floats]:
    """Return speeds (K,), counts in a tick, and counts (K,) of a motor that rests at first, at
    `time_s` (K,) ascending, for drives (K,) that are held from sample to sample."""
    speed, place = np.zeros(len(time_s)), np.zeros(len(time_s))
    changes = np.concatenate([[0], np.flatnonzero(np.diff(drive)) + 1])
    begins = [*(time_s[changes] + motor.dead_time_s).tolist(), math.inf]
    at_speed, at_place = 0.0, 0.0
    for change, (begin, end) in zip(changes.tolist(), pairwise(begins), strict=True):
        for piece_begin, piece_end, at, aim in _pieces(
            motor, float(drive[change]), begin, end, at_speed
        ):
            tau = motor.time_constant_s
            inside = (time_s >= piece_begin) & (time_s < piece_end)
            for times, is_end in ((time_s[inside], False), (np.array([piece_end]), True)):
                since = times - piece_begin
                fade = -np.expm1(-since / tau)
                speeds = at + (aim - at) * fade
                with np.errstate(invalid="ignore"):
                    places = at_place + (aim * since + (at - aim) * tau * fade) / tick_s
                if is_end:
                    at_speed, at_place = float(speeds[0]), float(places[0])
                else:
                    speed[inside], place[inside] = speeds, places
    return speed, place


def _pieces(
    motor: MotorModel, drive: float, begin: float, end: float, speed: float
) -> Iterator[tuple[float, float, float, float]]:
    """Yield (begin, end, speed at the begin, speed that it tends to) of the pieces into which the
    motion under a held drive divides, each a single exponential."""
    while True:
        sense = math.copysign(1.0, speed if speed else drive)
        rests = not speed and abs(drive) <= motor.friction_percent
        aim = 0.0 if rests else motor.gain * (drive - motor.friction_percent * sense)
        turn = math.inf
        if speed * aim < 0.0:
            turn = begin + motor.time_constant_s * math.log1p(-speed / aim)
        if turn >= end:
            yield begin, end, speed, aim
            return
        yield begin, turn, speed, aim
        begin, speed = turn, 0.0


# Identification: least squares over gain, time constant, dead time and friction.

FRICTIONS = (0.0, 5.0, 15.0, 30.0)
"""The search starts with each of these frictions, percent: the kink where a motor comes to rest
makes local minima."""

UNDETERMINED = 1e-4
"""A parameter is undetermined where the smallest singular value of the scaled derivatives is below
this part of the largest."""

PARAMETERS = ("gain", "time_constant_s", "dead_time_s", "friction_percent")


class Identification(Struct, frozen=True):
    """A motor with the standard `uncertainty` of each parameter (None: not determined);
    `residual` is the root mean square of the residuals, in the unit of the values."""

    motor: MotorModel
    uncertainty: dict[str, float | None]
    residual: float
    samples: int
    notes: tuple[str, ...]


def identify(responses: Sequence[MeasuredResponse], tick_s: float) -> Identification:
    """Identify a motor by least squares over all samples of several responses.

    The friction is determined by two drives, or by a motor that coasts to rest; otherwise it is 0,
    and the note says so. InputError for a motor that does not move."""
    start = _first_guess(responses, tick_s)
    fits = [_fit(responses, tick_s, [*start, friction]) for friction in FRICTIONS]
    best, jacobian, residuals = min(fits, key=lambda fit: float(fit[2] @ fit[2]))
    notes: list[str] = []
    scaled = jacobian * np.maximum(np.abs(best), [1e-9, 1e-9, tick_s, 1.0])
    values = np.linalg.svd(scaled, compute_uv=False)
    if values[-1] < UNDETERMINED * values[0]:
        notes.append(
            "friction is not determined by these samples and taken for 0: record a second drive, "
            "or let the motor coast to rest"
        )
        best, jacobian, residuals = _fit(responses, tick_s, start)
    freedom = len(residuals) - len(best)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * float(residuals @ residuals) / freedom
    deviations = dict(zip(PARAMETERS, np.sqrt(np.diag(covariance)).tolist(), strict=False))
    gain, tau, dead, *rest = best.tolist()
    return Identification(
        motor=MotorModel(gain, tau, rest[0] if rest else 0.0, dead),
        uncertainty={name: deviations.get(name) for name in PARAMETERS},
        residual=float(np.sqrt(np.mean(residuals**2))),
        samples=len(residuals),
        notes=tuple(notes),
    )


def _first_guess(responses: Sequence[MeasuredResponse], tick_s: float) -> list[float]:
    """Return gain, time constant and dead time from the fastest response."""
    guesses = []
    for each in responses:
        speed = each.value
        if each.is_count:
            speed = np.gradient(each.value, each.time_s) * tick_s
        fastest = int(np.argmax(np.abs(speed)))
        top, drive = float(speed[fastest]), float(each.drive[np.argmax(np.abs(each.drive))])
        if top * drive <= 0.0:
            raise InputError(
                "the motor does not move in the sense of its drive",
                file=each.file,
                mend="give speeds and drives with their signs",
            )
        rising = np.abs(speed) >= (1.0 - math.exp(-1.0)) * abs(top)
        begin = float(each.time_s[np.flatnonzero(each.drive)[0]])
        tau = max(float(each.time_s[np.argmax(rising)]) - begin, tick_s)
        guesses.append([top / drive, tau, 0.0])
    return guesses[0]


def _fit(
    responses: Sequence[MeasuredResponse], tick_s: float, start: Sequence[float]
) -> tuple[Floats, Floats, Floats]:
    """Return parameters (P,), derivatives (n, P) and residuals (n,) of the least squares."""
    from scipy.optimize import least_squares

    def residuals(values: Floats) -> Floats:
        gain, tau, dead, *rest = values.tolist()
        motor = MotorModel(gain, tau, rest[0] if rest else 0.0, dead)
        return np.concatenate([_residual(motor, each, tick_s) for each in responses])

    high = [np.inf, np.inf, np.inf, MAX_DRIVE_PERCENT][: len(start)]
    scale = np.maximum(np.abs(start), [1e-6, 1e-6, tick_s, 1.0][: len(start)])
    low = [1e-9, 1e-6, 0.0, 0.0][: len(start)]
    fitted = least_squares(residuals, start, bounds=(low, high), x_scale=scale, jac="3-point")
    return fitted.x, fitted.jac, fitted.fun


def _residual(motor: MotorModel, response: MeasuredResponse, tick_s: float) -> Floats:
    """Return the residuals (K,); counts have an arbitrary zero."""
    speed, place = respond(motor, response.time_s, response.drive, tick_s)
    if not response.is_count:
        return response.value - speed
    off = response.value - place
    off -= off.mean()
    return off


# Design by settling time and damping (L2781-2880), and what whole gains make of it.

SETTLING = 4.0
"""ts = 4 / (ζ ωn) (eq. 4.44): within 2 % of the reference."""


class LoopDesign(Struct, frozen=True):
    """The gains of an axis. `ki`, `kp` of the continuous loop, `kid`, `kpd` of the digital one;
    `stored` (kid, kpd) as the controller stores them. `wanted`, `got`: natural frequency (rad/s),
    damping and settling time (s) of the continuous loop, and of the digital loop with the stored
    gains, whose `poles` these are."""

    ki: float
    kp: float
    kid: float
    kpd: float
    stored: tuple[float, float]
    wanted: tuple[float, float, float]
    got: tuple[float, float, float]
    poles: tuple[complex, complex]


def design(motor: MotorModel, loop: SpeedLoop, settling_s: float, damping: float) -> LoopDesign:
    """Compute the gains for a settling time and a damping: Ki = ωn² τ / A, Kp = (2 ζ ωn τ − 1) / A
    (eq. 4.39, 4.40), Kid = Ki T, Kpd = Kp − Kid / 2 (eq. 4.23, 4.24).

    OptionError for a loop that is slower than the motor by itself, or unstable with stored gains.
    """
    natural = SETTLING / (damping * settling_s)
    tau, gain = motor.time_constant_s, motor.gain
    ki = natural * natural * tau / gain
    kp = (2.0 * damping * natural * tau - 1.0) / gain
    kid = ki * loop.tick_s
    kpd = kp - 0.5 * kid
    unit = loop.gain_unit
    stored = (kid / unit, kpd / unit)
    if loop.is_whole:
        stored = (float(round(stored[0])), float(round(stored[1])))
    if kp <= 0.0:
        raise OptionError(
            f"{settling_s:g} s is too slow for a motor whose own time constant is {tau:g} s: "
            f"the proportional gain would be {kp:.3g}",
            where="--settling",
            mend=f"give less than {2.0 * SETTLING * tau:.3g} s",
        )
    if kpd <= 0.0 or min(stored) <= 0.0:
        raise OptionError(
            f"the gains would be stored as {stored[0]:g} and {stored[1]:g}: the loop runs every "
            f"{loop.tick_s * 1e3:g} ms, and gains are multiples of {unit:g}",
            where="--settling",
            mend="give more time" if kpd <= 0.0 else "give less time",
        )
    poles = loop_poles(motor, loop.tick_s, stored[0] * unit, stored[1] * unit)
    if max(map(abs, poles)) >= 1.0:
        raise OptionError(
            f"the loop would be unstable with the stored gains {stored[0]:g} and {stored[1]:g}",
            where="--settling",
            mend="give more time",
        )
    return LoopDesign(
        ki=ki,
        kp=kp,
        kid=kid,
        kpd=kpd,
        stored=stored,
        wanted=(natural, damping, settling_s),
        got=_character(poles, loop.tick_s),
        poles=poles,
    )


# A step of the reference, simulated tick by tick as the controllers compute it.

SIMULATED_S = 4.0
"""Longest simulated step. A loop that is not within the band by then has not settled."""

BAND = 0.02
"""Share of the reference within which a speed has settled, as 4 / (ζ ωn) has it."""


class LoopStep(Struct, frozen=True, eq=False):
    """The answer to a step of the reference: speeds (K,), counts in a tick, and drives (K,), at
    each tick. `settling_s` is None where the speed does not settle within the band; `overshoot`
    as a share of the reference."""

    speed: Floats
    drive: Floats
    overshoot: float
    settling_s: float | None


def simulate_step(
    motor: MotorModel, loop: SpeedLoop, stored: tuple[float, float], reference: float
) -> LoopStep:
    """Simulate a step to `reference` (counts in a tick) by the law of eq. 4.27. Each tick uses the
    whole counts of the tick before; drives are limited to 0 and full drive, and cut to whole
    percent if gains are whole."""
    kid, kpd = (gain * loop.gain_unit for gain in stored)
    ticks = round(SIMULATED_S / loop.tick_s)
    speed, drives = np.zeros(ticks), np.zeros(ticks)
    integral, place, at, counts_before = 0.0, 0.0, 0.0, 0
    for tick in range(ticks):
        measured = math.floor(place) - counts_before
        counts_before = math.floor(place)
        integral += kid * (reference - measured)
        drive = min(max(integral - kpd * measured, 0.0), MAX_DRIVE_PERCENT)
        drive = float(math.floor(drive)) if loop.is_whole else drive
        drives[tick] = drive
        begin = place
        for since, until, level in _held_drives(drives, tick, motor.dead_time_s, loop.tick_s):
            for start, end, first, aim in _pieces(motor, level, since, until, at):
                duration = end - start
                fade = -math.expm1(-duration / motor.time_constant_s)
                place += (
                    aim * duration + (first - aim) * motor.time_constant_s * fade
                ) / loop.tick_s
                at = first + (aim - first) * fade
        speed[tick] = place - begin
    off = np.abs(speed - reference) > BAND * reference
    last = int(np.flatnonzero(off)[-1]) + 1 if off.any() else 0
    return LoopStep(
        speed=speed,
        drive=drives,
        overshoot=float(speed.max()) / reference - 1.0,
        settling_s=last * loop.tick_s if last < ticks else None,
    )


def _held_drives(
    drives: Floats, tick: int, late_s: float, tick_s: float
) -> Iterator[tuple[float, float, float]]:
    """Yield (begin, end, drive) s within a tick of drives that act `late_s` late."""
    late_ticks, part_s = divmod(late_s, tick_s)
    first = tick - int(late_ticks)
    if part_s > 0.0:
        yield 0.0, part_s, float(drives[first - 1]) if first > 0 else 0.0
    yield part_s, tick_s, float(drives[first]) if first >= 0 else 0.0


def loop_poles(
    motor: MotorModel, tick_s: float, kid: float, kpd: float
) -> tuple[complex, complex]:
    """Return the poles of the digital loop: the motor by zero-order hold is b / (z − a), so they
    are the zeros of (z − a)(z − 1) + b (Kpd (z − 1) + Kid z) (eq. 4.28, 4.34)."""
    a = math.exp(-tick_s / motor.time_constant_s)
    b = motor.gain * (1.0 - a)
    middle, last = -1.0 - a + b * (kpd + kid), a - b * kpd
    root = cmath.sqrt(middle * middle - 4.0 * last)
    return (-middle + root) / 2.0, (-middle - root) / 2.0


def _character(poles: tuple[complex, complex], tick_s: float) -> tuple[float, float, float]:
    """Return natural frequency, damping and settling time of two poles in z: s = ln(z) / T."""
    logs = [cmath.log(pole) / tick_s if pole else complex(-math.inf) for pole in poles]
    natural = math.sqrt(abs(logs[0]) * abs(logs[1]))
    slowest = max(each.real for each in logs)
    damping = -(logs[0] + logs[1]).real / (2.0 * natural)
    return natural, damping, SETTLING / -slowest
