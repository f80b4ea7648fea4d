"""The flags that several commands share, and what they stand for.

Each is a decorator that gives the command one record: `machine_options` (which machine) here,
`job_options` (what is cut, and how) in `jobflags`, `drawing_options` (how a drawing is read) in
`drawing`. A job file says the same as the job flags; flags override it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.gather import Command, decorate, with_flags
from camtool.cli.sections import option

if TYPE_CHECKING:
    from camtool.machine.registry import LoadedTarget

_MACHINE = "Machine"
INTERPOLATORS = ("dsm", "dda", "stairs")


@dataclass(frozen=True)
class MachineFlags:
    """`--target`, `--machine`, `--set`."""

    target: str | None
    machine: str | None
    settings: tuple[str, ...]

    def load(self) -> LoadedTarget:
        """The target with the user's file and settings over it."""
        from camtool.machine.registry import load_target

        name = self.name()
        if name is None:
            raise click.UsageError("--target is missing; `camtool targets` lists the machines")
        file = Path(self.machine) if self.machine else None
        return load_target(name, machine_file=file, settings=self.settings)

    def files(self) -> list[str]:
        """The files that say what the machine is."""
        return [] if self.machine is None else [self.machine]

    def name(self) -> str | None:
        """The target's name: as given, or as the machine file says; None when nobody does."""
        if self.target is not None or self.machine is None:
            return self.target
        from camtool.machine.loader import extended_by

        return extended_by(Path(self.machine))


def machine_options(command: Command) -> Command:
    """Adds `machine: MachineFlags`."""
    return with_flags(
        command,
        "machine",
        MachineFlags,
        [
            option(
                _MACHINE,
                "--target",
                "-t",
                metavar="NAME",
                help="The machine; see camtool targets.",
            ),
            option(
                _MACHINE,
                "--machine",
                metavar="FILE",
                help="A TOML file that extends the target's machine.",
            ),
            option(
                _MACHINE,
                "--set",
                "settings",
                multiple=True,
                metavar="KEY=VALUE",
                help="Change one value of the machine, such as axes.x.backlash_mm=0.2.",
            ),
        ],
    )


def talk_options(command: Command) -> Command:
    """Adds `quiet: bool` and `verbose: bool`, and `--debug`, which main() looks for itself."""
    return decorate(
        command,
        [
            click.option("-q", "--quiet", is_flag=True, help="Only errors."),
            click.option("-v", "--verbose", is_flag=True, help="Remarks too."),
            click.option(
                "--debug", is_flag=True, expose_value=False, help="Traceback on an error."
            ),
        ],
    )
