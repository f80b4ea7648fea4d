"""Play by region, squareness and scatter in a machine file: what holds, and what is refused."""

from pathlib import Path

import pytest

from camtool.errors import MachineError
from camtool.machine.model import Machine
from camtool.tables import read_table
from tests.targets import build_machine

FILE = Path(__file__).parents[2] / "postprocessors" / "pic_mmh" / "machine.toml"


def built(*settings: str) -> Machine:
    return build_machine(read_table(FILE), "pic_mmh.toml", None, settings)


def test_the_regions_of_the_thesis_ship_and_wait_to_be_used() -> None:
    """L2353-2373; the means are what holds until then."""
    machine = built()
    x, y = machine.play_map.x, machine.play_map.y
    assert x is not None
    assert y is not None
    assert x.play_mm == ((0.190, 0.201, 0.187),)
    assert y.play_mm == ((0.152,), (0.180,), (0.173,))
    assert (x.x_mm[0], x.x_mm[-1], x.y_mm) == (0.0, 10.0, (0.0, 7.0))
    assert (y.x_mm, y.y_mm[0], y.y_mm[-1]) == ((0.0, 10.0), 0.0, 7.0)
    assert machine.play_map.used == (None, None, None)
    assert built("play_map.use=true").play_map.used == (x, y, None)


def test_left_out_there_is_nothing_of_it() -> None:
    table = read_table(FILE)
    del table["play_map"]
    machine = build_machine(table, "pic_mmh.toml")
    assert (machine.play_map.use, machine.play_map.x, machine.play_map.y) == (False, None, None)
    assert (machine.mechanics.squareness_rad, machine.mechanics.seed) == (0.0, 0)
    assert [axis.repeatability_mm for axis in machine.axes] == [0.0] * 3


def test_values_that_hold() -> None:
    machine = built(
        "axes.z.repeatability_mm=0.002",
        "mechanics.squareness_rad=-0.1",
        "mechanics.seed=4294967295",
        "play_map.y.x_mm=[-5, 0, 1e3]",
        "play_map.y.play_mm=[[0, 1], [0.5, 0.25], [3, 2]]",
    )
    assert machine.axes.z.repeatability_mm == 0.002
    assert (machine.mechanics.squareness_rad, machine.mechanics.seed) == (-0.1, 2**32 - 1)
    assert machine.play_map.y is not None
    assert machine.play_map.y.play_mm == ((0.0, 1.0), (0.5, 0.25), (3.0, 2.0))


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("play_map.x.x_mm=[0, 5, 5, 10]", ["[play_map], key x", "x_mm", "above the one before"]),
        ("play_map.x.x_mm=[0, 6, 5, 10]", ["[play_map], key x", "x_mm", "above the one before"]),
        ("play_map.y.y_mm=[0]", ["[play_map], key y", "y_mm", "two edges or more"]),
        ("play_map.x.y_mm=[]", ["[play_map], key x", "y_mm", "two edges or more"]),
        ("play_map.x.x_mm=[0, 10]", ["[play_map], key x", "1 rows", "of 1 numbers"]),
        ("play_map.x.play_mm=[[1, 2]]", ["[play_map], key x", "1 rows", "of 3 numbers"]),
        ("play_map.x.play_mm=[]", ["[play_map], key x", "1 rows"]),
        ("play_map.y.play_mm=[[1], [1, 2], [1]]", ["[play_map], key y", "3 rows", "of 1"]),
        ("play_map.y.play_mm=[[1], [-1], [1]]", ["[play_map.y], key play_mm[1][0]", "0 and 100"]),
        ("play_map.y.play_mm=[[1], ['w'], [1]]", ["[play_map.y], key play_mm[1][0]", "float"]),
        ("play_map.y.play_mm=[[1], [nan], [1]]", ["play_map.y.play_mm", "not finite"]),
        ("play_map.y.y_mm=[0, 1, 2, inf]", ["play_map.y.y_mm", "not finite"]),
        ("play_map.z.x_mm=[0, 1]", ["[play_map], key z", "unknown key", "use, x, y"]),
        ("play_map.x.z_mm=[0, 1]", ["[play_map.x], key z_mm", "unknown key", "x_mm, y_mm"]),
        ("play_map.use=1", ["[play_map], key use", "bool"]),
        ("mechanics.squareness_rad=0.11", ["[mechanics], key squareness_rad", "-0.1 and 0.1"]),
        ("mechanics.squareness_rad=-5", ["[mechanics], key squareness_rad", "-0.1 and 0.1"]),
        ("mechanics.seed=-1", ["[mechanics], key seed", "0 and 4294967295"]),
        ("mechanics.seed=4294967296", ["[mechanics], key seed", "4294967295"]),
        ("mechanics.seed=0.5", ["[mechanics], key seed", "int"]),
        ("axes.x.repeatability_mm=-0.1", ["[axes.x], key repeatability_mm", "0 and 100"]),
    ],
)
def test_what_is_refused(setting: str, words: list[str]) -> None:
    with pytest.raises(MachineError) as caught:
        built(setting)
    for word in words:
        assert word in str(caught.value)


def test_a_map_needs_all_of_its_keys() -> None:
    table = read_table(FILE)
    del table["play_map"]["x"]["y_mm"]
    with pytest.raises(MachineError, match=r"table \[play_map.x\], key y_mm: key is missing"):
        build_machine(table, "pic_mmh.toml")


def test_a_map_in_use_has_cells() -> None:
    table = read_table(FILE)
    table["play_map"] = {"use": True}
    with pytest.raises(MachineError, match=r"key play_map: use is true, but neither"):
        build_machine(table, "pic_mmh.toml")
