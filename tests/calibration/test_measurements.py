"""Files of measurements that cannot be meant are refused, with file, key and mend."""

from __future__ import annotations

from pathlib import Path

import pytest

from camtool.calibration.calibrate import calibrate
from camtool.calibration.measurements import read_measurements
from camtool.errors import InputError
from camtool.target.registry import load_target

LINES = '[[lines]]\naxis = "x"\nnominal_mm = 2.5\n'
SQUARE = "[[squares]]\nnominal_mm = [2.5, 2.5]\n"
CIRCLE = '[[circles]]\nnominal_mm = 4.0\ndirection = "ccw"\n'
STEPS = '[[steps]]\naxis = "z"\nnominal_mm = [8.0, 16.0]\n'
CELLS = "[regions.x]\nx_mm = [0.0, 5.0, 10.0]\ny_mm = [0.0, 7.0]\n"


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("", None, "camtool coupon"),
        ("x = [", None, "is no TOML"),
        ("lines = 3", "key lines", "array"),
        ("[[line]]", "key line", "unknown key"),
        ("uncertainty_mm = -1.0\n" + LINES, "key uncertainty_mm", "not between"),
        ("uncertainty_mm = nan\n" + LINES, "key uncertainty_mm", "not finite"),
        (LINES, None, "nothing was measured"),
        (LINES + "first_mm = 0.0\nsecond_mm = 0.0\n" + SQUARE, None, "nothing was measured"),
        (LINES + "first_mm = 2509.0\n", "[[lines]] 1, key first_mm", "µm"),
        (LINES + "first_mm = 0.0985\n", "[[lines]] 1, key first_mm", "inches"),
        (LINES + "first_mm = 0.25\n", "[[lines]] 1, key first_mm", "cm"),
        (LINES + "first_mm = -2.5\n", "[[lines]] 1, key first_mm", "not between"),
        (LINES + "shorter_by_mm = 190.0\n", "[[lines]] 1, key shorter_by_mm", "write it in mm"),
        (
            LINES + "second_mm = 2.3\nshorter_by_mm = 0.2\n",
            "[[lines]] 1, key shorter_by_mm",
            "leave one",
        ),
        (LINES + "first = 2.5\n", "[[lines]] 1, key first", "known keys: source"),
        (LINES.replace('"x"', '"z"') + "first_mm = 2.5\n", "[[lines]] 1, key axis", "z"),
        (
            LINES.replace("2.5", "-2.5") + "first_mm = 2.5\n",
            "[[lines]] 1, key nominal_mm",
            "not between",
        ),
        (
            LINES.replace("2.5", "inf") + "first_mm = 2.5\n",
            "[[lines]] 1, key nominal_mm",
            "finite",
        ),
        (LINES + 'first_mm = "2.5"\n', "[[lines]] 1, key first_mm", "str"),
        (SQUARE + "dx_mm = 25.0\n", "[[squares]] 1, key dx_mm", "10 times"),
        (SQUARE + "diagonals_mm = [3.5, 9.9]\n", "[[squares]] 1, key diagonals_mm", "2.8 times"),
        (SQUARE + "diagonals_mm = [3.5]\n", "[[squares]] 1, key diagonals_mm", "length 2"),
        (CIRCLE, "[[circles]] 1, key diameters_mm", "missing"),
        (
            CIRCLE + "diameters_mm = [4.0, 4.0]\nangles_deg = [0.0]\n",
            "[[circles]] 1, key angles_deg",
            "1 angles for 2",
        ),
        (CIRCLE.replace("ccw", "left") + "diameters_mm = [4.0]\n", "key direction", "left"),
        (STEPS + "forward_mm = [8.0]\n", "[[steps]] 1, key forward_mm", "1 readings for 2"),
        (STEPS + "backward_mm = [8.0, 99.0]\n", "[[steps]] 1, key backward_mm", "far beyond"),
        (
            "[[closures]]\nnominal_mm = [10.0, 5.0]\ngap_y_mm = 6.0\n",
            "[[closures]] 1, key gap_y_mm",
            "write it in mm",
        ),
        ("[[closures]]\nnominal_mm = [10.0, 5.0]\n", None, "nothing was measured"),
        (
            CELLS
            + 'names = [["A", "B"]]\n'
            + LINES
            + 'first_mm = 2.5\nregion = "A"\n'
            + LINES
            + 'first_mm = 0.0\nregion = "B"\n',
            "table [regions.x], key names",
            "no coupon of x was measured in the region 'B'",
        ),
        (
            CELLS + 'names = [["A"]]\n' + LINES + "first_mm = 2.5\n",
            "table [regions.x], key names",
            "1 rows",
        ),
        (
            CELLS + 'names = [["A", "B"]]\n' + LINES + 'first_mm = 2.5\nregion = "A"\n',
            "table [regions.x], key names",
            "'B'",
        ),
        (
            CELLS.replace("5.0", "15.0") + 'names = [["A", "B"]]\n' + LINES + "first_mm = 2.5\n",
            "table [regions.x], key x_mm",
            "ascending",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused(
    tmp_path: Path, text: str, where: str | None, words: str
) -> None:
    file = tmp_path / "m.toml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_measurements(file)
    assert caught.value.file == str(file)
    assert where is None or where in str(caught.value.where), caught.value.where
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_of_another_machine_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text('target = "valcnc"\n' + LINES + "first_mm = 2.5\n")
    with pytest.raises(InputError, match=r"measured on valcnc, not on grbl"):
        calibrate(read_measurements(file), load_target("grbl").machine)


def test_exchanged_lines_are_a_play_that_no_machine_has(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text(LINES + "first_mm = 2.3\nsecond_mm = 2.5\n")
    with pytest.raises(InputError, match=r"play of x comes out as -0.2 mm.*exchanged"):
        calibrate(read_measurements(file), load_target("grbl").machine)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_measurements(tmp_path / "none.toml")


def test_tables_of_zeros_are_coupons_that_were_not_measured(tmp_path: Path) -> None:
    measured = LINES + "first_mm = 2.502\nsecond_mm = 2.41\n"
    zeros = (
        LINES + "first_mm = 0.0\nsecond_mm = 0.0\n",
        SQUARE + "dx_mm = 0.0\ndy_mm = 0.0\ndiagonals_mm = [0.0, 0.0]\n",
        CIRCLE + "diameters_mm = [0.0, 0.0]\n",
        STEPS + "forward_mm = [0.0, 0.0]\nbackward_mm = [0.0, 0.0]\n",
        "[[closures]]\nnominal_mm = [10.0, 5.0]\n",
    )
    machine = load_target("pic-mmh").machine
    found = []
    for text in (measured, measured + "".join(zeros)):
        (tmp_path / "m.toml").write_text(text)
        found.append(calibrate(read_measurements(tmp_path / "m.toml"), machine).estimates)
    assert found[0] == found[1]
    (tmp_path / "m.toml").write_text(LINES + "shorter_by_mm = 0.0\n")
    assert len(read_measurements(tmp_path / "m.toml").coupons) == 1, "no play is a result"
