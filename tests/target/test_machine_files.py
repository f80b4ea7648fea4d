"""Machine files: strict, and every complaint names file, table and key."""

import math
from pathlib import Path
from typing import Any

import pytest
from camtool_postprocessors.pic_mmh.dialect import PicMmhController
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError
from camtool.machine.model import Machine, PathController, controller_of
from camtool.tables import read_table
from camtool.target.loader import missing_keys, names_of
from camtool.target.registry import load_target
from tests.targets import build_machine

FILE = Path(__file__).parents[2] / "postprocessors" / "pic_mmh" / "machine.toml"


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


def needy() -> dict[str, Any]:
    table = base()
    table["needs"] = ["axes.x.coded_step_mm", "axes.y.coded_step_mm"]
    del table["axes"]["x"]["coded_step_mm"]
    return table


def test_what_only_the_user_can_say_is_asked_for() -> None:
    assert missing_keys(needy(), "pic_mmh.toml") == ("axes.x.coded_step_mm",)
    with pytest.raises(MachineError) as caught:
        build_machine(needy(), "pic_mmh.toml")
    for word in ("pic_mmh.toml", "[axes.x]", "key coded_step_mm", "missing", "--machine FILE"):
        assert word in str(caught.value)
    assert 'extends = "pic-mmh"' in str(caught.value)
    assert names_of(needy(), "pic_mmh.toml").name == "pic-mmh"


def test_what_only_the_user_can_say_is_taken_from_his_file_or_a_flag(tmp_path: Path) -> None:
    user = tmp_path / "mine.toml"
    user.write_text('extends = "pic-mmh"\n[axes.x]\ncoded_step_mm = 0.0025\n')
    assert build_machine(needy(), "a.toml", user).axes.x.coded_step_mm == 0.0025
    said = build_machine(needy(), "a.toml", None, ["axes.x.coded_step_mm=0.005"])
    assert said.axes.x.coded_step_mm == 0.005


def test_a_user_file_that_forgets_what_is_needed_is_the_one_named(tmp_path: Path) -> None:
    user = tmp_path / "mine.toml"
    user.write_text('extends = "pic-mmh"\n[axes.x]\nbacklash_mm = 0.1\n')
    with pytest.raises(MachineError, match=r"mine\.toml: table \[axes\.x\], key coded_step_mm"):
        build_machine(needy(), "a.toml", user)


@pytest.mark.parametrize("needs", ["axes", [1], {"a": 1}])
def test_needs_is_a_list_of_keys(needs: object) -> None:
    table = base() | {"needs": needs}
    with pytest.raises(MachineError, match="needs"):
        build_machine(table, "a.toml")


def test_a_step_is_as_coded_unless_said_otherwise() -> None:
    table = base()
    del table["axes"]["x"]["real_step_mm"]
    x = build_machine(table, "a.toml", None, ["axes.x.coded_step_mm=0.005"]).axes.x
    assert (x.coded_step_mm, x.real_step_mm) == (0.005, 0.005)
    with pytest.raises(MachineError, match="real_step_mm"):
        built("axes.x.real_step_mm=0")


def path_machine(**limits: float) -> dict[str, Any]:
    table = base() | {"controller": {"model": "path"}, "limits": limits}
    for axis in table["axes"].values():
        axis["coded_step_mm"] = axis["real_step_mm"] = 0.01
    return table


@pytest.mark.parametrize(
    ("limits", "rates", "feed", "plunge", "rapid"),
    [
        ({}, None, math.inf, math.inf, math.inf),
        ({"max_feed_mm_min": 100.0}, None, 100.0, 100.0, 100.0),
        ({"rapid_mm_min": 900.0}, None, math.inf, math.inf, 900.0),
        ({"max_step_rate_hz": 100.0}, None, 60.0, 60.0, 60.0),
        ({"max_step_rate_hz": 100.0, "max_feed_mm_min": 50.0}, None, 50.0, 50.0, 50.0),
        ({"rapid_step_rate_hz": 200.0, "max_feed_mm_min": 50.0}, None, 50.0, 50.0, 120.0),
        ({}, (500.0, 400.0, 80.0), 400.0, 80.0, 400.0),
        ({"max_feed_mm_min": 300.0}, (500.0, 400.0, 80.0), 300.0, 80.0, 400.0),
    ],
)
def test_the_lowest_limit_that_is_said_holds(
    limits: dict[str, float],
    rates: tuple[float, ...] | None,
    feed: float,
    plunge: float,
    rapid: float,
) -> None:
    table = path_machine(**limits)
    for axis, rate in zip(table["axes"].values(), rates or (), strict=False):
        axis["max_rate_mm_min"] = rate
    machine = build_machine(table, "a.toml")
    assert machine.max_feed_mm_min == pytest.approx(feed)
    assert machine.max_plunge_mm_min == pytest.approx(plunge)
    assert machine.rapid_mm_min == pytest.approx(rapid)


def test_a_controller_that_follows_the_path_has_a_table_of_its_own() -> None:
    machine = build_machine(path_machine(), "a.toml")
    assert isinstance(machine.controller, PathController)
    assert (machine.controller.grid, machine.controller.start_play) == ("steps", "preloaded")
    with pytest.raises(MachineError, match=r"\[controller\], key arcs: unknown.*start_play"):
        build_machine(path_machine(), "a.toml", None, ["controller.arcs=dsm"])
    with pytest.raises(MachineError, match="needs the controller pic-mmh"):
        controller_of(machine, PicMmhController)


def test_another_controller_model_leaves_the_options_of_the_first_behind(tmp_path: Path) -> None:
    table = base()
    assert table["controller"]["arcs"] == "dsm"  # which path does not know
    settings = ["controller.start_direction=-", "controller.grid=none", "controller.model=path"]
    machine = build_machine(table, "pic_mmh.toml", None, settings)
    assert machine.controller == PathController(start_direction="-", grid="none")
    user = tmp_path / "mine.toml"
    user.write_text('extends = "pic-mmh"\n[controller]\nmodel = "path"\narcs = "dsm"\n')
    with pytest.raises(MachineError, match=r"\[controller\], key arcs: unknown"):
        build_machine(table, "pic_mmh.toml", user)
    assert built("controller.arcs=dda").controller.start_direction == "+"  # nothing is lost
    assert controller_of(built("controller.model=pic-mmh"), PicMmhController).arcs == "dsm"


@pytest.mark.parametrize(
    ("target", "setting", "words"),
    [
        ("pic-mmh", "dialect.form=thesis", "use one of annex, example"),
        ("pic-mmh", "dialect.form=3", "use one of annex, example"),
        ("pic-mmh", "dialect.frm=annex", "did you mean form? known keys: "),
        ("grbl", "controller.model=grb", "did you mean grbl? use one of grbl, path"),
        ("grbl", "controller.start_play=lost", "use one of "),
    ],
)
def test_a_word_that_is_refused_names_those_that_are_known(
    target: str, setting: str, words: str
) -> None:
    with pytest.raises(MachineError) as refused:
        load_target(target, settings=[setting])
    assert words in str(refused.value)
