"""The machine that the tests of planning share."""

from __future__ import annotations

from pathlib import Path

import pytest

from camtool.machine.model import Machine
from camtool.tables import read_table
from tests.targets import build_machine

TARGET = Path(__file__).parents[2] / "postprocessors" / "pic_mmh" / "machine.toml"


@pytest.fixture(scope="session")
def machine() -> Machine:
    return build_machine(read_table(TARGET), "pic_mmh.toml")
