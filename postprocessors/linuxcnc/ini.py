"""Settings of a machine from LinuxCNC's INI file.

Keys and units are those of its manual, "INI Configuration": lengths in LINEAR_UNITS of [TRAJ],
velocities in these a second. Axes have their limits in [AXIS_X] and so on; what is a motor's, its
steps and its backlash, stands in the [JOINT_n] that the kinematics give to the axis: `trivkins`
gives joint 0 to the first letter of its `coordinates`, and so on. Other kinematics are refused."""

from __future__ import annotations

import re

from camtool.errors import MachineError
from camtool.target.contract import ControllerSetting
from camtool.units import MM_PER_UNIT

_SECTION = re.compile(r"\s*\[([^\]]+)\]")
_ENTRY = re.compile(r"\s*([A-Za-z_][\w:-]*)\s*=\s*(.*)")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

_INCH_MM = MM_PER_UNIT["in"]

_UNITS = {"mm": 1.0, "metric": 1.0, "inch": _INCH_MM, "in": _INCH_MM, "imperial": _INCH_MM}
"""mm of LINEAR_UNITS."""

_FAR_MM = 1e5
"""A limit beyond this is none."""

_ALL = "XYZABCUVW"
"""The letters of trivkins without `coordinates`."""

_KINEMATICS = "trivkins"

_SECTIONS = ("EMC", "TRAJ", "KINS", "EMCMOT")
"""Sections that other INI files do not have."""


class _Ini:
    """The entries of an INI file, the first of each name within its section, with their lines."""

    def __init__(self, text: str) -> None:
        self.entries: dict[tuple[str, str], tuple[str, int]] = {}
        self.includes, section = False, ""
        for line, row in enumerate(text.splitlines(), 1):
            heading, entry = _SECTION.match(row), _ENTRY.match(row)
            if row.lstrip().startswith((";", "#")):
                self.includes |= row.lstrip().upper().startswith("#INCLUDE")
            elif heading:
                section = heading[1].strip().upper()
            elif entry and section:
                self.entries.setdefault((section, entry[1].upper()), (entry[2].strip(), line))

    def text(self, section: str, key: str) -> str | None:
        """Return the text of an entry; None without it."""
        entry = self.entries.get((section, key))
        return None if entry is None else entry[0]

    def where(self, section: str, key: str) -> str:
        """Return the place of an entry, for messages."""
        entry = self.entries.get((section, key))
        return ("" if entry is None else f"line {entry[1]}, ") + f"[{section}] {key}"

    def number(self, section: str, key: str) -> float | None:
        """Return the number of an entry, which a comment may follow; None without the entry."""
        text = self.text(section, key)
        if text is None:
            return None
        match = _NUMBER.match(text)
        if match is None:
            raise MachineError(f"{text!r} is no number", where=self.where(section, key))
        return float(match[0])


def settings_of(text: str) -> list[ControllerSetting] | None:
    """Return the values for a machine file that an INI file contains, None for a text that is not
    an INI file; MachineError for an entry that is missing or cannot be used."""
    ini = _Ini(text)
    if not ini.includes and not any(section in _SECTIONS for section, _ in ini.entries):
        return None
    unit, joints = _unit_mm(ini), _joints(ini)
    settings: list[ControllerSetting] = []
    for letter in "XYZ":
        if letter not in joints:
            raise MachineError(
                f"there is no axis {letter}",
                where=ini.where("TRAJ", "COORDINATES"),
                mend="camtool writes programs for machines with X, Y and Z",
            )
        settings += _axis(ini, letter, f"JOINT_{joints[letter]}", unit)
    for section, key, name, factor in (
        ("EMCMOT", "SERVO_PERIOD", "controller.servo_period_s", 1e-9),
        ("TRAJ", "ARC_BLEND_OPTIMIZATION_DEPTH", "controller.lookahead_moves", 1.0),
        ("TRAJ", "ARC_BLEND_KINK_RATIO", "controller.kink_ratio", 1.0),
        ("DISPLAY", "MAX_SPINDLE_0_SPEED", "spindle.max_rpm", 1.0),
        ("DISPLAY", "MIN_SPINDLE_0_SPEED", "spindle.min_rpm", 1.0),
    ):
        value = ini.number(section, key)
        if value is not None:
            value = int(value) if name.endswith("_moves") else value * factor
            settings.append(
                ControllerSetting(name, value, f"[{section}] {key}", ini.where(section, key))
            )
    return settings


