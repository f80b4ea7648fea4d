"""The comparison with golden programs fails when it should."""

from pathlib import Path

import pytest

from tests.postprocessors.golden import compare_golden


@pytest.mark.parametrize(
    ("held", "written"),
    [(b"G54;\n", b"G90;\n"), (b"G0 X1.000\n", b"G0 X1.001\n"), (b"\x13\x01", b"\x13\x02")],
)
def test_a_changed_byte_fails(held: bytes, written: bytes, tmp_path: Path) -> None:
    file = tmp_path / "program"
    file.write_bytes(held)
    compare_golden(file, held, bless=False)
    with pytest.raises(AssertionError):
        compare_golden(file, written, bless=False)
    assert file.read_bytes() == held


def test_a_missing_file_fails_and_is_not_made(tmp_path: Path) -> None:
    file = tmp_path / "program"
    with pytest.raises(pytest.fail.Exception, match="--bless"):
        compare_golden(file, b"G54;\n", bless=False)
    assert not file.exists()


def test_blessing_writes_the_file(tmp_path: Path) -> None:
    file = tmp_path / "program"
    compare_golden(file, b"\x13\x01", bless=True)
    assert file.read_bytes() == b"\x13\x01"
