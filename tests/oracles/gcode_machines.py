"""The machines on grbl and LinuxCNC that ship, with some values changed."""

from __future__ import annotations

from camtool.machine.model import Machine
from camtool.target.registry import load_target


def grbl_machine(*settings: str) -> Machine:
    """grbl with `key.key=value` settings over its file."""
    return _machine("grbl", settings)


def linuxcnc_machine(*settings: str) -> Machine:
    """LinuxCNC with `key.key=value` settings over its file."""
    return _machine("linuxcnc", settings)


def _machine(name: str, settings: tuple[str, ...]) -> Machine:
    return load_target(name, settings=settings).machine
