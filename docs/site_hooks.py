"""For mkdocs: links that lead out of docs/, to files of the project, become their plain words; and
the page of commands gets what each of them says with --help.

On the forge such links lead to the file; in the site there is no such page.
"""

import posixpath
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)#\s]+)[^)]*\)")
COMMANDS = "reference/commands.md"
WIDTH = 92
"""Characters of a line of help."""


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """The page's text without links out of docs/."""
    folder = posixpath.dirname(page.file.src_uri)

    def kept(match: re.Match[str]) -> str:
        place = posixpath.normpath(posixpath.join(folder, match[2]))
        return match[1] if place.startswith("..") else match[0]

    made = LINK.sub(kept, markdown)
    return f"{made}\n{commands()}" if page.file.src_uri == COMMANDS else made


def commands() -> str:
    """Every command under a heading of its own, with its help."""
    # Help needs no compiled loops: the sources beside docs/ will do where nothing is installed.
    sys.path.append(str(Path(__file__).parents[1]))
    from camtool.cli.main import cli

    context = click.Context(cli, info_name="camtool", terminal_width=WIDTH, **cli.context_settings)
    return "\n".join(_helps(context))


def _helps(context: click.Context) -> Iterator[str]:
    command = context.command
    level = "##" if context.parent is None or context.parent.parent is None else "###"
    yield f"{level} {context.command_path}\n\n```text\n{command.get_help(context)}\n```\n"
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            each = command.get_command(context, name)
            assert each is not None
            yield from _helps(
                click.Context(each, parent=context, info_name=name, **each.context_settings)
            )
