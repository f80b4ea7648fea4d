"""Machine files: strict, and every complaint names file, table and key."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError
from camtool.machine.loader import build_machine, read_table
from camtool.machine.model import Machine

FILE = Path(__file__).parents[2] / "postprocessors" / "pic_mmh.toml"


def base() -> dict[str, Any]:
    return read_table(FILE)


def built(*settings: str, user: Path | None = None) -> Machine:
    return build_machine(base(), "pic_mmh.toml", user, settings)


def test_the_shipped_machine_holds_the_numbers_of_the_thesis() -> None:
    machine = built()
    assert machine.axes.x.coded_step_mm == 0.00014
    assert (machine.axes.x.travel_mm, machine.axes.y.travel_mm) == (10.0, 7.0)
    assert (machine.axes.x.backlash_mm, machine.axes.y.backlash_mm) == (0.1925, 0.1685)
    assert (machine.axes.x.compensation_mm, machine.axes.y.compensation_mm) == (0.204, 0.178)
    assert machine.max_feed_mm_min == pytest.approx(1.3944)  # 166 Hz × 140 nm × 60


def test_set_changes_one_value() -> None:
    assert built("axes.x.backlash_mm=0.2").axes.x.backlash_mm == 0.2
    assert built("controller.arcs=stairs").controller.arcs == "stairs"


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("axes.x.backlas_mm=0.2", ["table [axes.x]", "key backlas_mm", "unknown", "backlash_mm"]),
        ("axes.x.backlash_mm=wide", ["table [axes.x]", "key backlash_mm"]),
        ("axes.x.backlash_mm=-1", ["table [axes.x]", "key backlash_mm"]),
        ("axes.x.backlash_mm=nan", ["axes.x.backlash_mm", "not finite"]),
        ("axes.x.travel_mm=inf", ["axes.x.travel_mm", "not finite"]),
        ("limits.max_step_rate_hz=0", ["table [limits]", "key max_step_rate_hz"]),
        ("controller.arcs=spiral", ["table [controller]", "key arcs"]),
        ("controller.model=other", ["[controller]", "model"]),
        ("nonsense", ["--set"]),
        ("a b=1", ["--set"]),
        ("=1", ["--set"]),
    ],
)
def test_bad_settings(setting: str, words: list[str]) -> None:
    with pytest.raises(MachineError) as caught:
        built(setting)
    for word in words:
        assert word in str(caught.value)


def test_a_user_file_extends_the_target(tmp_path: Path) -> None:
    user = tmp_path / "mine.toml"
    user.write_text('extends = "pic-mmh"\n[axes.y]\nbacklash_mm = 0.05\n')
    machine = built("axes.x.backlash_mm=0.01", user=user)
    assert (machine.axes.x.backlash_mm, machine.axes.y.backlash_mm) == (0.01, 0.05)
    assert machine.axes.y.travel_mm == 7.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["extends", "--target"]),
        ('extends = "grbl"\n', ["extends", "pic-mmh"]),
        ('extends = "pic-mmh"\n[axes.q]\ntravel_mm = 1.0\n', ["table [axes]", "key q"]),
        ('extends = "pic-mmh"\n[feed]\ndefault_mm_min = "fast"\n', ["[feed]", "default_mm_min"]),
        ("extends = ", ["no TOML"]),
    ],
)
def test_bad_user_files(tmp_path: Path, text: str, words: list[str]) -> None:
    user = tmp_path / "mine.toml"
    user.write_text(text)
    with pytest.raises(MachineError) as caught:
        built(user=user)
    for word in ["mine.toml", *words]:
        assert word in str(caught.value)


def test_a_missing_key_is_named() -> None:
    table = base()
    del table["feed"]["default_mm_min"]
    with pytest.raises(MachineError, match=r"table \[feed\], key default_mm_min: key is missing"):
        build_machine(table, "pic_mmh.toml")


def test_a_missing_file_and_bytes_that_are_no_text(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match="cannot be read"):
        read_table(tmp_path / "none.toml")
    (tmp_path / "bin.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MachineError, match="UTF-8"):
        read_table(tmp_path / "bin.toml")


@given(st.text(max_size=30))
def test_any_setting_is_taken_or_refused_cleanly(text: str) -> None:
    try:
        machine = built(text)
    except MachineError:
        return
    assert isinstance(machine, Machine)
