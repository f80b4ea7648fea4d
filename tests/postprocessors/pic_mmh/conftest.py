"""The machine of the simulation's tests."""

from collections.abc import Callable
from pathlib import Path

import pytest

from camtool.machine.model import Machine
from camtool.tables import read_table
from tests.targets import build_machine

TARGET = Path(__file__).parents[3] / "postprocessors" / "pic_mmh" / "machine.toml"


@pytest.fixture(scope="session")
def make_machine() -> Callable[..., Machine]:
    """`make_machine("controller.arcs=dda", ...)`: pic-mmh with some values changed."""

    def make(*settings: str) -> Machine:
        return build_machine(read_table(TARGET), str(TARGET), settings=settings)

    return make


@pytest.fixture(scope="session")
def machine(make_machine: Callable[..., Machine]) -> Machine:
    """pic-mmh as it is."""
    return make_machine()
