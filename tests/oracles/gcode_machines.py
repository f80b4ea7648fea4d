"""The machines on grbl and LinuxCNC that ship, with some values changed."""

from __future__ import annotations

from pathlib import Path

from camtool.machine.loader import build_machine, read_table
from camtool.machine.model import Machine

FOLDER = Path(__file__).parents[2] / "postprocessors"


def grbl_machine(*settings: str) -> Machine:
    """grbl with `key.key=value` settings over its file."""
    return _machine("grbl", settings)


def linuxcnc_machine(*settings: str) -> Machine:
    """LinuxCNC with `key.key=value` settings over its file."""
    return _machine("linuxcnc", settings)


def _machine(name: str, settings: tuple[str, ...]) -> Machine:
    path = FOLDER / name / "machine.toml"
    model = f"controller.model={name}"
    return build_machine(read_table(path), str(path), settings=(model, *settings))
