"""The targets: post-processors found by entry point, each with the machine file beside it.

A third party adds a target as camtool's own are added: an entry point of the group
`camtool.postprocessors`, named like the target, that points at an object with `name`, `check`,
`write`, `read` (see `camtool.toolpath.program.PostProcessor`) in a module that has a .toml file
of its own name beside it. Nothing is imported but the target that is asked for.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from camtool.errors import MachineError, UnknownTargetError
from camtool.machine.loader import build_machine, read_table
from camtool.machine.model import Machine

GROUP = "camtool.postprocessors"


@dataclass(frozen=True)
class LoadedTarget:
    """A machine and the post-processor that speaks to it (a `PostProcessor`)."""

    machine: Machine
    post: Any
    file: Path


def target_names() -> list[str]:
    """Names of all installed targets, sorted; nothing is imported."""
    return sorted(point.name for point in entry_points(group=GROUP))


def load_target(
    name: str, *, machine_file: Path | None = None, settings: Sequence[str] = ()
) -> LoadedTarget:
    """The target `name`, with a user's machine file and `--set` values over it.

    Raises UnknownTargetError (with the nearest names) and MachineError.
    """
    found = {point.name: point for point in entry_points(group=GROUP)}
    if name not in found:
        near = difflib.get_close_matches(name, found, n=3, cutoff=0.4) or sorted(found)
        raise UnknownTargetError(
            f"unknown target {name!r}", mend=f"did you mean {' or '.join(near)}?"
        )
    post, file = _load(found[name])
    machine = build_machine(read_table(file), str(file), machine_file, settings)
    post.check(machine)
    return LoadedTarget(machine, post, file)


def _load(point: EntryPoint) -> tuple[Any, Path]:
    """The post-processor object and its machine file; a broken plug-in is named, nothing else."""
    try:
        post = point.load()
        module = sys.modules[point.module]
        file = Path(str(module.__file__)).with_suffix(".toml")
    except Exception as error:  # whatever a third party's module raises belongs to it
        raise MachineError(
            f"target {point.name!r} cannot be loaded ({type(error).__name__}: {error})",
            where=f"plug-in {point.value}",
            mend="reinstall or remove the package that brings it",
        ) from error
    return post, file
