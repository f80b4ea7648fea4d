"""What the three shells run to complete camtool's lines, and how it is answered.

The scripts are ours and not click's, for those take names apart at spaces, commas and backslashes,
and `--target=pi` is nothing to them or is replaced whole. A script hands over its line up to the
cursor; each answer is a kind (plain, file, dir) and a value. Names come from drawings: whatever
they hold, a shell must take them as one word and run nothing of them.
"""

from __future__ import annotations

import os
import shlex
from typing import Any, ClassVar

from click.shell_completion import CompletionItem, ShellComplete, add_completion_class

LINE = "COMP_WORDS"
"""Where a script puts its line up to the cursor."""

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
                    # In quotes only what means nothing there.
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
    # --target=pi: only what stands behind the sign is completed.
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
    """A shell that hands over its line up to the cursor."""

    def get_completion_args(self) -> tuple[list[str], str]:
        """The finished words behind the command, and the one that is being typed."""
        # With one more letter there always is a last word, and a quote is never its end.
        words = _split(os.environ[LINE] + "x")
        return words[1:-1], words[-1][:-1]

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """One line: the kind and the value."""
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
        """Three lines: the kind, the value, and the help or _."""
        return f"{item.type}\n{item.value}\n{_help(item) or '_'}"


class Fish(_Shell):
    """fish, which shows help behind values."""

    name: ClassVar[str] = "fish"
    source_template: ClassVar[str] = _FISH

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """The kind, the value, and behind a tab the help."""
        said, answer = _help(item), super().format_completion(item)
        return f"{answer}\t{said}" if said else answer


SHELLS: dict[str, type[_Shell]] = {kind.name: kind for kind in (Bash, Zsh, Fish)}


def take_over() -> None:
    """Let click answer these shells in our way; for a process that does nothing else."""
    for kind in SHELLS.values():
        add_completion_class(kind)


def _help(item: CompletionItem[Any]) -> str:
    return " ".join((item.help or "").split())


def _split(line: str) -> list[str]:
    """The words of a line as a shell takes them; the last one may be unfinished."""
    lexer = shlex.shlex(line, posix=True)
    lexer.whitespace_split = True
    lexer.commenters = ""
    words: list[str] = []
    try:
        words.extend(lexer)
    except ValueError:  # a quote without its end
        words.append(lexer.token)
    return words
