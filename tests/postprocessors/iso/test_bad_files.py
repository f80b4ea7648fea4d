"""A machine file that asks for what a dialect cannot say: file, key and mend."""

from typing import Any

import pytest

from camtool.errors import MachineError, ProgramError
from tests.postprocessors.iso.tables import machine_with

DRILL = "G98 G81 X{x} Y{y} Z{z} R{r} F{f}"


@pytest.mark.parametrize(
    ("dialect", "key", "words"),
    [
        ({"word": {}}, "word", "did you mean words"),
        ({"words": {"decimal": 3}}, "decimal", "did you mean decimals"),
        ({"words": {"decimals": 0}}, "decimals", "0 is not between 1 and 6"),
        ({"words": {"whole_letters": "XYZ"}}, "point", 'use point = "always"'),
        ({"words": {"point": "never"}}, "point", 'whole_letters = "XYZIJ"'),
        ({"words": {"point": "never", "whole_letters": "XYZIJF"}}, "whole_letters", "leave F out"),
        ({"words": {"point": "always", "whole_letters": "XX"}}, "whole_letters", "once"),
        ({"arcs": {"form": "radius"}}, "full_circles", 'full_circles = "halves"'),
        (
            {"arcs": {"form": "radius", "full_circles": "halves", "max_sweep_deg": 180.0}},
            "max_sweep_deg",
            "use 120 or less",
        ),
        ({"arcs": {"max_sweep_deg": 90.0}}, "full_circles", "turns by more than"),
        ({"arcs": {"difference_mm": 0.001}}, "difference_mm", "use 0.002, or more decimals"),
        ({"arcs": {"min_radius_mm": 50.0, "max_radius_mm": 20.0}}, "min_radius_mm", "not below"),
        ({"comments": {"characters": "()"}}, "characters", "nest"),
        ({"comments": {"characters": "!"}}, "characters", "obeyed"),
        ({"comments": {"reads": ("parentheses",)}}, "reads", "twice"),
        ({"lines": {"max_chars": 40}}, "max_chars", "use 36"),
        ({"lines": {"numbers": True, "first": 200, "highest": 100}}, "first", "above"),
        ({"lines": {"numbers": True, "digits": 6}}, "digits", "fewer digits"),
        ({"events": {"tool_change": ("T{tol} M6",)}}, "tool_change", "did you mean tool"),
        ({"events": {"tool_change": ("T1 M6",)}}, "tool_change", "0 fields"),
        ({"events": {"tool_change": ("T{tool T5",)}}, "tool_change", "a brace alone"),
        ({"events": {"tool_change": ("T{tool} T5",)}}, "tool_change", "the word T twice"),
        ({"events": {"dwell": ("G90 G91 P{s}",)}}, "dwell", "two words of the group distance"),
        ({"events": {"dwell": ("G4 P{s} (wait)",)}}, "dwell", "a comment"),
        ({"events": {"spindle_off": ("M5!",)}}, "spindle_off", "obeyed anywhere"),
        ({"events": {"flood": ("M7",)}}, "flood", "those of mist"),
        ({"events": {"spindle_ccw": ("S{rpm} M3",)}}, "spindle_ccw", "those of spindle_cw"),
        ({"events": {"spindle_cw": ("M3 S{pwm}",)}}, "spindle_cw", "could not tell"),
        ({"events": {"message": "(MSG)"}}, "message", "{text}"),
        ({"events": {"message": "((MSG,{text}))"}}, "message", "nests"),
        ({"events": {"message": "(MSG,{text}"}}, "message", "does not end"),
        ({"cycles": {"use": True}}, "drill", "no template"),
        ({"cycles": {"drill": "X{x} Y{y} Z{z} R{r} F{f}"}}, "drill", "G73 to G89"),
        ({"cycles": {"drill": DRILL, "bore": DRILL}}, "bore", "is drill already"),
        ({"cycles": {"drill": "G81 X{x} Y{y} Z{z} F{f}"}}, "drill", "lacks {r}"),
        ({"cycles": {"drill": "G81 Y{x} X{y} Z{z} R{r} F{f}"}}, "drill", "another letter"),
        ({"cycles": {"use": True, "drill": DRILL, "end": ""}}, "end", "G80"),
        (
            {"feeds": {"mode": "inverse-time"}, "cycles": {"use": True, "drill": DRILL}},
            "use",
            "use = false",
        ),
        (
            {"feeds": {"mode": "inverse-time", "rapids": "programmed"}},
            "rapids",
            'use mode = "per-minute"',
        ),
        ({"program": {"head": ("G17 G20 G90 {feeds}",)}}, "head", "the units"),
        ({"program": {"head": ("{units} G91",)}}, "head", "relative coordinates"),
        ({"program": {"head": ("{units} G95",)}}, "head", "the mode of feeds"),
        ({"program": {"head": ("{units} G18",)}}, "head", "plane"),
        ({"program": {"head": ("{units}", "G1 X5 F100")}}, "head", "cut"),
        ({"program": {"head": ("{units}", "M30")}}, "head", "end the program"),
        ({"program": {"foot": ("M30",)}}, "foot", "end the program"),
        ({"program": {"foot": ("G41",)}}, "foot", "the radius of the tool"),
        ({"program": {"never": ("G1",)}}, "never", "every program"),
        ({"program": {"never": ("M6",)}}, "tool_change", "one of program.never"),
        ({"program": {"never": ("G92",), "passed_over": ("G92",)}}, "passed_over", "decide"),
    ],
)
def test_a_wrong_table_is_named(dialect: dict[str, Any], key: str, words: str) -> None:
    with pytest.raises(MachineError) as caught:
        machine_with(dialect)
    said = str(caught.value)
    assert f"key {key}" in said
    assert words in said
    assert "made-up" in said


