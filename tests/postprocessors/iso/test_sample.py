"""A machine file from a sample program: what the program shows, what is asked, what is read."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.iso.sample import sampled_dialect
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError, ProgramError
from camtool.tables import parse_table
from camtool.target.registry import load_target as load
from camtool.target.registry import loaded_target, own_target_of, shipped_files
from camtool.target.template import machine_template
from tests.postprocessors.gcode.parts import part
from tests.strategies import examples

ON_ISO = sorted(name for name in shipped_files() if own_target_of(name) == "iso")

SAMPLE = b"""%
O0042 (BRACKET)
N0010 G17 G20 G90 G94 G54
N0020 T3 M06
N0030 G43 H3
N0040 S1200 M03
N0050 G00 X.5 Y0. Z.1
N0060 G04 P500
N0070 G01 Z-.25 F4.5
N0080 G02 X1.5 Y0. I1. J0.
N0090 G03 X.5 Y0. I1. J0.
N0100 G00 Z.1
N0110 M05
N0120 G91 G28 Z0.
N0130 G90
N0140 M30
%
"""


def said(data: bytes) -> dict[str, Any]:
    return {each.key: each.value for each in sampled_dialect(data).settings}


def test_what_a_program_shows() -> None:
    keys = said(SAMPLE)
    assert keys["dialect.program.frame"] == "%"
    assert keys["dialect.program.units"] == "in"
    assert keys["dialect.program.head"] == ["G17 {units} G90 {feeds} G54"]
    assert keys["dialect.program.foot"] == ["G91 G28 Z0.", "G90"]
    assert keys["dialect.program.end"] == "M30"
    assert (keys["dialect.lines.first"], keys["dialect.lines.step"]) == (10, 10)
    assert keys["dialect.lines.digits"] == 4
    assert keys["dialect.words.code_digits"] == 2
    assert keys["dialect.words.leading_zero"] is False
    assert keys["dialect.words.trailing_zeros"] is False
    assert keys["dialect.words.point"] == "always"
    assert keys["dialect.words.inch_decimals"] == 4
    assert keys["dialect.words.motion"] == "all"
    assert keys["dialect.arcs.helices"] is False
    assert keys["dialect.events.tool_change"] == ["T{tool} M6", "G43 H{tool}"]
    assert keys["dialect.events.spindle_cw"] == ["S{rpm} M3"]
    assert keys["dialect.events.dwell"] == ["G4 P{ms}"]
    assert keys["feed.unit_mm_min"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("blocks", "form"),
    [
        (b"G0 X0 Y0\nG2 X2.0 Y0 I1.0 J0 F9\n", "offsets"),
        (b"G0 X5.0 Y0\nG2 X7.0 Y0 I6.0 J0 F9\n", "centre"),
        (b"G0 X5.0 Y0\nG2 X7.0 Y0 R1.0 F9\n", "radius"),
    ],
)
def test_arcs_are_told_apart_by_their_geometry(blocks: bytes, form: str) -> None:
    # A first arc from part zero fits both, and so says nothing.
    assert said(b"G0 X1.5 Y1.5\n" + blocks).get("dialect.arcs.form", "offsets") == form


def test_what_it_leaves_open_is_asked() -> None:
    questions = {each.key for each in sampled_dialect(b"G0 X1.5\nG1 X2.5 F9\n").questions}
    assert {"dialect.arcs.form", "dialect.comments.style", "dialect.events.dwell"} <= questions
    assert sampled_dialect(b"").questions


@pytest.mark.parametrize("name", ON_ISO)
def test_a_file_made_of_a_program_reads_it_alike(name: str) -> None:
    shipped = load(name)
    path = part(tools=True)
    left_out = {"HOME_XY", "HOME_Z"}  # where machine zero is, no program shows
    if not shipped.machine.dialect.events.spindle_ccw:  # type: ignore[attr-defined]
        left_out.add("SPINDLE_CCW")
    rows = [k for k, move in enumerate(path) if move.kind.name not in left_out]
    path = path.picked(np.array(rows))
    data = shipped.target.write(path, shipped.machine).data
    settings = sampled_dialect(data).settings
    base = Path("postprocessors/iso/machine.toml").read_text(encoding="utf-8")
    text = machine_template("mine", "iso", base, (), settings)
    mine = loaded_target("iso", (parse_table(text), "mine.toml"))
    one, other = mine.target.read(data, mine.machine), shipped.target.read(data, shipped.machine)
    kept = [(move.kind, move.end) for move in one if move.kind.name in ("RAPID", "LINE")]
    wanted = [(move.kind, move.end) for move in other if move.kind.name in ("RAPID", "LINE")]
    assert kept == wanted


@pytest.mark.parametrize("data", [b"\n", b"hello", b"<svg/>", b"G90\nM30\n", b"\x00\xff" * 99])
def test_what_is_no_program_is_refused(data: bytes) -> None:
    with pytest.raises(ProgramError, match="no move such as G1 X1"):
        sampled_dialect(data)


WORDS = st.sampled_from(list("GMXYZIJKRFSTHPQN()%;O0123456789.+- \n\r"))


@examples(150, 10_000)
@given(st.binary(max_size=200) | st.lists(WORDS, max_size=120).map("".join).map(str.encode))
def test_anything_is_a_dialect_or_refused(data: bytes) -> None:
    try:
        sampled = sampled_dialect(data)
    except ProgramError:
        return
    base = Path("postprocessors/iso/machine.toml").read_text(encoding="utf-8")
    text = machine_template("mine", "iso", base, (), sampled.settings)
    with suppress(MachineError):  # a head of anything may be no head; it is named
        loaded_target("iso", (parse_table(text), "mine.toml"))
