"""`camtool completion`: the script that completes commands, flags and values in a shell.

The shell asks camtool itself, which answers in `main` before any command runs. What flags take is
told there by their place: `values_told` gives each parameter the type that completes it, so that
commands need not know of shells. No answer compiles a kernel or loads a library of drawings.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem
from click.types import StringParamType

from camtool.cli.shells import SHELLS
from camtool.errors import CamtoolError

VARIABLE = "_CAMTOOL_COMPLETE"
"""Where the shell says what it asks."""

MAX_SCANNED_BYTES = 20_000_000
"""Layers of larger drawings are not looked for: the answer would take longer than typing."""

UNREADABLE = "\ufffd"
"""What stands for bytes that are not UTF-8."""

_FILES = {"FILE", "DRAWING", "DRAWINGS", "PROGRAM", "PICTURE", "MEASUREMENTS"}
_FOLDERS = {"FOLDER"}
_TARGET_FLAGS = {"--target", "--from", "--to", "--extends"}
_LAYER_FLAGS = {"--layer", "--exclude-layer"}
_PICTURE_FLAGS = {"--layers", "--no-layer"}
_DRAWINGS = ("source", "sources", "against")
_Answer = Callable[[click.Context, str], Iterable[CompletionItem]]


@click.command(short_help="Completion for bash, zsh or fish.")
@click.argument("shell", type=click.Choice(tuple(SHELLS)))
def completion(shell: str) -> int:
    """Print the script that completes camtool's commands, flags and values in SHELL.

    \b
    bash: eval "$(camtool completion bash)"               in ~/.bashrc
    zsh:  eval "$(camtool completion zsh)"                in ~/.zshrc, after compinit
    fish: camtool completion fish | source                in ~/.config/fish/config.fish
    """
    click.echo(SHELLS[shell](click.Group(), {}, "camtool", VARIABLE).source(), nl=False)
    return 0


class Told(StringParamType):
    """Text of which a shell may be told what it can be; taken as it is."""

    def __init__(self, answer: _Answer) -> None:
        self._answer = answer

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """What may stand here; nothing when that cannot be found out."""
        try:
            return list(self._answer(ctx, incomplete))
        except (CamtoolError, OSError):
            return []


def values_told(command: click.Command) -> None:
    """Give every parameter of plain text, of this command and those under it, its completion."""
    for param in command.params:
        answer = _answer_for(param)
        if answer is not None and type(param.type) is StringParamType:
            param.type = Told(answer)
    if isinstance(command, click.Group):
        for each in command.commands.values():
            values_told(each)


def _answer_for(param: click.Parameter) -> _Answer | None:
    flags = set(param.opts)
    if flags & _TARGET_FLAGS:
        return _targets
    if flags & _LAYER_FLAGS:
        return _layers
    if flags & _PICTURE_FLAGS:
        return _picture_layers
    if "--set" in flags:
        return _keys
    if "--without" in flags:
        return _effects
    metavar = str(param.metavar).removesuffix("...")
    if metavar in _FOLDERS:
        return lambda ctx, incomplete: [CompletionItem(incomplete, type="dir")]
    if metavar in _FILES:
        return lambda ctx, incomplete: [CompletionItem(incomplete, type="file")]
    return None


def target_items(incomplete: str) -> Iterator[CompletionItem]:
    """The machines, each with its title."""
    from camtool.machine.registry import list_target, target_names

    for name in target_names():
        if name.startswith(incomplete):
            try:
                title = list_target(name).target.title
            except CamtoolError:  # a broken plug-in harms nothing else
                continue
            yield CompletionItem(name, help=title)


def _targets(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    return target_items(incomplete)


def _layers(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """The layers of the drawing that the line names before, if it is a DXF of text."""
    # What stands before a flag that still lacks its value has not been given its place.
    said = [*(ctx.params.get(key) or () for key in _DRAWINGS), tuple(ctx.args)]
    given = [Path(name) for names in said for name in _several(names)]
    for name in sorted({layer for file in given for layer in dxf_layers(file)}):
        if name.casefold().startswith(incomplete.casefold()):
            yield CompletionItem(name.replace("[", "[[]"))  # a layer is given by a pattern


def _picture_layers(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """The layers of pictures; of several, the one after the last comma."""
    from camtool.preview.layers import LAYERS

    before, comma, last = incomplete.rpartition(",")
    for name in LAYERS:
        if name.startswith(last):
            yield CompletionItem(f"{before}{comma}{name}")


def _several(names: str | tuple[str, ...]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else names


def dxf_layers(file: Path) -> set[str]:
    """The layers that entities of a DXF of text say they are on (group code 8); empty for others.

    Names that cannot be shown, or that are of an encoding other than UTF-8, are left out.
    """
    if file.suffix.lower() != ".dxf" or not file.is_file():
        return set()
    if file.stat().st_size > MAX_SCANNED_BYTES:
        return set()
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    section, before, named = "", "", set()
    for code, value in zip(map(str.strip, lines[::2]), map(str.strip, lines[1::2]), strict=False):
        if code == "2" and before == "SECTION":
            section = value
        # Layer 0 in a block is the layer of whatever inserts the block.
        elif code == "8" and not (section == "BLOCKS" and value == "0"):
            named.add(value)
        before = value
    names = map(_read, named)
    return {name for name in names if name and name.isprintable() and UNREADABLE not in name}


def _read(name: str) -> str:
    r"""A name as it is meant: older files write \U+00F6 for what is not ASCII."""
    return re.sub(r"\\U\+([0-9A-Fa-f]{4})", lambda found: chr(int(found[1], 16)), name).strip()


def _keys(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """The keys of the machine that the line names before."""
    import msgspec

    from camtool.machine.registry import load_target

    target = ctx.params.get("target")
    if isinstance(target, str):
        values: dict[str, Any] = msgspec.to_builtins(load_target(target).machine)
        for key in _flat("", values):
            if key.startswith(incomplete):
                yield CompletionItem(f"{key}=")


def _flat(prefix: str, values: dict[str, Any]) -> Iterator[str]:
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _flat(f"{name}.", value)
        else:
            yield name


def _effects(ctx: click.Context, incomplete: str) -> list[CompletionItem]:
    from camtool.pipeline.ways import EFFECTS

    return [CompletionItem(name) for name in EFFECTS if name.startswith(incomplete)]
