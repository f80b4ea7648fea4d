"""Defaults of commands from `camtool.toml`, and machine files found by name.

`camtool.toml` in a folder holds for it and all folders in it; another one, in the user's
configuration folder, holds everywhere:

    machine = "my-3018"      # a name, or a file beside this one
    target = "grbl"          # in its place, where there is no file for the machine
    job = "engraving.toml"
    tool = "mill"            # of operations that say none
    material = "plywood"     # whose presets tools have

Machine files have names: `my-3018` is `my-3018.toml` beside the project's `camtool.toml`, or in
`machines/` of the configuration folder. `tools.toml` beside either `camtool.toml` is a library of
tools.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from camtool.errors import MachineError
from camtool.patterns import guess
from camtool.tables import convert, read_table

FILE = "camtool.toml"

MACHINES = "machines"
"""The folder of machine files within the user's configuration folder."""

TOOLS = "tools.toml"
"""A library of tools, beside a `camtool.toml`."""

NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
"""Valid names of machines."""

_MACHINE = re.compile(r"\s*(?:machine|target)\s*=")
"""Lines of a `camtool.toml` that name the machine: it has no tables."""


class ProjectKeys(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The keys of a `camtool.toml`."""

    machine: str | None = None
    target: str | None = None
    job: str | None = None
    tool: str | int | None = None
    material: str | None = None

    def __post_init__(self) -> None:
        if self.machine is not None and self.target is not None:
            raise ValueError("machine and target contradict each other: a machine has its target")


class Project(Struct, frozen=True):
    """The `camtool.toml` files that apply to a folder, nearest first, each with its keys."""

    files: tuple[tuple[Path, ProjectKeys], ...]

    @property
    def machine(self) -> Path | None:
        """Default machine file; None if `target` is set instead, or nothing."""
        for file, said in self.files:
            if said.machine is not None:
                beside = file.parent / said.machine
                return beside if beside.is_file() else self.machine_named(said.machine)
            if said.target is not None:
                return None
        return None

    @property
    def target(self) -> str | None:
        """Default target; None if `machine` is set instead, or nothing."""
        for _, said in self.files:
            if said.machine is not None or said.target is not None:
                return said.target
        return None

    @property
    def job(self) -> Path | None:
        """Default job file."""
        found = self.value_of("job")
        return None if found is None else found[1].parent / found[0]

    def value_of(self, key: str) -> tuple[Any, Path] | None:
        """Return the value of a key in the nearest file that has it, and the file."""
        for file, said in self.files:
            if getattr(said, key) is not None:
                return getattr(said, key), file
        return None

    @property
    def libraries(self) -> tuple[Path, ...]:
        """Libraries of tools, the nearest first: the project's and the user's."""
        folders = dict.fromkeys([*(file.parent for file, _ in self.files), user_folder()])
        return tuple(folder / TOOLS for folder in folders if (folder / TOOLS).is_file())

    def machine_named(self, said: str) -> Path:
        """Return the machine file of a name; a path is returned unchanged. MachineError with the
        known names for an unknown one."""
        if _is_file_name(said):
            return Path(said)
        file = self.find(said)
        if file is not None:
            return file
        found = dict(self.machines())
        known = f"known are {', '.join(found)}; " if found else ""
        raise MachineError(
            f"there is no machine {said!r}",
            where="--machine",
            mend=f"{guess(said, found)}{known}make it with camtool init {said}, "
            "or give the name of a file",
        )

    def find(self, name: str) -> Path | None:
        """Return the machine file of a name; None without one."""
        for folder in self._folders() if NAME.fullmatch(name) else ():
            file = folder / f"{name}.toml"
            if file.is_file() and _is_machine(file):
                return file
        return None

    def machines(self) -> Iterator[tuple[str, Path]]:
        """Yield the names and files of the user's machines: those of the project, and those of the
        configuration folder whose names the project does not have."""
        found = (file for folder in self._folders() for file in sorted(folder.glob("*.toml")))
        for file in found:
            if file == self.find(file.stem):
                yield file.stem, file

    def _folders(self) -> Iterator[Path]:
        yield from (file.parent for file, _ in self.files)
        yield user_folder() / MACHINES


def project_of(folder: Path) -> Project:
    """Return the settings that apply to this folder. MachineError for a `camtool.toml` that cannot
    be read."""
    folder = folder.absolute()
    own = next(filter(Path.is_file, (each / FILE for each in (folder, *folder.parents))), None)
    users = user_folder() / FILE
    files = [] if own is None else [own]
    if users != own and users.is_file():
        files.append(users)
    return Project(tuple((file, _read_keys(file)) for file in files))


def _read_keys(file: Path) -> ProjectKeys:
    return convert(read_table(file), ProjectKeys, str(file))


def names_machine(file: Path) -> bool:
    """True if a `camtool.toml`, which need not exist, names a machine or a target."""
    said = _read_keys(file) if file.is_file() else ProjectKeys()
    return said.machine is not None or said.target is not None


def text_naming_machine(file: Path, name: str) -> str:
    """Return the text of a `camtool.toml`, which need not exist, that names this machine; its
    other lines are kept."""
    said = f'machine = "{name}"'
    if not file.is_file():
        return f"# What camtool takes where no flag says otherwise.\n{said}\n"
    _read_keys(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    rest = [line for line in lines if not _MACHINE.match(line)]
    return "\n".join([said, *rest]) + "\n"


def user_folder() -> Path:
    """Return the folder of the user's configuration for all projects: `~/.config/camtool` on
    Linux, and its counterpart elsewhere."""
    import click

    return Path(click.get_app_dir("camtool"))


def _is_file_name(said: str) -> bool:
    """True if a machine is given by the name of a file, and not by its own."""
    return NAME.fullmatch(said) is None or Path(said).is_file()


def _is_machine(file: Path) -> bool:
    """True if a TOML file is that of a machine: it extends a target."""
    try:
        return isinstance(read_table(file).get("extends"), str)
    except MachineError:
        return False
