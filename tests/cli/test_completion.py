"""Completion: what a shell is told, through click's machinery and through bash itself."""

import copy
import os
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import CompletionItem, ShellComplete

from camtool.cli import COMPLETE
from camtool.cli.completion import complete_values, dxf_layers
from camtool.cli.main import cli

LOGO = "samples/logo.dxf"
HEAVY = {"ezdxf", "shapely", "scipy", "build123d"}


@pytest.fixture(scope="module")
def told() -> click.Command:
    command = copy.deepcopy(cli)
    complete_values(command)
    return command


def items(told: click.Command, *line: str) -> list[CompletionItem]:
    """Return the completions of the last word of the line."""
    complete = ShellComplete(told, {}, "camtool", COMPLETE)
    return complete.get_completions(list(line[:-1]), line[-1])


def values(told: click.Command, *line: str) -> list[str]:
    return [item.value for item in items(told, *line)]


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (("ver",), ["verify"]),
        (("post", LOGO, "--target", "pic"), ["pic-mmh"]),
        (("post", LOGO, "-t", "g"), ["grbl", "grblhal"]),
        (("convert", "x.pic", "--from", "pic-mmh", "--to", "gr"), ["grbl", "grblhal"]),
        (("targets", "linux"), ["linuxcnc"]),
        (("targets", "new", "mine", "--extends", "grb"), ["grbl", "grblhal"]),
        (("post", LOGO, "--layer", ""), ["CUT", "ENGRAVE"]),
        (("post", LOGO, "--layer", "eng"), ["ENGRAVE"]),
        (("check", LOGO, "--exclude-layer", "C"), ["CUT"]),
        (("verify", "x.pic", "--against", LOGO, "--layer", "E"), ["ENGRAVE"]),
        (("post", "none.dxf", "--layer", ""), []),
        (("post", LOGO, "-t", "pic-mmh", "--set", "axes.x.back"), ["axes.x.backlash_mm="]),
        (("post", LOGO, "-t", "none", "--set", ""), []),
        (("verify", "x.pic", "--without", "pl"), ["play"]),
        (("preview", LOGO, "--layers", "feeds,pl"), ["feeds,plunges"]),
        (("post", LOGO, "--no-layer", "w"), ["worst"]),
        (("post", LOGO, "--side", "in"), ["inside"]),
        (("post", LOGO, "--minim"), ["--minimise"]),
        (("completion", "z"), ["zsh"]),
    ],
)
def test_names_are_completed(
    told: click.Command, line: tuple[str, ...], answer: list[str]
) -> None:
    assert values(told, *line) == answer


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        (("post", "sam"), "file"),
        (("post", LOGO, "-o", "lo"), "file"),
        (("post", LOGO, "--job", ""), "file"),
        (("verify", "x"), "file"),
        (("verify", "x.pic", "--against", "s"), "file"),
        (("check", LOGO, "s"), "file"),
        (("batch", "parts", "-o", "bui"), "dir"),
    ],
)
def test_files_are_left_to_the_shell(
    told: click.Command, line: tuple[str, ...], kind: str
) -> None:
    assert [(item.type, item.value) for item in items(told, *line)] == [(kind, line[-1])]


def test_targets_come_with_their_titles(told: click.Command) -> None:
    item, _ = items(told, "post", LOGO, "-t", "grbl")
    assert item.help is not None
    assert "grbl" in item.help


def test_layers_are_those_of_entities_and_can_be_shown(tmp_path: Path) -> None:
    file = tmp_path / "bad.dxf"
    named = ("GOOD_1", "two words", "\\U+00F6l", "be\x07ll", "")
    file.write_text("".join(f"0\nLINE\n8\n{name}\n" for name in named))
    assert dxf_layers(file) == {"GOOD_1", "two words", "öl"}
    file.write_bytes(b"0\nLINE\n8\n\xf6l\n0\nLINE\n8\nA\n")
    assert dxf_layers(file) == {"A"}
    file.write_text("0\nSECTION\n2\nBLOCKS\n8\n0\n8\nB\n0\nENDSEC\n")
    assert dxf_layers(file) == {"B"}
    file.write_text("0\nSECTION\n2\nENTITIES\n8\n0\n")
    assert dxf_layers(file) == {"0"}
    assert dxf_layers(Path("samples/logo.svg")) == set()


def environment(**more: str) -> dict[str, str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | {"PATH": path} | more


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["camtool", "post", LOGO, "--layer", ""], ["CUT", "ENGRAVE"]),
        (["camtool", "post", LOGO, "-t", "pic"], ["pic-mmh"]),
    ],
)
def test_bash_completes(words: list[str], answer: list[str]) -> None:
    typed = " ".join(f"'{word}'" for word in words)
    script = f"""
eval "$(camtool completion bash)"
COMP_WORDS=({typed}); COMP_CWORD={len(words) - 1}
COMP_LINE={shlex.quote(" ".join(words))}; COMP_POINT=${{#COMP_LINE}}
_camtool_completion camtool
printf '%s\\n' "${{COMPREPLY[@]}}"
complete -p camtool
"""
    result = subprocess.run(
        ["bash", "-c", script], env=environment(), capture_output=True, text=True, check=True
    )
    *found, bound = result.stdout.splitlines()
    assert found == answer
    assert bound.endswith("-F _camtool_completion camtool")
    assert result.stderr == ""


def test_an_answer_loads_nothing_heavy() -> None:
    code = (
        "import sys, atexit; atexit.register(lambda: print('LOADED', *sys.modules)); "
        "from camtool.cli.main import main; main()"
    )
    asked = {COMPLETE: "bash_complete", "COMP_WORDS": f"camtool post {LOGO} --layer E"}
    result = subprocess.run(
        [sys.executable, "-c", code],
        env=environment(**asked),
        capture_output=True,
        text=True,
        check=True,
    )
    answer, _, loaded = result.stdout.partition("LOADED")
    assert answer.split() == ["plain,ENGRAVE"]
    assert not HEAVY & set(loaded.split())
