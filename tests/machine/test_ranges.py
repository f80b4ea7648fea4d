"""Every number of a machine file has a plausible range; what lies outside is refused by name."""

import math
from typing import Any

import pytest
from msgspec import inspect as known

from camtool.errors import MachineError
from camtool.machine.model import Machine
from tests.machine.numbers import DIALECTS, MEASUREMENTS, loaded, machine_numbers, numbers_of

ALL = [
    (path, about)
    for record in (Machine, *DIALECTS.values(), *MEASUREMENTS)
    for path, about in numbers_of(known.type_info(record), record.__module__)
]


def test_every_number_has_both_ends_of_a_range() -> None:
    for path, about in ALL:
        assert about.ge is not None, path
        assert about.le is not None, path
        assert math.isfinite(about.ge), path
        assert about.ge < about.le <= 1e10, path
        assert about.gt is None, path
        assert about.lt is None, path
    assert len(ALL) > 130


def new_numbers(target: str) -> dict[str, Any]:
    """The numbers of a target that no target before it has."""
    numbers = machine_numbers(target)
    if target == min(DIALECTS):
        return numbers
    own = ("controller.", "dialect.")
    return {path: about for path, about in numbers.items() if path.startswith(own)}


def setting_of(path: str, about: Any, value: float) -> str:
    """`--set` of one number; lists are refused whatever their length is."""
    said = str(int(value)) if isinstance(about, known.IntType) else repr(float(value))
    depth = path.count("[]")
    return f"{path.replace('[]', '')}={'[' * depth}{said}{']' * depth}"


@pytest.mark.parametrize("target", sorted(DIALECTS))
def test_what_lies_outside_is_refused_with_the_key_the_value_and_the_range(target: str) -> None:
    for place, (path, about) in enumerate(new_numbers(target).items()):
        table, _, key = path.replace("[]", "").rpartition(".")
        far, near = (1e308, -1e308), (2.0 * about.le + 1.0, about.ge - 1.0)
        for value in (far[place % 2], near[1 - place % 2]):  # beyond either end
            with pytest.raises(MachineError) as caught:
                loaded(target, setting_of(path, about, value))
            message = str(caught.value)
            assert f"table [{table}], key {key}" in message, message
            if "[]" not in path:
                ends = " and ".join(
                    str(end) if isinstance(end, int) else f"{end:g}"
                    for end in (about.ge, about.le)
                )
                assert f"is not between {ends}" in message, message


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        (
            "controller.machine_zero_mm=[0,1e9,0]",
            ["key machine_zero_mm[1]: 1000000000.0 is not between -100000 and 100000"],
        ),
        ("play_map.x.play_mm=[[1,2,3e5]]", ["[play_map.x], key play_mm[0][2]: 300000.0 is not"]),
        ("axes.x.travel_mm=" + "1" * 400, ["key travel_mm: a number of 400 characters is not"]),
        ("axes.x.travel_mm=" + "1" * 5000, ["axes.x.travel_mm", "thousands of digits"]),
    ],
)
def test_numbers_in_lists_and_long_ones(setting: str, words: list[str]) -> None:
    with pytest.raises(MachineError) as caught:
        loaded("pic-mmh", setting)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("target", sorted(DIALECTS))
def test_the_ends_of_a_range_belong_to_it(target: str) -> None:
    for path, about in new_numbers(target).items():
        for value in (about.ge, about.le):
            if "[]" in path:
                continue
            assert "is not between" not in refusal(target, setting_of(path, about, value))


def refusal(target: str, setting: str) -> str:
    """Why a setting is refused; other rules than ranges may do so. "" where it is taken."""
    try:
        loaded(target, setting)
    except MachineError as error:
        return str(error)
    return ""
