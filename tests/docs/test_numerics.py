"""docs/numerics.md lists every number that decides something, with the value that the code has."""

import ast
import importlib
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "numerics.md").read_text(encoding="utf-8")
NOT_DECIDING = {"preview", "cli"}  # how pictures look; exit codes


def constants() -> dict[tuple[str, str], float]:
    """(file, name) of every module-level number in capitals, and its value."""
    found: dict[tuple[str, str], float] = {}
    for path in [*ROOT.glob("camtool/**/*.py"), *ROOT.glob("postprocessors/*.py")]:
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[1] in NOT_DECIDING:
            continue
        own = parts[0] == "postprocessors"
        module = importlib.import_module(
            ".".join(("camtool_postprocessors", *parts[1:]) if own else parts)
        )
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            targets = node.targets if isinstance(node, ast.Assign) else []
            targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
            for target in targets:
                name = target.id if isinstance(target, ast.Name) else ""
                value = getattr(module, name, None)
                if name[:1].isupper() and name.isupper() and type(value) in (int, float):
                    found["/".join(parts) + ".py", name] = value
    return found


def test_the_page_lists_every_number_with_its_value() -> None:
    rows = re.findall(r"^\| `([\w/.]+)` \| `(\w+)` \| ([^|]+) \| (.+) \|$", PAGE, re.MULTILINE)
    listed = {(file, name): float(value) for file, name, value, _ in rows}
    assert listed == {key: float(value) for key, value in constants().items()}


def test_every_row_says_what_it_decides() -> None:
    rows = re.findall(r"^\| `[\w/.]+` \| `(\w+)` \| [^|]+ \| ?(.*?) ?\|$", PAGE, re.MULTILINE)
    assert [name for name, meaning in rows if len(meaning) < 10] == []
