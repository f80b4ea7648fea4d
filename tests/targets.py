"""Targets as tests want them: with other values, or of a machine that is nobody's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from camtool.machine.model import Machine
from camtool.simulation.controller import ControllerModel
from camtool.simulation.motion import Chunk, Options
from camtool.tables import Table, read_table
from camtool.target.contract import Target
from camtool.target.loader import machine_of, resolved_table
from camtool.target.registry import LoadedTarget, find_target, target_names
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.program import Program


class MadeUp(Target):
    """A machine on the exact path, without a dialect."""

    name = "made-up"

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        raise NotImplementedError

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        raise NotImplementedError


@cache
def posts() -> dict[str, Target]:
    """The installed targets, and the made-up one, by name."""
    return {name: find_target(name)[0] for name in target_names()} | {"made-up": MadeUp()}


def build_machine(
    base: Table, base_name: str, user_file: Path | None = None, settings: Sequence[str] = ()
) -> Machine:
    """The machine of a target's table, with a user's file and settings over it."""
    name = base["target"]["dialect"]
    post = posts().get(name, posts()["made-up"])
    user = None if user_file is None else (read_table(user_file), str(user_file))
    return machine_of(post, *resolved_table(post, base, base_name, user, settings))


def on(machine: Machine) -> LoadedTarget:
    """The target that speaks the dialect of a machine, with this machine."""
    post = next(post for post in posts().values() if isinstance(machine.dialect, post.dialect))
    name = post.name
    file = find_target(name)[1] if name != "made-up" else Path("made-up.toml")
    return LoadedTarget(machine, post, file, {})


def model_of(machine: Machine) -> ControllerModel[Any, Any]:
    """The model of the machine's controller."""
    return on(machine).model


def simulate(
    toolpath: Toolpath, machine: Machine, options: Options | None = None
) -> Iterator[Chunk]:
    """The motion of a toolpath on a machine."""
    return on(machine).simulate(toolpath, options)


def verify(decoded: Toolpath, machine: Machine, **more: Any) -> Any:
    """`camtool.verification.verify.verify` on a machine."""
    from camtool.verification.verify import Case
    from camtool.verification.verify import verify as judged

    return judged(Case(decoded, on(machine), **more))
