"""Settings of a machine from grbl's answer to `$$`, as a file or as it was pasted.

Each setting is a line `$110=500.000` (grbl 1.1 wiki, "Grbl v1.1 Configuration"); senders put a
prompt before it, grbl 0.9 and some senders its meaning behind it. Other lines (`ok`, the banner,
status reports) are passed over."""

from __future__ import annotations

import re

from camtool.errors import MachineError
from camtool.records import replace
from camtool.target.contract import ControllerSetting
from camtool.target.wire import Place

from .dialect import GrblController, GrblMachine

_SETTING = re.compile(r"(?<![\w$])\$(\d{1,3})\s*=\s*([^\s(,;]*)")

_AXES = {
    "coded_step_mm": 100,  # steps/mm
    "max_rate_mm_min": 110,
    "acceleration_mm_s2": 120,
    "travel_mm": 130,
}
"""Keys of an axis and their settings of X; Y and Z follow."""

_KEYS = {
    f"axes.{axis}.{key}": number + k
    for k, axis in enumerate("xyz")
    for key, number in _AXES.items()
} | {"controller.junction_deviation_mm": 11, "controller.arc_tolerance_mm": 12}
"""Settings that every listing has ..."""

FULL_SPEED, FACTORY_FULL_SPEED = 30, 1000.0
"""The setting of the speed at which the spindle gets full power, and what it is until somebody
sets it (DEFAULT_SPINDLE_RPM_MAX in defaults.h)."""

NEVER_SET = (
    "the firmware's own value, which says nothing of this spindle, and with which every speed from"
    " 1000 on is full power; set $30 to the spindle's highest speed, and max_rpm here"
)

LASER = 32

_MORE = {
    "controller.idle_delay_ms": 1,
    "spindle.max_rpm": FULL_SPEED,
    "spindle.min_rpm": 31,
    "controller.laser_mode": LASER,
}
"""... and what it may say besides."""


def settings_of(text: str) -> list[ControllerSetting] | None:
    """Return the values for a machine file that a listing of `$$` contains, None for a text
    without settings; MachineError for a setting that is missing, doubled, or not a number."""
    values: dict[int, tuple[str, int]] = {}
    for line, row in enumerate(text.splitlines(), 1):
        match = _SETTING.search(row)
        if match is None:
            continue
        number = int(match[1])
        if number in values:
            raise MachineError(
                f"is given twice, first in line {values[number][1]}",
                where=f"line {line}, ${number}",
                mend="keep one listing, that of now",
            )
        values[number] = match[2], line
    if not values:
        return None
    missing = [f"${number}" for number in _KEYS.values() if number not in values]
    if missing:
        raise MachineError(
            f"the listing is not whole: {', '.join(missing)} "
            f"{'is' if len(missing) == 1 else 'are'} missing",
            mend="give all that grbl answers to $$",
        )
    settings = [
        _setting(key, number, *values[number])
        for key, number in (_KEYS | _MORE).items()
        if number in values
    ]
    if not any(each.said == f"${LASER}" and each.value for each in settings):
        settings = [replace(each, doubt=_doubt(each)) for each in settings]
    return settings


def _doubt(setting: ControllerSetting) -> str:
    """Return why a setting may not describe a machine with a spindle; "" if it does. For a laser
    the same number is the usual full power."""
    never_set = setting.said == f"${FULL_SPEED}" and setting.value == FACTORY_FULL_SPEED
    return NEVER_SET if never_set else ""


def _setting(key: str, number: int, text: str, line: int) -> ControllerSetting:
    place = f"line {line}, ${number}"
    try:
        value = float(text)
    except ValueError:
        raise MachineError(f"{text!r} is no number", where=place) from None
    if key.endswith("coded_step_mm"):
        if value <= 0.0:
            raise MachineError(f"{text} steps/mm are none", where=place)
        return ControllerSetting(key, 1.0 / value, f"${number} = {text} steps/mm", place)
    if number == LASER:
        return ControllerSetting(key, value != 0.0, f"${number}", place)
    return ControllerSetting(key, int(value) if value.is_integer() else value, f"${number}", place)


# Comparing with the machine file, before a program is sent.

