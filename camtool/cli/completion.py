"""`camtool completion`: the script that completes commands, flags and values in a shell.

The shell asks camtool itself, which answers in `main` before any command runs. There
`complete_values` gives each parameter the type that completes its values, so that commands need
not know of shells. No answer compiles a kernel or loads a library of drawings.

The scripts are ours and not click's, for those take names apart at spaces, commas and backslashes,
and `--target=pi` is nothing to them or is replaced whole. A script hands over its line up to the
cursor; each answer is a kind (plain, file, dir) and a value. Names come from drawings: whatever
they hold, a shell must take them as one word and run nothing of them."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import click
from click.shell_completion import CompletionItem, ShellComplete, add_completion_class
from click.types import StringParamType

from camtool.cli import COMPLETE
from camtool.cli.targets import flat_lines, target_items
from camtool.errors import CamtoolError
from camtool.pictures.layers import layer_names
from camtool.target.registry import load_target

MAX_SCANNED_BYTES = 20_000_000
"""Layers of larger drawings are not looked for: the answer would take longer than typing."""

UNREADABLE = "\ufffd"
"""Replacement of bytes that are not UTF-8."""

_FILES = {"FILE", "DRAWING", "DRAWINGS", "PROGRAM", "PICTURE", "MEASUREMENTS"}
_FOLDERS = {"FOLDER"}
_TARGET_FLAGS = {"--target", "--from", "--to", "--extends"}
_LAYER_FLAGS = {"--layer", "--exclude-layer"}
_PICTURE_FLAGS = {"--layers", "--no-layer"}
_DRAWINGS = ("source", "sources", "against")
_Answer = Callable[[click.Context, str], Iterable[CompletionItem]]


# The shells.

LINE_VARIABLE = "COMP_WORDS"

_BASH = r"""%(complete_func)s() {
    local answer value
    COMPREPLY=()
    while IFS= read -r answer; do
        value=${answer#*,}
        case ${answer%%%%,*} in
            dir) compopt -o dirnames ;;
            file) compopt -o default ;;
            plain)
                case ${COMP_WORDS[COMP_CWORD]} in
                    # Within quotes, only values without special characters are offered.
                    [\"\']*) case $value in *[\\\$\`\"\'!]*) continue ;; esac ;;
                    *) printf -v value %%q "$value" ;;
                esac
                case $value in *=) compopt -o nospace ;; esac
                COMPREPLY+=("$value") ;;
        esac
    done < <(env COMP_WORDS="${COMP_LINE:0:COMP_POINT}" %(complete_var)s=bash_complete "$1")
}
complete -o nosort -F %(complete_func)s %(prog_name)s
"""

_ZSH = r"""#compdef %(prog_name)s
%(complete_func)s() {
    local -a answer plain told open
    local kind value help
    answer=("${(@f)$(env COMP_WORDS="${(j: :)words[1,CURRENT]}" \
        %(complete_var)s=zsh_complete %(prog_name)s)}")
    # --target=pi: only the part after the sign is completed.
    [[ ${words[CURRENT]} == --*=* ]] && compset -P 1 '*='
    for kind value help in "${answer[@]}"; do
        case $kind in
            dir) _path_files -/ ;;
            file) _path_files -f ;;
            plain)
                if [[ $help != _ ]]; then told+=("${value//:/\\:}:$help")
                elif [[ $value == *= ]]; then open+=("$value")
                else plain+=("$value"); fi ;;
        esac
    done
    (( $#told )) && _describe -V unsorted told -U -i "$IPREFIX"
    (( $#open )) && compadd -U -i "$IPREFIX" -S '' -V unsorted -a open
    (( $#plain )) && compadd -U -i "$IPREFIX" -V unsorted -a plain
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    %(complete_func)s "$@"
else
    compdef %(complete_func)s %(prog_name)s
fi
"""

_FISH = r"""function %(complete_func)s
    # --target=pi: fish takes the word whole.
    set -l head (string match -r -- '^--[^=]+=' (commandline -ct))
    for line in (env COMP_WORDS=(commandline -cp | string collect) \
            %(complete_var)s=fish_complete %(prog_name)s)
        set -l answer (string split --max 1 , -- $line)
        switch $answer[1]
            case dir
                __fish_complete_directories $answer[2] | string replace -r '^' -- "$head"
            case file
                __fish_complete_path $answer[2] | string replace -r '^' -- "$head"
            case plain
                printf '%%s%%s\n' "$head" $answer[2]
        end
    end
end
complete --no-files --command %(prog_name)s --arguments "(%(complete_func)s)"
"""


class _Shell(ShellComplete):
    """A shell whose script passes the command line up to the cursor."""

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the finished words after the command, and the one that is being typed."""
        # With one more letter there always is a last word, and a quote is never its end.
        words = _split(os.environ[LINE_VARIABLE] + "x")
        return words[1:-1], words[-1][:-1]

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """Return the answer as one line: its kind and its value."""
        return f"{item.type},{item.value}"


class Bash(_Shell):
    """bash 4.4 or newer."""

    name: ClassVar[str] = "bash"
    source_template: ClassVar[str] = _BASH


class Zsh(_Shell):
    """zsh, which shows help beside values."""

    name: ClassVar[str] = "zsh"
    source_template: ClassVar[str] = _ZSH

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """Return the answer as three lines: its kind, its value, and its help ("_" without
        one)."""
        return f"{item.type}\n{item.value}\n{_help(item) or '_'}"


class Fish(_Shell):
    """fish, which shows help behind values."""

    name: ClassVar[str] = "fish"
    source_template: ClassVar[str] = _FISH

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """Return the answer as one line: its kind, its value, and its help after a tab."""
        text, answer = _help(item), super().format_completion(item)
        return f"{answer}\t{text}" if text else answer


SHELLS: dict[str, type[_Shell]] = {kind.name: kind for kind in (Bash, Zsh, Fish)}


def _help(item: CompletionItem[Any]) -> str:
    return " ".join((item.help or "").split())


def _split(line: str) -> list[str]:
    """Split the line into words as a shell does; the last one may be unfinished."""
    lexer = shlex.shlex(line, posix=True)
    lexer.whitespace_split = True
    lexer.commenters = ""
    words: list[str] = []
    try:
        words.extend(lexer)
    except ValueError:  # a quote without its end
        words.append(lexer.token)
    return words


@click.command(short_help="Completion for bash, zsh or fish.")
@click.argument("shell", type=click.Choice(tuple(SHELLS)))
def completion(shell: str) -> int:
    """Print the script that completes camtool's commands, flags and values in SHELL.

    \b
    bash: eval "$(camtool completion bash)"               in ~/.bashrc
    zsh:  eval "$(camtool completion zsh)"                in ~/.zshrc, after compinit
    fish: camtool completion fish | source                in ~/.config/fish/config.fish"""
    click.echo(SHELLS[shell](click.Group(), {}, "camtool", COMPLETE).source(), nl=False)
    return 0


def answer_shells(command: click.Command) -> None:
    """Let click answer a shell that asks for completions of this command; the process then
    ends."""
    complete_values(command)
    for kind in SHELLS.values():
        add_completion_class(kind)


def complete_values(command: click.Command) -> None:
    """Set, for every text parameter of this command and its subcommands, the type that completes
    its values."""
    for param in command.params:
        answer = _answer_for(param)
        if answer is not None and type(param.type) is StringParamType:
            param.type = _Completed(answer)
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            if below is not None:
                complete_values(below)


class _Completed(StringParamType):
    """Text with a function that lists possible values for a shell; any text is accepted."""

    def __init__(self, answer: _Answer) -> None:
        self._answer = answer

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the possible values, none if they cannot be found."""
        try:
            return list(self._answer(ctx, incomplete))
        except (CamtoolError, OSError):
            return []


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
    if "--interpolator" in flags:
        return _interpolators
    if "--without" in flags:
        return _effects
    metavar = str(param.metavar).removesuffix("...")
    if metavar in _FOLDERS:
        return lambda ctx, incomplete: [CompletionItem(incomplete, type="dir")]
    if metavar in _FILES:
        return lambda ctx, incomplete: [CompletionItem(incomplete, type="file")]
    return None


def _targets(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    return target_items(incomplete)


def _layers(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """Yield the layers of the DXF drawings (text format) that are already on the command line."""
    # Arguments before a flag that still lacks its value are not assigned to parameters yet.
    named = [*(ctx.params.get(key) or () for key in _DRAWINGS), tuple(ctx.args)]
    names_given = [Path(name) for names in named for name in _several(names)]
    for name in sorted({layer for file in names_given for layer in dxf_layers(file)}):
        if name.casefold().startswith(incomplete.casefold()):
            yield CompletionItem(name.replace("[", "[[]"))  # a layer is given by a pattern


def _picture_layers(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """Yield the names of picture layers; in a list with commas the name after the last comma is
    completed."""
    before, comma, last = incomplete.rpartition(",")
    for name in layer_names():
        if name.startswith(last):
            yield CompletionItem(f"{before}{comma}{name}")


def _several(names: str | tuple[str, ...]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else names


def dxf_layers(file: Path) -> set[str]:
    """Return the layers (group code 8) that the entities of a DXF in text format are on; an empty
    set for other files.

    Names that cannot be shown, or that are of an encoding other than UTF-8, are left out."""
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
    names = map(_decode_name, named)
    return {name for name in names if name and name.isprintable() and UNREADABLE not in name}


def _decode_name(name: str) -> str:
    r"""Return the layer name with escapes such as \U+00F6 decoded, by which older DXF files write
    characters that are not ASCII."""
    return re.sub(r"\\U\+([0-9A-Fa-f]{4})", lambda match: chr(int(match[1], 16)), name).strip()


def _keys(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """Yield the keys of the machine whose target is already on the command line."""
    import msgspec

    target = ctx.params.get("target")
    if isinstance(target, str):
        values: dict[str, Any] = msgspec.to_builtins(load_target(target).machine)
        for key, _ in flat_lines("", values):
            if key.startswith(incomplete):
                yield CompletionItem(f"{key}=")


def _interpolators(ctx: click.Context, incomplete: str) -> Iterator[CompletionItem]:
    """Yield the interpolators of the target that is already on the command line."""
    target = ctx.params.get("target")
    if isinstance(target, str):
        for name in load_target(target).interpolators:
            if name.startswith(incomplete):
                yield CompletionItem(name)


def _effects(ctx: click.Context, incomplete: str) -> list[CompletionItem]:
    from camtool.comparison import EFFECTS

    return [CompletionItem(name) for name in EFFECTS if name.startswith(incomplete)]
