"""What commands take where no flag says otherwise, and machine files found by name.

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
"""What machines are called."""

_MACHINE = re.compile(r"\s*(?:machine|target)\s*=")
"""The lines of a `camtool.toml` that say which machine: it has no tables."""


class Said(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
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
    """The `camtool.toml` files that hold in a folder, nearest first, each with what it says."""

    files: tuple[tuple[Path, Said], ...]

    @property
    def machine(self) -> Path | None:
        """The machine file by default; None where `target` is said instead, or nothing."""
        for file, said in self.files:
            if said.machine is not None:
                beside = file.parent / said.machine
                return beside if beside.is_file() else self.machine_named(said.machine)
            if said.target is not None:
                return None
        return None

    @property
    def target(self) -> str | None:
        """The target by default; None where `machine` is said instead, or nothing."""
        for _, said in self.files:
            if said.machine is not None or said.target is not None:
                return said.target
        return None

    @property
    def job(self) -> Path | None:
        """The job file by default."""
        found = self.said("job")
        return None if found is None else found[1].parent / found[0]

    def said(self, key: str) -> tuple[Any, Path] | None:
        """What the nearest file that has this key says, and the file."""
        for file, said in self.files:
            if getattr(said, key) is not None:
                return getattr(said, key), file
        return None

    @property
    def libraries(self) -> tuple[Path, ...]:
        """The libraries of tools, the nearest first: the project's and the user's."""
        folders = dict.fromkeys([*(file.parent for file, _ in self.files), user_folder()])
        return tuple(folder / TOOLS for folder in folders if (folder / TOOLS).is_file())

    def machine_named(self, said: str) -> Path:
        """The machine file of a name; a path is taken as it is. MachineError, with the names that
        there are, for an unknown one."""
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
        """The machine file of a name; None without one."""
        for folder in self._folders() if NAME.fullmatch(name) else ():
            file = folder / f"{name}.toml"
            if file.is_file() and _is_machine(file):
                return file
        return None

    def machines(self) -> Iterator[tuple[str, Path]]:
        """The names and files of the user's machines: those of the project and of the
        configuration folder, where the project has none of that name."""
        found = (file for folder in self._folders() for file in sorted(folder.glob("*.toml")))
        for file in found:
            if file == self.find(file.stem):
                yield file.stem, file

    def _folders(self) -> Iterator[Path]:
        yield from (file.parent for file, _ in self.files)
        yield user_folder() / MACHINES


def project_of(folder: Path) -> Project:
    """What holds in this folder. MachineError for a `camtool.toml` that cannot be read."""
    folder = folder.absolute()
    own = next(filter(Path.is_file, (each / FILE for each in (folder, *folder.parents))), None)
    users = user_folder() / FILE
    files = [] if own is None else [own]
    if users != own and users.is_file():
        files.append(users)
    return Project(tuple((file, _said(file)) for file in files))


def _said(file: Path) -> Said:
    return convert(read_table(file), Said, str(file))


def names_machine(file: Path) -> bool:
    """Whether a `camtool.toml`, which need not be there, says a machine or a target."""
    said = _said(file) if file.is_file() else Said()
    return said.machine is not None or said.target is not None


def naming(file: Path, name: str) -> str:
    """The text of a `camtool.toml`, which need not be there, that says this machine; its other
    lines stay as they are."""
    said = f'machine = "{name}"'
    if not file.is_file():
        return f"# What camtool takes where no flag says otherwise.\n{said}\n"
    _said(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    rest = [line for line in lines if not _MACHINE.match(line)]
    return "\n".join([said, *rest]) + "\n"


def user_folder() -> Path:
    """Where the user keeps what holds for all projects: `~/.config/camtool` on Linux, and its like
    elsewhere."""
    import click

    return Path(click.get_app_dir("camtool"))


def _is_file_name(said: str) -> bool:
    """Whether a machine is said by the name of a file, and not by its own."""
    return NAME.fullmatch(said) is None or Path(said).is_file()


def _is_machine(file: Path) -> bool:
    """Whether a TOML file is that of a machine: it extends a target."""
    try:
        return isinstance(read_table(file).get("extends"), str)
    except MachineError:
        return False