LISTED_TOLERANCE = 6e-4
"""Largest difference of equal settings: listings have three decimals."""

REPORT_INCHES = 13

LASER_IS = (
    "$32 is laser mode, in which a spindle stops in rapids and does not wait: set $32=0, or "
    "controller.laser_mode = true in the machine file"
)
LASER_IS_NOT = (
    "$32=0 is no laser mode, so that M3 burns on in rapids, but the machine file has "
    "controller.laser_mode: set $32=1"
)


def differences(text: str, machine: GrblMachine) -> tuple[list[str], list[str]]:
    """Compare a listing of `$$` with the machine file. Return the differences that would spoil the
    part or leave the travel (steps, rates, travels, arcs, units of reports), and those that change
    only times. MachineError as `settings_of`."""
    settings = {each.said.split()[0]: each for each in settings_of(text) or ()}
    if not settings:
        raise MachineError("its answer to $$ has no settings")
    errors, remarks = list[str](), list[str]()
    for axis, letter in zip(machine.axes, "xyz", strict=True):
        offset = "xyz".index(letter)
        expected = {
            "coded_step_mm": 1.0 / axis.coded_step_mm,
            "max_rate_mm_min": axis.max_rate_mm_min,
            "acceleration_mm_s2": axis.acceleration_mm_s2,
            "travel_mm": axis.travel_mm,
        }
        for key, value in expected.items():
            setting = settings[f"${_AXES[key] + offset}"]
            target_list = remarks if key == "acceleration_mm_s2" else errors
            target_list += _difference(setting, value, key == "coded_step_mm")
    if isinstance(machine.controller, GrblController):
        errors += _difference(settings["$12"], machine.controller.arc_tolerance_mm)
        remarks += _difference(settings["$11"], machine.controller.junction_deviation_mm)
        laser = settings.get(f"${LASER}")
        if laser is not None and laser.value != machine.controller.laser_mode:
            errors.append(LASER_IS if laser.value else LASER_IS_NOT)
    full_speed = settings.get(f"${FULL_SPEED}")
    if full_speed is not None and machine.spindle.switched == "program":
        errors += _difference(full_speed, machine.spindle.max_rpm)
    numbers = {int(number): value for number, value in _SETTING.findall(text)}
    if float(numbers.get(REPORT_INCHES, "0")) != 0.0:
        errors.append("$13 reports inches: set $13=0, so that places can be followed")
    return errors, remarks


NEAR_MM = 0.005
"""Largest excess over the travel that may be rounding."""


def beyond_travel(text: str, zero_mm: Place, reach_mm: tuple[Place, Place]) -> str:
    """Return why a program is certain to end in ALARM:2, from a listing and the work zero on the
    machine; "" if it is not. With soft limits ($20) grbl stays between −travel and 0 on each
    axis."""
    numbers = {int(number): float(value) for number, value in _SETTING.findall(text)}
    if not numbers.get(20):
        return ""
    for k, letter in enumerate("XYZ"):
        low, high = (each[k] + zero_mm[k] for each in reach_mm)
        travel = numbers[_AXES["travel_mm"] + k]
        if low < -travel - NEAR_MM or high > NEAR_MM:
            worst = low if low < -travel - NEAR_MM else high
            return (
                f"{letter} would go to {worst:.3f} on the machine (part zero is at "
                f"{zero_mm[k]:.3f}), beyond the soft limits of {-travel:g} to 0: move part zero, "
                f"or set ${_AXES['travel_mm'] + k} or $20"
            )
    return ""


def _difference(
    setting: ControllerSetting, expected: float | None, inverse: bool = False
) -> list[str]:
    """Return a sentence if a setting differs from the machine file, else nothing; also nothing
    where the file has no value for it."""
    value = float(setting.value)  # type: ignore[arg-type]
    shown = 1.0 / value if inverse else value
    if expected is None or abs(shown - expected) <= LISTED_TOLERANCE:
        return []
    number = setting.said.split()[0]
    return [
        f"{number} is {shown:.3f}, but {setting.key} of the machine file means {expected:.3f}: "
        "change one of the two"
    ]


# The port.

BAUD = 115200
"""grbl 1.1's rate (BAUD_RATE in its config.h)."""