def _unit_mm(ini: _Ini) -> float:
    unit_text = ini.text("TRAJ", "LINEAR_UNITS")
    if unit_text is None:
        raise MachineError("says no unit", where="[TRAJ] LINEAR_UNITS", mend=_remedy(ini))
    word = re.split(r"[\s;#]", unit_text.lower())[0]
    if word in _UNITS:
        return _UNITS[word]
    number = ini.number("TRAJ", "LINEAR_UNITS")  # units per mm, as old files say it
    if not number or number < 0.0:
        raise MachineError(
            f"{unit_text!r} is no unit", where=ini.where("TRAJ", "LINEAR_UNITS"), mend="mm or inch"
        )
    return 1.0 / number


def _joints(ini: _Ini) -> dict[str, int]:
    """Return the first joint of each axis."""
    name, *options = (ini.text("KINS", "KINEMATICS") or _KINEMATICS).split()
    if name != _KINEMATICS:
        raise MachineError(
            f"the kinematics are {name}, whose axes have no steps and limits of their own",
            where=ini.where("KINS", "KINEMATICS"),
            mend=f"camtool knows those of {_KINEMATICS}",
        )
    letters = _ALL
    for option in options:
        key, _, value = option.partition("=")
        letters = value.upper() if key.lower() == "coordinates" else letters
    axis_text = ini.text("TRAJ", "COORDINATES")
    used_letters = letters if axis_text is None else re.split(r"[;#]", axis_text.upper())[0]
    return {letter: letters.index(letter) for letter in letters if letter in used_letters}


def _axis(ini: _Ini, letter: str, joint: str, unit: float) -> list[ControllerSetting]:
    """Return the settings of one axis."""
    axis, settings = f"AXIS_{letter}", list[ControllerSetting]()

    def add(key: str, value: float, section: str, entry: str) -> None:
        origin = f"{entry} of [{section}]" + (", from inches" if unit == _INCH_MM else "")
        place = ini.where(section, entry)
        settings.append(
            ControllerSetting(
                f"axes.{letter.lower()}.{key}", float(f"{value:.12g}"), origin, place
            )
        )

    scale = "SCALE" if ini.text(joint, "SCALE") is not None else "INPUT_SCALE"
    steps = ini.number(joint, scale)
    if steps:
        add("coded_step_mm", unit / abs(steps), joint, scale)
    low, high = _limit(ini, axis, joint, "MIN_LIMIT"), _limit(ini, axis, joint, "MAX_LIMIT")
    if low is not None and high is not None:
        if low[0] >= high[0]:
            raise MachineError(
                f"{low[0]:g} is not below MAX_LIMIT, {high[0]:g}",
                where=ini.where(low[1], "MIN_LIMIT"),
            )
        if (high[0] - low[0]) * unit < _FAR_MM:
            add("travel_mm", (high[0] - low[0]) * unit, high[1], "MAX_LIMIT")
    for entry, key, per in (
        ("MAX_VELOCITY", "max_rate_mm_min", 60.0),
        ("MAX_ACCELERATION", "acceleration_mm_s2", 1.0),
    ):
        places = [(axis, entry), (joint, entry)]
        if entry == "MAX_VELOCITY":
            places.append(("TRAJ", "MAX_LINEAR_VELOCITY"))
        origin = [(ini.number(*place), place) for place in places]
        if origin[0][0] is None and origin[1][0] is None:
            raise MachineError("is missing", where=f"[{axis}] {entry}", mend=_remedy(ini))
        value, place = min((value, place) for value, place in origin if value is not None)
        add(key, value * unit * per, *place)
    backlash = ini.number(joint, "BACKLASH")
    if backlash:
        add("compensation_mm", abs(backlash) * unit, joint, "BACKLASH")
        add("backlash_mm", abs(backlash) * unit, joint, "BACKLASH")
    return settings


def _limit(ini: _Ini, axis: str, joint: str, key: str) -> tuple[float, str] | None:
    """Return a limit of the axis, or that of its joint where the axis has none, and the section it
    stands in."""
    for section in (axis, joint):
        value = ini.number(section, key)
        if value is not None:
            return value, section
    return None


def _remedy(ini: _Ini) -> str:
    if ini.includes:
        return "put the files of #INCLUDE in their places in a copy, and give that"
    return "give the whole INI file"
