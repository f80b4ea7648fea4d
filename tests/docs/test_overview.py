"""The maps of the house are true: overview.md, README.md, index.md and the site's navigation."""

import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from camtool.cli.main import COMMANDS, cli

ROOT = Path(__file__).parents[2]
OVERVIEW = (ROOT / "docs" / "overview.md").read_text(encoding="utf-8")
PAGES = [ROOT / "docs" / "overview.md", ROOT / "docs" / "index.md", ROOT / "README.md"]
MAX_STALE_NAMES = 3
TREES = ("camtool/", "postprocessors/", "tests/", "samples/", "docs/")


def rows(text: str) -> list[list[str]]:
    """Return the cells of every row of the text's tables, without rules."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [each for each in cells if not set("".join(each)) <= set("-")]


def missing(text: str) -> Iterator[str]:
    """Yield files that the tables name and that do not exist; a bare name lies beside the one that
    stands before it in its row, or below it."""
    for cells in rows(text):
        folder = ROOT
        for name in re.findall(r"`([\w./-]+(?:\.py|\.md|/))`", " ".join(cells)):
            if "NAME" in name or name == "reader.py":
                continue  # of several packages
            file = ROOT / name if name.startswith(TREES) else folder / name
            if not file.exists():
                yield name
            elif name.startswith(TREES):
                folder = file if file.is_dir() else file.parent


def test_files_of_the_overview_exist() -> None:
    assert list(missing(OVERVIEW)) == []
    text = (
        "| a | `camtool/cli/main.py` and `nobody.py` beside it |\n| `camtool/preview/pocket/` |\n"
    )
    assert list(missing(text)) == ["nobody.py", "camtool/preview/pocket/"]


def stale_names(text: str) -> Iterator[str]:
    """Yield functions and modules that a page names and that do not exist: `camtool.run.Run`, and
    those that are called by their module's name alone, `link.link`."""
    sources = [*ROOT.glob("camtool/**/*.py"), *ROOT.glob("postprocessors/**/*.py")]
    for name in re.findall(r"`((?:camtool|camtool_postprocessors)\.[\w.]+)[`(]", text):
        try:
            pkgutil.resolve_name(name)
        except (ImportError, AttributeError):
            if name != "camtool.postprocessors":  # a group of entry points
                yield name
    for stem, name in set(re.findall(r"`(_?[a-z_]+)\.([A-Za-z_]+)`", text)):
        if stem == "camtool" or name in ("md", "py", "toml", "reader"):
            continue
        module = "".join(each.read_text("utf-8") for each in sources if each.stem == stem)
        if not re.search(rf"^\s*(?:def|class) {name}\b", module, re.MULTILINE):
            yield f"{stem}.{name}"


def test_names_of_the_overview_exist() -> None:
    """A renaming elsewhere may leave a few stale names here."""
    stale = list(stale_names(OVERVIEW))
    assert len(stale) <= MAX_STALE_NAMES, stale
    text = "`camtool.run.Run` `camtool.run.Nobody` `link.nobody` `camtool.nowhere.f`"
    assert sorted(stale_names(text)) == ["camtool.nowhere.f", "camtool.run.Nobody", "link.nobody"]


def test_every_room_has_a_row() -> None:
    rooms = {
        path.parent.relative_to(ROOT).as_posix() + "/"
        for path in ROOT.glob("camtool/*/__init__.py")
    }
    house = OVERVIEW.partition("## The house")[2].partition("## Where to find")[0]
    told = set(re.findall(r"^\| `(camtool/\w+/)`", house, re.MULTILINE))
    assert told == rooms


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_nothing_is_told_twice(page: Path) -> None:
    found = [cells[0] for cells in rows(page.read_text(encoding="utf-8")) if cells[0]]
    assert sorted(set(found)) == sorted(found)


def test_the_help_lists_every_command_with_the_line_that_begins_its_own_help() -> None:
    """The README sends its readers there."""
    text = CliRunner().invoke(cli, ["--help"]).output.partition("\nCommands:\n")[2]
    assert dict(re.findall(r"^  ([\w-]+)  +(.+)$", text, re.MULTILINE)) == COMMANDS
    commands = {name: cli.get_command(click.Context(cli), name) for name in COMMANDS}
    lines = {name: each.get_short_help_str(200) for name, each in commands.items() if each}
    assert lines == COMMANDS


def test_the_changelog_has_every_command() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if not re.search(rf"`(camtool )?{name}\b", text)] == []


def test_the_index_of_decisions_has_each_with_its_title() -> None:
    folder = ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- \[(\d{4})\]\((\S+)\) (.+)$", index, re.MULTILINE)
    titles = []
    for file in sorted(folder.glob("0*.md")):
        heading = file.read_text(encoding="utf-8").partition("\n")[0]
        match = re.fullmatch(r"# (\d{4}) · (.+) · \d{4}-\d\d-\d\d", heading)
        assert match, f"{file.name}: # NUMBER · what was chosen · DATE"
        assert file.name.startswith(match[1])
        titles.append((match[1], file.name, match[2]))
    assert sorted(listed) == titles


def test_the_navigation_has_every_page_once() -> None:
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    listed = re.findall(r"- (?:[^:\n]+: )?([\w./-]+\.md)$", text, re.MULTILINE)
    assert sorted(set(listed)) == sorted(listed)
    pages = {page.relative_to(ROOT / "docs").as_posix() for page in ROOT.glob("docs/**/*.md")}
    generated = {"reference/numerics.md"}
    assert {page for page in pages if not page.startswith("decisions/0")} | generated == set(
        listed
    )
