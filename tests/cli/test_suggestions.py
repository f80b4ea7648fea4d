"""A mistyped name is answered with the one that was meant."""

from pathlib import Path

import pytest

from camtool.errors import CamtoolError
from camtool.patterns import guess
from camtool.target.registry import load_target

LOGO = "samples/logo.dxf"
PIC = ("-t", "pic-mmh")


def refused(*arguments: str) -> str:
    """Run a command line that is refused and return its message."""
    import click

    from camtool.cli.main import cli

    with pytest.raises((click.ClickException, CamtoolError)) as caught:
        cli.main(list(arguments), prog_name="camtool", standalone_mode=False)
    error = caught.value
    return error.format_message() if isinstance(error, click.ClickException) else str(error)


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (("psot", LOGO), "post"),
        (("post", LOGO, "--minimze", "reversals"), "--minimise"),
        (("post", LOGO, "-t", "pic-mnh"), "did you mean pic-mmh?"),
        (("post", LOGO, *PIC, "--layer", "CTU"), "did you mean CUT?"),
        (("post", LOGO, *PIC, "--set", "axes.x.backlsh_mm=1"), "did you mean backlash_mm?"),
        (("post", LOGO, *PIC, "--set", "axs.x.backlash_mm=1"), "did you mean axes?"),
        (("verify", LOGO, *PIC, "--without", "ply"), "did you mean play?"),
    ],
)
def test_of_flags(arguments: tuple[str, ...], meant: str) -> None:
    assert meant in refused(*arguments)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("[[operations]]\nlayers = ['CUTS']\n", "did you mean CUT?"),
        ("[[operations]]\nlayer = ['CUT']\n", "did you mean layers?"),
        ("minimise = 'reversal'\n", "did you mean reversals?"),
    ],
)
def test_of_job_files(text: str, meant: str, tmp_path: Path) -> None:
    job = tmp_path / "job.toml"
    job.write_text(text)
    assert meant in refused("post", LOGO, *PIC, "--job", str(job), "-o", str(tmp_path / "x.pic"))


def test_of_machine_files(tmp_path: Path) -> None:
    machine = tmp_path / "my.toml"
    machine.write_text('extends = "pic-mmh"\n[axes.x]\nbaklash_mm = 0.1\n')
    with pytest.raises(CamtoolError, match="did you mean backlash_mm"):
        load_target("pic-mmh", machine_file=machine)


def test_nothing_is_guessed_of_what_is_far() -> None:
    assert guess("zzz", ["CUT", "ENGRAVE"]) == ""
    assert guess("engarve", ["CUT", "ENGRAVE"]) == "did you mean ENGRAVE? "
    assert guess("x", []) == ""
