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
tools."""

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
        for file, keys in self.files:
            if keys.machine is not None:
                beside_file = file.parent / keys.machine
                return beside_file if beside_file.is_file() else self.machine_named(keys.machine)
            if keys.target is not None:
                return None
        return None

    @property
    def target(self) -> str | None:
        """Default target; None if `machine` is set instead, or nothing."""
        for _, keys in self.files:
            if keys.machine is not None or keys.target is not None:
                return keys.target
        return None

    @property
    def job(self) -> Path | None:
        """Default job file."""
        entry = self.value_of("job")
        return None if entry is None else entry[1].parent / entry[0]

    def value_of(self, key: str) -> tuple[Any, Path] | None:
        """Return the value of a key in the nearest file that has it, and the file."""
        for file, keys in self.files:
            if getattr(keys, key) is not None:
                return getattr(keys, key), file
        return None

    @property
    def libraries(self) -> tuple[Path, ...]:
        """Libraries of tools, the nearest first: the project's and the user's."""
        folders = dict.fromkeys([*(file.parent for file, _ in self.files), user_folder()])
        return tuple(folder / TOOLS for folder in folders if (folder / TOOLS).is_file())

    def machine_named(self, name: str) -> Path:
        """Return the machine file of a name; a path is returned unchanged. MachineError with the
        known names for an unknown one."""
        if _is_file_name(name):
            return Path(name)
        file = self.find(name)
        if file is not None:
            return file
        machines = dict(self.machines())
        names = f"known are {', '.join(machines)}; " if machines else ""
        if NAME.fullmatch(name) and Path(f"{name}.toml").is_file():
            names = f"--machine {name}.toml is the file of this folder; {names}"
        raise MachineError(
            f"there is no machine {name!r}",
            where="--machine",
            mend=f"{guess(name, machines)}{names}make it with camtool init {name}, "
            "or give the name of a file",
        )

    def find(self, name: str) -> Path | None:
        """Return the machine file of this name, None if there is none."""
        for folder in self._folders() if NAME.fullmatch(name) else ():
            file = folder / f"{name}.toml"
            if file.is_file() and _is_machine(file):
                return file
        return None

    def machines(self) -> Iterator[tuple[str, Path]]:
        """Yield the names and files of the user's machines: those of the project, and those of the
        configuration folder whose names the project does not have."""
        files = (file for folder in self._folders() for file in sorted(folder.glob("*.toml")))
        for file in files:
            if file == self.find(file.stem):
                yield file.stem, file

    def _folders(self) -> Iterator[Path]:
        yield from (file.parent for file, _ in self.files)
        yield user_folder() / MACHINES


def project_of(folder: Path) -> Project:
    """Return the settings that apply to this folder. MachineError for a `camtool.toml` that cannot
    be read."""
    folder = folder.absolute()
    own_file = next(
        filter(Path.is_file, (each / FILE for each in (folder, *folder.parents))), None
    )
    users = user_folder() / FILE
    files = [] if own_file is None else [own_file]
    if users != own_file and users.is_file():
        files.append(users)
    return Project(tuple((file, _read_keys(file)) for file in files))


def _read_keys(file: Path) -> ProjectKeys:
    return convert(read_table(file), ProjectKeys, str(file))


def names_machine(file: Path) -> bool:
    """Return True if this `camtool.toml` exists and names a machine or a target."""
    keys = _read_keys(file) if file.is_file() else ProjectKeys()
    return keys.machine is not None or keys.target is not None


def text_naming_machine(file: Path, name: str) -> str:
    """Return the text of a `camtool.toml` that names this machine; the other lines of the file, if
    it exists, are kept."""
    machine_line = f'machine = "{name}"'
    if not file.is_file():
        return f"# What camtool takes where no flag says otherwise.\n{machine_line}\n"
    _read_keys(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    other_lines = [line for line in lines if not _MACHINE.match(line)]
    return "\n".join([machine_line, *other_lines]) + "\n"


def user_folder() -> Path:
    """Return the folder of the user's configuration: `~/.config/camtool` on Linux, and its
    counterpart on other systems."""
    import click

    return Path(click.get_app_dir("camtool"))


def _is_file_name(name: str) -> bool:
    """Return True if the text is a file name or path of a machine file, not the name of a
    machine."""
    return NAME.fullmatch(name) is None or Path(name).is_file()


def _is_machine(file: Path) -> bool:
    """Return True if this TOML file is a machine file, that is, it has the key `extends`."""
    try:
        return isinstance(read_table(file).get("extends"), str)
    except MachineError:
        return False
