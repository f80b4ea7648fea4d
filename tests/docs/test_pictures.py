"""The pictures of the pages are made by the commands that stand beside them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from camtool.cli.main import cli

ROOT = Path(__file__).parents[2]
PAGES = {
    name: (ROOT / "docs" / name).read_text(encoding="utf-8")
    for name in ("toolpaths.md", "verifying.md", "pictures.md")
}
COMMANDS = [
    found
    for text in PAGES.values()
    for found in re.findall(r"^camtool (.*) (-o|--preview) docs/images/(\S+)$", text, re.MULTILINE)
]
DRAWN = {"offset-stages.png"}
"""What docs/images/make_images.py draws without a command."""


@pytest.mark.parametrize(("arguments", "flag", "name"), COMMANDS, ids=[one[2] for one in COMMANDS])
def test_the_command_makes_the_picture(
    arguments: str, flag: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    made = tmp_path / name
    code = cli.main([*shlex.split(arguments), flag, str(made)], standalone_mode=False)
    assert not code
    assert made.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert len(made.read_bytes()) > 20_000


def test_every_picture_is_shown_and_has_its_command() -> None:
    shown = {name for text in PAGES.values() for name in re.findall(r"\]\(images/(\S+?)\)", text)}
    assert shown == {name for _, _, name in COMMANDS} | DRAWN
    assert len(COMMANDS) >= 8
