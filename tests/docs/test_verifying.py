"""The pictures of the page on judging are made by the commands that stand beside them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from camtool.cli.main import cli

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "verifying.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^camtool (.*) --preview docs/images/(\S+)$", TEXT, re.MULTILINE)


@pytest.mark.parametrize(("arguments", "name"), COMMANDS, ids=[name for _, name in COMMANDS])
def test_the_command_makes_the_picture(
    arguments: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    made = tmp_path / name
    code = cli.main([*shlex.split(arguments), "--preview", str(made)], standalone_mode=False)
    assert not code
    assert made.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert len(made.read_bytes()) > 20_000


def test_every_picture_is_shown_and_has_its_command() -> None:
    shown = set(re.findall(r"\]\(images/(\S+?)\)", TEXT))
    assert shown == {name for _, name in COMMANDS}
    assert len(COMMANDS) == 2
