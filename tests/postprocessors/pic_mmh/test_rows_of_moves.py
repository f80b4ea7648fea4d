"""Moves in a row read by columns, against the same program read block by block."""

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh import read
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.target.registry import load_target
from camtool.toolpath.moves import COLUMNS

COORDINATES = {
    "example": st.sampled_from(["00000.00", "-00000.00", "+01000.50", "-99999.99", "00012.30"]),
    "annex": st.sampled_from(["+00000", "-00000", "+01000", "-99999"]),
}
ODD = st.sampled_from(
    [
        *("", "G90", "G54", "M30", "G04P05", "M03S1000", "G28X0Y0", "G28Z0", "A", "BX200", "g00"),
        *("G00X00001.00", "G01X00001.00Y00002.00", "G01Z00001.00F00", "G1", "G00Z+00001F01", "G0"),
        *("G02X00001.00Y00001.00F10", "G05X00001.00Y00002.00", "G01 X00001.00Y00002.00F10"),
    ]
)


@st.composite
def programs(draw: st.DrawFn) -> tuple[str, bytes]:
    form = draw(st.sampled_from(["example", "annex"]))
    shapes = ["G00XY", "G00Z", "G01XYF", "G01ZF", "G02XYIJF", "G03XYIJF"]
    texts = []
    for _ in range(draw(st.integers(0, 12))):
        if draw(st.integers(0, 9)) == 0:
            texts.append(draw(ODD))
            continue
        shape = draw(st.sampled_from(shapes))
        words = [
            letter
            + (
                draw(st.sampled_from(["08", "13", "99"]))
                if letter == "F"
                else draw(COORDINATES[form])
            )
            for letter in shape[3:]
        ]
        texts.append(shape[:3] + "".join(words))
    ends = st.sampled_from([";", ";\n", ";\r\n", " ;\t", "; ;" if draw(st.booleans()) else ";"])
    tail = draw(st.sampled_from(["", "\n", "G00X0000", "G01X00001.00Y00001.00F10"]))
    return form, ("".join(text + draw(ends) for text in texts) + tail).encode()


def outcome(form: str, data: bytes, least_run: int, at_once: int) -> object:
    """All that the reader says of a program."""
    settings = [f"dialect.form={form}", "dialect.buffer_chars=35"]
    target = load_target("pic-mmh", settings=settings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(read, "MIN_RUN", least_run)
        patch.setattr(read, "BLOCKS_AT_ONCE", at_once)
        try:
            path = target.target.read(data, target.machine)
        except ProgramError as error:
            return str(error), error.where, error.mend
    found = [(each.code, each.where, each.message, each.measured) for each in path.findings]
    return [getattr(path, name).tobytes() for name in COLUMNS], found


@given(programs(), st.integers(1, 9))
def test_moves_in_a_row_are_read_as_blocks_are(program: tuple[str, bytes], at_once: int) -> None:
    assert outcome(*program, 1, at_once) == outcome(*program, 1 << 60, at_once)


@pytest.mark.parametrize("form", ["example", "annex"])
def test_long_programs_are_read_as_blocks_are(form: str) -> None:
    rng = np.random.default_rng(12)
    texts = ["G54;"]
    for k in range(700):
        mm = rng.uniform(-90, 90, 4)
        words = [
            f"{number * 1000:+09.2f}" if form == "example" else f"{number * 1000:+06.0f}"
            for number in mm
        ]
        x, y, i, j = words
        texts.append([f"G01X{x}Y{y}F08;", f"G02X{x}Y{y}I{i}J{j}F13;", f"G00Z{x};"][k % 3])
        texts += ["G04P01;"] * (k % 100 == 0)
    data = "\n".join([*texts, "M30;"]).encode()
    assert outcome(form, data, 24, 100) == outcome(form, data, 1 << 60, 100)
