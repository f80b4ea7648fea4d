"""camtool takes every command line that a page shows.

Blocks `sh`, `console`, `make` and those without a language are read for lines that begin with
`camtool`; what stands behind three spaces or more is a remark. The commands parse them.
`test_examples.py` runs what pages show with its output, `test_lines_run` what is shown without.
"""

import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import pytest
from PIL import Image

from camtool.cli.main import cli
from camtool.records import replace
from camtool.target.registry import target_names
from tests.docs.test_examples import ROOT, shell

PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<!`)`(camtool [^`\n]+)`(?!`)")
LANGUAGES = ("", "sh", "console", "make")
MAKE_NAME = re.compile(r"\$(?:\(\w+\)|[<@*])")
FILTER = re.compile(r"^\w+ = (camtool filter .*)")
REMARK = re.compile(r" {3,}(?=\S)")
SHELL = set("|&;<>()")
ARROW = "▶"
"""A line with one is a drawing of the way that things go."""


@dataclass(frozen=True)
class Line:
    """A command line of a page; `around` is the page's whole text. `remark`: a remark may stand
    behind it; a line that `test_examples.py` runs has its output below it instead."""

    page: str
    text: str
    remark: bool
    around: str

    def __str__(self) -> str:
        return f"{self.page}: {self.text}"


def lines_of(name: str, text: str) -> Iterator[Line]:
    """Yield the lines of a page's blocks that begin with camtool; continued lines are joined."""
    for match in BLOCK.finditer(text):
        if match[2] not in LANGUAGES:
            continue
        block = match[3].replace("\\\n", " ")
        for line in block.splitlines():
            line = MAKE_NAME.sub("NAME", line.strip().removeprefix("$ "))
            line = FILTER.sub(r"\1 FILE", line)  # LinuxCNC puts the file's name behind it
            if line.startswith("camtool ") and ARROW not in line:
                yield Line(name, line, match[2] != "console", text)


def words_of(text: str) -> list[str]:
    """Return the words of the first command of a shell line, without redirections."""
    lexer = shlex.shlex(text, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    words: list[str] = []
    for word in lexer:
        if set(word) <= SHELL:
            if words and words[-1] in "12":  # 2> file
                words.pop()
            break
        words.append(word)
    return words[1:]


def parsed(words: list[str], monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Parse a line and return the parameters of its commands; click.ClickException if it fails."""
    taken: list[dict[str, Any]] = []
    with monkeypatch.context() as patch:
        patch.setattr(click.Command, "invoke", lambda _, ctx: taken.append(ctx.params))
        cli.main(words, prog_name="camtool", standalone_mode=False)
    return taken


def readings(line: Line) -> list[str]:
    """Return the line as a whole, and the line without its last remark."""
    remarks = list(REMARK.finditer(line.text)) if line.remark else []
    return [line.text, *(line.text[: each.start()] for each in remarks[-1:])]


def refused(line: Line, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the reason why camtool refuses a line; "" if it takes the line."""
    why = ""
    for text in readings(line):
        try:
            taken = parsed(words_of(text), monkeypatch)
        except (click.ClickException, ValueError) as error:
            why = f"{line}: {error}"
        else:
            return _unknown(line, taken)
    return why


def _unknown(line: Line, taken: list[dict[str, Any]]) -> str:
    """Return the fault of a line that names a machine or sample that does not exist, or ""."""
    named = {
        name: str(value)
        for params in taken
        for name, value in params.items()
        if name in ("target", "source", "extends") and value
    }
    if "--from" not in line.text:
        named.pop("source", None)
    for value in named.values():
        own = f'name = "{value}"' in line.around  # a target that the page itself makes
        if line.remark and not (value.isupper() or own or value in target_names()):
            return f"{line}: there is no target {value}"
    for name in re.findall(r"(?<![\w/.])samples/[\w./*-]*\w", line.text):
        if not list(ROOT.glob(name)):
            return f"{line}: there is no {name}"
    return ""


def test_the_lines_of_blocks_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [line for page in PAGES for line in lines_of(page.name, page.read_text("utf-8"))]
    faults = {line: refused(line, monkeypatch) for line in lines}
    assert {line: fault for line, fault in faults.items() if fault} == {}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder with the files that the pages mention."""
    place = tmp_path_factory.mktemp("pages")
    samples = place / "samples"
    shutil.copytree(ROOT / "samples", samples)
    for below in ("drawings", "parts/one", "docs/images"):
        (place / below).mkdir(parents=True)
    for below in (".", "drawings", "parts/one"):
        shutil.copy(samples / "logo.dxf", place / below)
    shutil.copy(samples / "logo.toml", place)
    shutil.copy(samples / "measured" / "pic-mmh-lines.toml", place / "measured.toml")
    assert shell("camtool post logo.dxf -t pic-mmh -q -o logo.pic", place, 0)[1] == 0
    for name in ("old.pic", "new.pic"):
        shutil.copy(place / "logo.pic", place / name)
    shutil.copy(place / "logo.dxf", place / "logo2.dxf")
    _copy_parts(place)
    return place


def _copy_parts(place: Path) -> None:
    """Add the parts, programs, pictures and settings that pages of milling mention."""
    for name in ("plate.dxf", "plate.toml", "sign.svg", "sign.toml"):
        shutil.copy(place / "samples" / name, place)
    shutil.copy(place / "logo.dxf", place / "part.dxf")
    thinner = (place / "plate.toml").read_text("utf-8").replace('depth = "3mm"', 'depth = "2.5mm"')
    (place / "thinner.toml").write_text(thinner, "utf-8")
    leaf = Image.open(place / "samples" / "leaf.jpg")
    leaf.save(place / "sketch.png")
    leaf.save(place / "letters.jpg")
    (place / "grbl.txt").write_text(
        "$0=10\n$1=25\n$2=0\n$3=0\n$4=0\n$5=0\n$6=0\n$10=1\n$11=0.010\n$12=0.002\n$13=0\n"
        "$20=0\n$21=0\n$22=0\n$23=0\n$24=25\n$25=500\n$26=250\n$27=1\n$30=12000\n$31=0\n$32=0\n"
        "$100=800\n$101=800\n$102=800\n$110=1000\n$111=1000\n$112=600\n"
        "$120=30\n$121=30\n$122=30\n$130=300\n$131=180\n$132=45\nok\n",
        "utf-8",
    )
    for command in (
        "post plate.dxf --job plate.toml -t grbl -q -o plate.nc",
        "post sign.svg --job sign.toml -t grbl -q -o sign.nc",
        "post logo.dxf -t grbl -q -o logo.nc",
        "post logo.dxf -t linuxcnc -q -o part.ngc",
        "post plate.dxf -t grbl -q --tool-diameter 3mm --kind engrave -o old.nc",
        "post plate.dxf -t grbl -q --tool-diameter 3mm --kind engrave --depth 0.5mm -o new.nc",
    ):
        printed, code = shell(f"camtool {command}", place, 0)
        assert code == 0, printed


ELSEWHERE = {"calibration.md", "write-a-post.md"}
"""Pages whose lines other tests run."""

NOT_RUN = ("--watch", "--scheduler", " NAME", " FILE", "--port", "camtool twin")
"""Without an end, or of files, ports and schedulers that are not there."""


def lines_to_run() -> list[Line]:
    every = [line for page in PAGES for line in lines_of(page.name, page.read_text("utf-8"))]
    return [
        line
        for line in every
        if line.remark
        and line.page not in ELSEWHERE
        and not any(part in line.text for part in NOT_RUN)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("line", lines_to_run(), ids=str)
def test_lines_run(line: Line, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = next(
        each
        for each in reversed(readings(line))
        if not refused(replace(line, text=each), monkeypatch)
    )
    (folder / "logo.svg").unlink(missing_ok=True)  # reports refuse a picture that is not theirs
    before = dict.fromkeys(folder.rglob("*"))
    settings = "GITHUB_STEP_SUMMARY=summary.md; export XDG_CONFIG_HOME=$PWD/config"
    printed, code = shell(f"{settings}; {text}", folder, 0)
    differs = 1 if text.startswith("camtool diff") else 0  # the code for stocks that differ
    assert code in (0, differs), printed
    for made in set(folder.rglob("*")) - set(before):
        assert made.is_dir() or made.stat().st_size, made


def wrong_words(text: str) -> str:
    """Return the fault of a command quoted within a sentence; "" if it exists with its flags."""
    try:
        words = words_of(text)
    except ValueError as error:
        return f"{text}: {error}"
    command: click.Command = cli
    while isinstance(command, click.Group) and words and re.fullmatch(r"[a-z]+", words[0]):
        found = command.get_command(click.Context(command), words[0])
        if found is None:
            return f"{text}: there is no command {words[0]}"
        command, words = found, words[1:]
    known = {name for each in command.params for name in (*each.opts, *each.secondary_opts)}
    known |= {"-h", "--help", "--version"}
    for before, word in pairwise(["", *words]):
        flag = re.match(r"-{1,2}[a-z]", word) and before not in ("--set", "-o")
        if flag and word.partition("=")[0] not in known:
            return f"{text}: there is no flag {word}"
    return ""


def test_commands_within_lines_of_text_exist() -> None:
    for page in PAGES:
        faults = [wrong_words(text) for text in INLINE.findall(page.read_text("utf-8"))]
        assert [fault for fault in faults if fault] == [], page.name


@pytest.mark.parametrize(
    "text",
    [
        "camtool post logo.dxf --bogus",
        "camtool pst logo.dxf",
        "camtool post logo.dxf --side nowhere",
        "camtool post samples/nobody.dxf",
        "camtool convert a.pic --from pic-mmh --to nobody",
        "camtool post logo.dxf -t nobody    a remark",
        "camtool post   --bogus",
    ],
)
def test_lines_that_are_wrong_are_seen(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (line,) = lines_of("x.md", f"```\n{text}\n```\n")
    assert refused(line, monkeypatch)
    good = "camtool post samples/logo.dxf -t pic-mmh \\\n  -o a.pic 2> x | cat   # and more"
    (line,) = lines_of("x.md", f"```sh\n{good}\n```\n")
    assert refused(line, monkeypatch) == ""


def test_words_that_are_wrong_are_seen() -> None:
    assert wrong_words("camtool pst")
    assert wrong_words("camtool post --bogus")
    assert wrong_words("camtool targets new my-mill --extends grbl") == ""
    assert wrong_words("camtool post DRAWING --set controller.model=path") == ""
