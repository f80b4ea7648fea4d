"""docs/numerics.md lists every number that decides something, as the code has it.

The tables are made from the code: each constant with its value and the docstring below it.
`pytest --bless tests/docs/test_numerics.py` writes them anew behind the page's own text.
"""

import ast
import importlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "numerics.md"
NOT_DECIDING = {"pictures", "cli"}  # how pictures look; exit codes
SHORTEST_MEANING = 10


@dataclass(frozen=True)
class Constant:
    """A module-level number in capitals; `meaning` is its docstring in one line."""

    room: str
    file: str
    name: str
    value: float
    meaning: str

    @property
    def row(self) -> str:
        return f"| `{self.file}` | `{self.name}` | {self.value!r} | {self.meaning} |"


def constants() -> Iterator[Constant]:
    """All constants, file by file, in the order of the code."""
    for path in [
        *sorted(ROOT.glob("camtool/**/*.py")),
        *sorted(ROOT.glob("postprocessors/**/*.py")),
    ]:
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[1] in NOT_DECIDING:
            continue
        own = parts[0] == "postprocessors"
        module = importlib.import_module(
            ".".join(("camtool_postprocessors", *parts[1:]) if own else parts)
        )
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for node, following in zip(body, [*body[1:], ast.Pass()], strict=True):
            for name in _names(node):
                value = getattr(module, name, None)
                if name[:1].isupper() and name.isupper() and type(value) in (int, float):
                    file, room = "/".join(parts) + ".py", parts[0] if own else parts[1]
                    yield Constant(room, file, name, value, _docstring(following))


def _names(node: ast.stmt) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else []
    targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
    return [target.id for target in targets if isinstance(target, ast.Name)]


def _docstring(node: ast.stmt) -> str:
    """The text below an assignment, in one line, fit for a table."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return " ".join(str(node.value.value).split()).replace("|", "\\|")
    return ""


def tables() -> str:
    """A table for each room."""
    rooms: dict[str, list[Constant]] = {}
    for constant in constants():
        rooms.setdefault(constant.room, []).append(constant)
    return "".join(
        f"\n## {room}\n\n| where | name | value | decides |\n|---|---|---|---|\n"
        + "".join(f"{constant.row}\n" for constant in rows)
        for room, rows in rooms.items()
    )


def test_the_page_lists_every_number_with_its_value(bless: bool) -> None:
    page = PAGE.read_text(encoding="utf-8")
    own = page.partition("\n## ")[0].rstrip("\n") + "\n"
    if bless:
        PAGE.write_text(own + tables(), encoding="utf-8")
        return
    assert page == own + tables(), "pytest --bless tests/docs/test_numerics.py writes it anew"


def test_every_number_says_what_it_decides() -> None:
    silent = [f"{c.file} {c.name}" for c in constants() if len(c.meaning) < SHORTEST_MEANING]
    assert silent == []


def test_a_table_can_be_wrong() -> None:
    rows = re.findall(r"^\| `[\w/.]+` \| `\w+` \|", tables(), re.MULTILINE)
    assert len(rows) == len(list(constants())) > 100
