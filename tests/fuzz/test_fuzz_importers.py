"""Damaged drawings: a drawing or a clear error in bounded time, never anything else."""

from functools import cache
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import CamtoolError
from camtool.importers.formats import find_format
from camtool.importers.options import FORMATS, ReadOptions
from tests.fuzz.damage import EVERY, Damage, cut, flip, headless
from tests.fuzz.reading import read_or_refuse
from tests.fuzz.seeds import BINARIES, TEXTS
from tests.strategies import examples
from tests.waiting import no_chewing

pytestmark = pytest.mark.checked

SEEDS = TEXTS | BINARIES
CHOICES = st.integers(0, 2**20)
EVERYTHING = {"text": "stroke", "dimensions": True, "recognise_arcs": True, "across_layers": True}


def options_for(name: str) -> ReadOptions:
    """Return options by which the seed can be read: a picture has the size that it says."""
    return ReadOptions(own_dpi=name.endswith(".png"))


@cache
def seed(name: str) -> bytes:
    return SEEDS[name]()


@pytest.mark.parametrize("name", SEEDS)
def test_each_seed_is_whole(name: str) -> None:
    drawing = read_or_refuse(seed(name), name, options_for(name))
    assert not isinstance(drawing, CamtoolError), str(drawing)


@pytest.mark.parametrize("name", TEXTS)
@given(
    hits=st.lists(st.tuples(st.sampled_from(EVERY), CHOICES, CHOICES), min_size=1, max_size=3),
    everything=st.booleans(),
)
@examples(25)
def test_damaged_texts(name: str, hits: list[tuple[Damage, int, int]], everything: bool) -> None:
    data = seed(name)
    for damage, at, choice in hits:
        data = damage(data, at, choice)
    options = ReadOptions(**EVERYTHING) if everything else ReadOptions()
    with no_chewing():
        read_or_refuse(data, name, options)


@pytest.mark.parametrize("name", BINARIES)
@given(damage=st.sampled_from([cut, headless, flip]), at=CHOICES, choice=CHOICES)
@examples(40)
def test_damaged_binaries(name: str, damage: Damage, at: int, choice: int) -> None:
    with no_chewing():
        read_or_refuse(damage(seed(name), at, choice), name, options_for(name))


def test_each_format_has_a_seed() -> None:
    """But for solids: each attempt takes a second, so `tests/importers` tries a few."""
    formats = {find_format(seed(name), Path(name).suffix, name) for name in SEEDS}
    assert formats == {*FORMATS} - {"solid"}


@pytest.mark.parametrize("form", [None, *(each for each in FORMATS if each != "solid")])
@given(data=st.binary(max_size=200))
@examples(40)
def test_any_bytes_as_any_format(form: str | None, data: bytes) -> None:
    with no_chewing():
        read_or_refuse(data, "noise", ReadOptions(format=form))


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDS)
@given(hits=st.lists(st.tuples(st.sampled_from(EVERY), CHOICES, CHOICES), min_size=1, max_size=6))
@examples(1500)
def test_damaged_a_thousand_times(name: str, hits: list[tuple[Damage, int, int]]) -> None:
    data = seed(name)
    for damage, at, choice in hits:
        data = damage(data, at, choice)
    with no_chewing():
        read_or_refuse(data, name, ReadOptions(**EVERYTHING))


@pytest.mark.parametrize("blank", [" ", "\n", "\r\n", "%\n", ";\n", "/\n", "N1 ", "/* */ "])
def test_many_blanks_take_no_time(blank: str) -> None:
    """Patterns whose time grows with a power of the blanks, or doubles with each, hang here."""
    with no_chewing():
        read_or_refuse((blank * 2000 + "\x01").encode(), "noise", ReadOptions())
