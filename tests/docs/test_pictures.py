"""The pictures of the pages and of the README are what their commands draw today."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from camtool.cli.main import cli
from camtool.pictures.draw import render
from tests.oracles.png import decode

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
_spec = importlib.util.spec_from_file_location("make_images", IMAGES / "make_images.py")
assert _spec is not None
assert _spec.loader is not None
make_images = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(make_images)
COMMANDS: dict[str, list[str]] = make_images.commands()
DRAWN = "offset-stages.png"
"""What docs/images/make_images.py draws without a command."""
BROWSED = {"panel.png": "docs/panel.md"}
"""Pictures that a browser takes of a page, and the pages that show them."""
PEERS = {"adaptive-beside.png": "docs/validation.md"}
"""Pictures that other programs draw a part of (docs/images/make_adaptive.py), and their pages."""

MAX_CHANGED_SHARE, CHANGED = 5e-4, 48
"""So many of the pixels may be another by more than this: another version of the renderer may
round an edge the other way, but moves nothing."""


def compare(name: str, made: bytes, shown: bytes) -> None:
    if made == shown:
        return
    mend = f"docs/images/{name} is not what its command draws: run docs/images/make_images.py"
    new, old = decode(made).astype(int), decode(shown).astype(int)
    assert new.shape == old.shape, mend
    assert (np.abs(new - old).max(axis=2) > CHANGED).mean() <= MAX_CHANGED_SHARE, mend


QUICK = {"layers.png", "outline.png", "polar.png", "sign-iso.png", make_images.FIRST}
QUICK |= {"signals-flashcut.png"}
"""A drawing, a job, a prediction, a stock, signals and the README's: the default run looks at
these, the nightly one at all."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in COMMANDS],
)
def test_the_picture_is_what_its_command_draws(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    made = tmp_path / name
    assert not cli.main([*COMMANDS[name][:-1], str(made)], standalone_mode=False)
    compare(name, made.read_bytes(), (IMAGES / name).read_bytes())


def test_the_stages_of_an_offset_are_drawn() -> None:
    made = render(make_images.stages_picture(), DRAWN)
    compare(DRAWN, made, (IMAGES / DRAWN).read_bytes())


def test_the_comparison_can_fail() -> None:
    toolpath, drawing = (
        (ROOT / "tests" / "golden" / f"preview-{name}.png").read_bytes()
        for name in ("toolpath", "drawing")
    )
    with pytest.raises(AssertionError, match="is not what its command draws"):
        compare("one.png", toolpath, drawing)


def test_every_picture_is_shown_and_has_its_command() -> None:
    elsewhere = BROWSED | PEERS
    pages = [ROOT / page for page in ("README.md", *make_images.PAGES, *elsewhere.values())]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    shown = set(re.findall(r"\]\((?:docs/)?images/(\S+?\.png)\)", text))
    assert shown == {*COMMANDS, DRAWN, *elsewhere} == {path.name for path in IMAGES.glob("*.png")}