def test_coolant_that_no_block_switches() -> None:
    with pytest.raises(MachineError, match=r"key flood: the machine has flood coolant"):
        machine_with({"events": {"flood": ()}}, coolant={"flood": True})


@pytest.mark.parametrize(
    ("program", "dialect", "where", "words"),
    [
        ("G1 X1 F100 (a (b))", {}, "line 1, column 12", "a comment within a comment"),
        ("G1 X1 F100 (a", {}, "line 1, column 12", "does not end"),
        ("G1 X1 F100 ; a", {}, "line 1, column 12", "does not write so"),
        ("G1 X1 X2 F100", {}, "line 1, column 7", "X twice"),
        ("G1 G2 X1 F100", {}, "line 1, column 4", "G2 beside G1"),
        ("G1 X1 F100 P2", {}, "line 1, column 12", "P has nothing to do"),
        ("G1 X F100", {}, "line 1, column 4", "no number behind X"),
        ("G1 X#5 F100", {}, "line 1, column 4", "no number behind X"),
        ("G5 X1", {}, "line 1, column 1", "G5 is no word of this dialect"),
        ("M98 P5", {}, "line 1, column 1", "M98 is no word"),
        ("G1 X1", {}, "line 1, column 1", "no feed"),
        ("X1", {}, "line 1, column 1", "no motion"),
        ("G2 X2 I1.1 F100", {}, "line 1, column 1", "differ by 0.2 mm"),
        ("G2 X2 R0.9 F100", {}, "line 1, column 7", "less than half the way"),
        ("G2 I1 F100", {"arcs": {"full_circles": "halves"}}, "line 1, column 1", "two arcs"),
        ("G2 X2 I1 F100", {"arcs": {"form": "chords"}}, "line 1, column 1", "no arcs"),
        ("G2 X2 I1 Z-1 F100", {"arcs": {"helices": False}}, "line 1, column 1", "no helices"),
        ("G81 X1 Y1 Z-1 R1 F9", {}, "line 1, column 1", "without a template"),
        ("G41 D1", {}, "line 1, column 1", "the radius of the tool"),
        ("G92 X0", {"program": {"never": ("G92",)}}, "line 1, column 1", "must not appear"),
        ("G4 X1", {}, "line 1, column 1", "G4 without its time"),
        ("G0 X1\nG55\nG0 X2", {}, "line 2, column 1", "places only the controller knows"),
        ("G0 X1 " + 300 * "0", {}, "line 1, column 257", "more than 256 characters"),
    ],
)
def test_a_wrong_program_is_named(
    program: str, dialect: dict[str, Any], where: str, words: str
) -> None:
    loaded = machine_with(dialect)
    with pytest.raises(ProgramError) as caught:
        loaded.target.read(program.encode(), loaded.machine)
    assert where in str(caught.value)
    assert words in str(caught.value)
