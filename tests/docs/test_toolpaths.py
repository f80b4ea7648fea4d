"""The pictures of the pages on toolpaths are made by the commands that stand beside them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from camtool.cli.main import cli

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "toolpaths.md"
COMMANDS = re.findall(
    r"^camtool (preview .*) -o docs/images/(\S+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
)
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize(("arguments", "name"), COMMANDS, ids=[name for _, name in COMMANDS])
def test_the_command_makes_the_picture(
    arguments: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    made = tmp_path / name
    code = cli.main([*shlex.split(arguments), "-o", str(made)], standalone_mode=False)
    assert not code
    assert made.read_bytes().startswith(PNG)
    assert len(made.read_bytes()) > 20_000


def test_every_picture_is_shown_and_has_its_command() -> None:
    shown = set(re.findall(r"\]\(images/(\S+?)\)", PAGE.read_text(encoding="utf-8")))
    assert shown == {name for _, name in COMMANDS} | {"offset-stages.png"}
    assert len(COMMANDS) >= 6
