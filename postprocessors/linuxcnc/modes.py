"""The modes as a whole: M70 to M73, which save them and bring them back, and the names by which
expressions ask for them (`#<_feed>`).

LinuxCNC writes a block of the modes that differ and executes it, so that a feed comes back with
one decimal and a speed with none (gen_settings, interp_convert.cc). M73 brings them back when its
sub ends."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from msgspec import Struct

from camtool.toolpath.moves import Kind

from ..gcode.faults import LineFault
from .frames import FRAMES, FrameCodes
from .lines import LinuxcncBlock, ParsedLine
from .state import InterpreterState

Execute = Callable[[LinuxcncBlock], None]


class ActiveModes(Struct, frozen=True):
    """G codes (tenfold) in force by group, M words, feed, speed and tolerances of the path."""

    g: dict[str, int]
    m: dict[str, int | None]
    feed: float
    speed: float
    tolerances: tuple[float, float]


def obey(machine: InterpreterState, code: int, execute: Execute) -> None:
    """Execute M70 (save the modes), M71 (forget them), M72 (restore them) or M73 (save them until
    the sub ends)."""
    call = machine.calls[-1]
    if code in (70, 73):
        call.saved = modes_of(machine)
        call.restores = call.restores or (code == 73 and len(machine.calls) > 1)
    elif code == 71:
        call.saved = None
    elif call.saved is None:
        raise LineFault("M72 without M70 before it", "m")
    else:
        restore(machine, call.saved, execute)


def restore(machine: InterpreterState, saved: ActiveModes, execute: Execute) -> None:
    """Execute the blocks that restore saved modes."""
    units = saved.g["units"]
    if modes_of(machine).g["units"] != units:
        execute(_block(machine, f"g{units // 10}"))
    present = modes_of(machine)
    words = []
    if saved.feed != present.feed:
        words.append(f"f{saved.feed:.1f}")
    if saved.speed != present.speed:
        words.append(f"s{saved.speed:.0f}")
    for group, code in saved.g.items():
        if group not in ("units", "path") and code != present.g[group]:
            words.append(f"g{code / 10:g}")
    path = saved.g["path"]
    if path == 640 and (present.g["path"] != 640 or saved.tolerances != present.tolerances):
        words.append("g64 p{:f} q{:f}".format(*saved.tolerances))
    elif path != present.g["path"]:
        words.append(f"g{path / 10:g}")
    texts = [f"m{code}" for group, code in saved.m.items() if code not in (None, present.m[group])]
    for k, text in enumerate(texts or [""]):
        execute(_block(machine, " ".join([*words, text]) if k == 0 else text))


def _block(machine: InterpreterState, text: str) -> LinuxcncBlock:
    return ParsedLine(text).block(machine.given)


def spindle_word(kind: Kind | None) -> int:
    """Return the M word for a direction of the spindle, or for a stopped one."""
    return 5 if kind is None else 3 if kind == Kind.SPINDLE_CW else 4


def modes_of(state: InterpreterState) -> ActiveModes:
    """Return the modes in force."""
    side = state._compensation.side if state._compensation is not None else 0
    frame = next(code for code, number in FRAMES.items() if number == state._frame)
    g = {
        "plane": state.plane,
        "cutter radius": {1: 410, -1: 420}.get(side, 400),
        "units": 210 if state.canon.mm == 1.0 else 200,
        "distance": 900 if state.absolute else 910,
        "feed mode": state.feed_mode,
        "work frame": frame,
        "tool length": 430 if any(state._tool_offset) else 490,
        "return mode": 990 if state.to_r else 980,
        "path": state._control,
        "spindle mode": state._spindle_mode,
        "arc distance": 901 if state.absolute_centres else 911,
        "lathe diameter": 70 if state.diameters else 80,
        "axis offsets": 923 if state.given.stored_value(5210) else 922,
    }
    m = {
        "spindle": spindle_word(state.spindle),
        "mist": 7 if state._mist else None if state._flood else 9,
        "flood": 8 if state._flood else None,
    }
    return ActiveModes(g, m, state.feed_mm / state.canon.mm, state.speed, state._tolerances)


def names_of(state: FrameCodes) -> dict[str, Callable[[], float]]:
    """Return the names that show the modes (interp_namedparams.cc)."""

    def matches_mode(name: str, value: Any) -> Callable[[], float]:
        return lambda: float(getattr(state, name) == value)

    def machine(axis: int) -> Callable[[], float]:
        return lambda: state._on_machine()[axis] + state._tool_offset[axis]

    frame = {number: code for code, number in FRAMES.items()}
    names: dict[str, Callable[[], float]] = {
        "_line": lambda: float(state.given.line),
        "_motion_mode": lambda: -1.0 if state.motion is None else float(state.motion),
        "_plane": lambda: float(state.plane),
        "_ccomp": lambda: {1: 410.0, -1: 420.0}.get(
            state._compensation.side if state._compensation else 0, 400.0
        ),
        "_metric": lambda: float(state.canon.mm == 1.0),
        "_imperial": lambda: float(state.canon.mm != 1.0),
        "_absolute": matches_mode("absolute", True),
        "_incremental": matches_mode("absolute", False),
        "_inverse_time": matches_mode("feed_mode", 930),
        "_units_per_minute": matches_mode("feed_mode", 940),
        "_units_per_rev": matches_mode("feed_mode", 950),
        "_coord_system": lambda: float(frame[state._frame]),
        "_tool_offset": lambda: float(any(state._tool_offset)),
        "_retract_r_plane": matches_mode("to_r", True),
        "_retract_old_z": matches_mode("to_r", False),
        "_spindle_rpm_mode": matches_mode("_spindle_mode", 970),
        "_spindle_css_mode": matches_mode("_spindle_mode", 960),
        "_ijk_absolute_mode": matches_mode("absolute_centres", True),
        "_lathe_diameter_mode": matches_mode("diameters", True),
        "_lathe_radius_mode": matches_mode("diameters", False),
        "_spindle_on": lambda: float(state.spindle is not None),
        "_spindle_cw": matches_mode("spindle", Kind.SPINDLE_CW),
        "_mist": matches_mode("_mist", True),
        "_flood": matches_mode("_flood", True),
        "_speed_override": lambda: 1.0,
        "_feed_override": lambda: 1.0,
        "_adaptive_feed": lambda: 0.0,
        "_feed_hold": lambda: 0.0,
        "_feed": lambda: state.feed_mm / state.canon.mm,
        "_rpm": lambda: abs(state.speed),
        "_current_tool": lambda: float(state._loaded),
        "_current_pocket": lambda: float(state._loaded),
        "_selected_tool": lambda: float(-1 if state._tool is None else state._tool),
        "_selected_pocket": lambda: float(-1 if state._tool is None else state._tool),
        "_metric_machine": lambda: float(state._user_mm == 1.0),
        "_vmajor": lambda: 2.9,
        "_vminor": lambda: 0.0,
        "_task": lambda: 1.0,
        "_remap_level": lambda: 0.0,
    }
    for axis, letter in enumerate("xyz"):
        names[f"_{letter}"] = partial(state.position.__getitem__, axis)
        names[f"_abs_{letter}"] = machine(axis)
    for letter in "abc":
        names[f"_{letter}"] = names[f"_abs_{letter}"] = partial(state.others.__getitem__, letter)
    for letter in "uvw":
        names[f"_{letter}"] = lambda: 0.0
    return names
