"""Random tables of dialects, as a machine file would have them: all that they say together is
valid, or the loader says which key is not."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from camtool.target.registry import LoadedTarget, loaded_target

BOOLS = st.booleans()
ALL = st.sampled_from(["change", "all"])
SPINDLES = (
    ("S{rpm} M3", "S{rpm} M4", "M5"),
    ("M3 S{percent}", "M4 S{percent}", "M5"),
    ("M106 P1 S{pwm}", "M106 P2 S{pwm}", "M107"),
    ("SET_SPINDLE CW=1 SPEED={rpm}", "SET_SPINDLE CW=0 SPEED={rpm}", "STOP_SPINDLE"),
)
DWELLS = ("G4 P{s}", "G4 P{ms}", "G4 X{s}", "G4 S{s}", "G04 U{s}")
CHANGES = (
    ("T{tool} M6",),
    ("T{tool}",),
    ("M5", "T{tool} M6", "G43 H1"),
    ("M9", "G53 G0 Z0", "T{tool}", "M0"),
    ("CHANGE_TOOL TOOL={tool}",),
)


def as_toml(value: Any) -> Any:
    """Tuples as lists, as TOML reads them."""
    if isinstance(value, dict):
        return {key: as_toml(each) for key, each in value.items()}
    return [as_toml(each) for each in value] if isinstance(value, tuple) else value


@st.composite
def tables(draw: st.DrawFn) -> dict[str, Any]:
    """The `[dialect]` of a machine file."""
    form = draw(st.sampled_from(["offsets", "centre", "radius", "chords"]))
    decimals = draw(st.integers(2, 5))
    point = draw(st.sampled_from(["always", "needed", "never"]))
    whole = {"needed": "", "never": "XYZIJKRQ"}.get(point) or draw(
        st.sampled_from(["", "XYZIJKRQF", "XYZR", "F"]) if point == "always" else st.just("")
    )
    mode = draw(st.sampled_from(["per-minute", "per-minute", "per-revolution", "inverse-time"]))
    sweep = draw(st.sampled_from([None, 90.0, 120.0]))
    halves = form == "radius" or sweep is not None or draw(BOOLS)
    clockwise, counter, off = draw(st.sampled_from(SPINDLES))
    style = draw(st.sampled_from(["parentheses", "semicolon", "none"]))
    messages = {
        "parentheses": ["", "(MSG,{text})", "M0 ({text})", "M117 {text}"],
        "semicolon": ["", "M117 {text}", 'M291 P"{text}" S1'],
        "none": ["", "M117 {text}"],
    }
    with_cycles = mode != "inverse-time" and draw(BOOLS)
    arcs: dict[str, Any] = {
        "form": form,
        "full_circles": "halves" if halves else "whole",
        "helices": draw(BOOLS),
        "min_radius_mm": draw(st.sampled_from([0.0, 0.001, 0.5])),
        "max_radius_mm": draw(st.sampled_from([20.0, 1e4])),
        "difference_mm": 5.0 * 25.4 * 10.0**-decimals,
    }
    if sweep is not None:
        arcs["max_sweep_deg"] = sweep
    dialect: dict[str, Any] = {
        "words": {
            "decimals": decimals,
            "inch_decimals": draw(st.integers(decimals, decimals + 2).filter(lambda n: n <= 6)),
            "trailing_zeros": draw(BOOLS),
            "leading_zero": draw(BOOLS),
            "plus_sign": draw(BOOLS),
            "point": point,
            "whole_letters": whole,
            "code_digits": draw(st.integers(1, 2)),
            "blanks": draw(BOOLS),
            "motion": draw(ALL),
            "coordinates": draw(ALL),
            "feed": draw(ALL),
        },
        "lines": {
            "end": draw(st.sampled_from(["lf", "crlf", "cr"])),
            "numbers": draw(BOOLS),
            "first": draw(st.sampled_from([0, 1, 10])),
            "step": draw(st.sampled_from([1, 5, 10])),
            "digits": draw(st.integers(1, 4)),
            "highest": draw(st.sampled_from([9999, 99_999_999])),
        },
        "comments": {
            "style": style,
            "show": draw(st.sampled_from(["contours", "operations", "header", "none"])),
            "max_chars": draw(st.integers(8, 60)),
            "upper_case": draw(BOOLS),
            "characters": draw(st.sampled_from(["", ".-", "._+:/=-"])),
        },
        "program": {
            "units": draw(st.sampled_from(["mm", "in"])),
            "frame": draw(st.sampled_from(["", "%"])),
            "head": draw(
                st.sampled_from(
                    [
                        ("G17 {units} G90 {feeds}",),
                        ("O{number}", "{units}", "{feeds} G17 G40 G49 G80 G90"),
                        ("{units}", "G187 P1", "M97 P5"),
                        ("{units}", "G53 G0 Z0"),
                    ]
                )
            ),
            "foot": draw(st.sampled_from([(), ("M9",), ("G91 G28 Z0", "G90"), (off,)])),
            "end": draw(st.sampled_from(["M2", "M30", ""])),
            "retract": draw(BOOLS),
            "never": ("G92",),
        },
        "feeds": {
            "mode": mode,
            "decimals": draw(st.integers(4, 6)),
            "rapids": draw(st.sampled_from(["own", "programmed"]))
            if mode == "per-minute"
            else "own",
        },
        "arcs": arcs,
        "events": {
            "spindle_cw": (clockwise,),
            "spindle_ccw": (counter,),
            "spindle_off": (off,),
            "dwell": (draw(st.sampled_from(DWELLS)),),
            "tool_change": draw(st.sampled_from(CHANGES)),
            "message": draw(st.sampled_from(messages[style])),
            "mount_messages": draw(BOOLS),
            "rpm_decimals": draw(st.integers(1, 3)),
        },
        "cycles": {
            "use": with_cycles,
            "drill": "G98 G81 X{x} Y{y} Z{z} R{r} F{f}",
            "dwell": "G98 G82 X{x} Y{y} Z{z} R{r} P{ms} F{f}",
            "peck": draw(st.sampled_from(["", "G98 G83 X{x} Y{y} Z{z} R{r} Q{q} F{f}"])),
            "again": draw(st.sampled_from(["", "X{x} Y{y}"])),
        },
    }
    return dialect


def machine_with(dialect: dict[str, Any], **tables: Any) -> LoadedTarget:
    """The target of a machine file with this dialect."""
    user = {
        "extends": "iso",
        "target": {"name": "made-up", "title": "made up"},
        "spindle": {"max_rpm": 24000.0},
        "dialect": as_toml(dialect),
        **tables,
    }
    return loaded_target("iso", (user, "made-up.toml"))
