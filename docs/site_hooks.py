"""Hooks of mkdocs.

Links that lead out of docs/, to files of the project, become plain text: the site has no page for
them. The page of commands gets each command's --help; the page of constants is made from the code.
"""

import ast
import posixpath
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)#\s]+)[^)]*\)")
ROOT = Path(__file__).parents[1]
COMMANDS = "reference/commands.md"
NUMERICS = "reference/numerics.md"
NUMERICS_HEAD = """
All numbers that have a name in the code, in mm, s and rad unless the name says otherwise.
"""
HELP_WIDTH = 92
"""Characters of a line of help."""


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """Add the page of constants to the files of the site."""
    from mkdocs.structure.files import File

    files.append(File.generated(config, NUMERICS, content=numerics()))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return the page's text without links out of docs/."""
    folder = posixpath.dirname(page.file.src_uri)

    def kept(match: re.Match[str]) -> str:
        place = posixpath.normpath(posixpath.join(folder, match[2]))
        return match[1] if place.startswith("..") else match[0]

    made = LINK.sub(kept, markdown)
    return f"{made}\n{commands()}" if page.file.src_uri == COMMANDS else made


def commands() -> str:
    """Return each command's help under a heading of its own, in Markdown."""
    # Help needs no compiled loops: the sources beside docs/ will do where nothing is installed.
    sys.path.append(str(ROOT))
    from camtool.cli.main import cli

    context = click.Context(
        cli, info_name="camtool", terminal_width=HELP_WIDTH, **cli.context_settings
    )
    return "\n".join(_helps(context))


def numerics() -> str:
    """Return the page of constants: the numbers in capitals of all modules, a table for each."""
    tables = []
    for path in sorted([*ROOT.glob("camtool/**/*.py*"), *ROOT.glob("postprocessors/**/*.py*")]):
        if path.suffix in (".py", ".pyx") and (rows := list(constants(path.read_text("utf-8")))):
            table = "\n".join(f"| `{name}` | `{value}` | {text} |" for name, value, text in rows)
            heading = f"## {path.relative_to(ROOT).as_posix()}"
            tables.append(f"{heading}\n\n| name | value | decides |\n|---|---|---|\n{table}\n")
    return "\n".join(["# Constants", NUMERICS_HEAD, *tables])


def constants(source: str) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and docstring of each number that a module assigns to capitals."""
    try:
        body = ast.parse(source).body
    except SyntaxError:  # a module in Cython's own language
        return
    for node, following in zip(body, [*body[1:], ast.Pass()], strict=True):
        match node:
            case ast.Assign(targets=[ast.Name(name)], value=value) if is_number(value):
                pass
            case ast.AnnAssign(target=ast.Name(name), value=value) if value and is_number(value):
                pass
            case _:
                continue
        if name.isupper():
            match following:
                case ast.Expr(ast.Constant(str(text))):
                    yield name, ast.unparse(value), " ".join(text.split()).replace("|", "\\|")
                case _:
                    yield name, ast.unparse(value), ""


def is_number(value: ast.expr) -> bool:
    """True if the expression is a number, or made of numbers and names by arithmetic."""
    match value:
        case ast.Constant(bool()):
            return False
        case ast.Constant(int() | float()):
            return True
        case ast.UnaryOp(operand=operand):
            return is_number(operand)
        case ast.BinOp(left, _, right):
            return all(
                isinstance(n, ast.Name | ast.Attribute) or is_number(n) for n in (left, right)
            )
    return False


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
