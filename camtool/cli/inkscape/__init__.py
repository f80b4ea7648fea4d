"""`camtool inkscape`: entries of Inkscape that save and check programs."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from camtool.cli.files import write_all
from camtool.cli.messages import say
from camtool.cli.options import SectionedCommand, talk_options
from camtool.errors import OutputError

FILES = ("camtool_output.inx", "camtool_output.py", "camtool_effect.inx", "camtool_effect.py")
COMMAND_LINE = 'COMMAND = ("camtool",)'
"""The line of camtool_output.py that names the command to call, which is replaced on
installation."""


@click.command(cls=SectionedCommand, short_help="Save and check programs from Inkscape.")
@click.option(
    "-o", "--out", metavar="FOLDER", help="Inkscape's folder of extensions.  [that of the user]"
)
@talk_options
def inkscape(out: str | None, quiet: bool, verbose: bool) -> int:
    """Install two entries into Inkscape (1.0 or later), which call this camtool.

    "Save as… Verified program of a machine" writes a program, "Extensions > CAM > Check the cut"
    says what would be cut. Run it again after camtool has moved."""
    folder = Path(out) if out is not None else _user_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot be made ({error.strerror})", file=str(folder), mend="choose another --out"
        ) from error
    texts = {name: Path(__file__).with_name(name).read_text(encoding="utf-8") for name in FILES}
    command = f"COMMAND = {(sys.executable, '-m', 'camtool')!r}"
    texts[FILES[1]] = texts[FILES[1]].replace(COMMAND_LINE, command)
    write_all({str(folder / name): text.encode() for name, text in texts.items()})
    say(f"camtool: {', '.join(FILES)} are in {folder}; start Inkscape again", quiet=quiet)
    return 0


def _user_folder() -> Path:
    """Return the folder in which Inkscape looks for the user's extensions."""
    profile = os.environ.get("INKSCAPE_PROFILE_DIR")
    if profile:
        return Path(profile, "extensions")
    if os.name == "nt":
        return Path(os.environ.get("APPDATA", Path.home()), "inkscape", "extensions")
    if sys.platform == "darwin":
        support = Path.home() / "Library/Application Support"
        return support / "org.inkscape.Inkscape/config/inkscape/extensions"
    config = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(config, "inkscape", "extensions")
