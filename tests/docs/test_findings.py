"""docs/findings.md explains every code, with its number, and no other."""

import re
from pathlib import Path

from camtool.findings import Code

PAGE = (Path(__file__).parents[2] / "docs" / "findings.md").read_text(encoding="utf-8")


def test_every_code_is_explained_and_no_other() -> None:
    rows = re.findall(
        r"^\| (\d+) \| `(\w+)` \| (\w+)[^|]* \| (.+?) \| (.+?) \|$", PAGE, re.MULTILINE
    )
    assert {(int(number), name) for number, name, *_ in rows} == {
        (int(code), code.name) for code in Code
    }
    assert len(rows) == len(Code)
    for _, _, severity, meaning, mend in rows:
        assert severity in {"info", "warning", "error"}
        assert len(meaning) > 10
        assert mend


def test_every_code_is_used_somewhere() -> None:
    root = Path(__file__).parents[2]
    files = [*root.glob("camtool/**/*.py"), *root.glob("postprocessors/**/*.py")]
    text = "".join(path.read_text(encoding="utf-8") for path in files)
    assert [code.name for code in Code if f"Code.{code.name}" not in text] == []
