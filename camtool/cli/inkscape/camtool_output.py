"""Inkscape: save the drawing as the verified program of a machine.

Inkscape runs this file with its own Python, which need not have camtool nor any library: it calls
the command. It gives a drawing as the last word, takes the program from stdout, and shows what is
on stderr in a dialog (inkscape.gitlab.io/extensions, "Output extensions")."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
from argparse import ArgumentParser, Namespace
from pathlib import Path

COMMAND = ("camtool",)
"""The command to call; `camtool inkscape` replaces this by its own path."""

PREFIX = "camtool: "
"""The beginning of every message of camtool."""

MAX_MESSAGES = 20


class Refusal(Exception):
    """The reason why there is no program, for the dialog."""


def read_arguments(words: list[str]) -> Namespace:
    """Parse the arguments that Inkscape passes: the values of the dialog, and the file of the
    drawing."""
    parser = ArgumentParser()
    parser.add_argument("--target", default="")
    parser.add_argument("--flags", default="")
    parser.add_argument("drawing", type=Path)
    return parser.parse_known_args(words)[0]


def post(options: Namespace, output: str, *more: str) -> tuple[bytes, list[str]]:
    """Run `camtool post` for the drawing, in its folder; return its stdout and its messages.
    Raises Refusal with the errors.

    Machine and job come from the folder: its `camtool.toml`, and `part.toml` for `part.svg`."""
    document = Path(os.environ.get("DOCUMENT_PATH", ""))
    folder = document.parent if document.is_absolute() else Path.home()
    try:
        flags = shlex.split(options.flags)
    except ValueError:
        raise Refusal("the flags hold a quote without its end; close it") from None
    job = document.with_suffix(".toml") if document.name else None
    if job is not None and job.is_file() and "--job" not in flags:
        flags = ["--job", str(job), *flags]
    if options.target:
        flags = ["--target", options.target, *flags]
    with tempfile.TemporaryDirectory() as temporary:
        # The drawing as it is on the canvas, under its own name.
        drawing = Path(temporary, document.stem or "drawing").with_suffix(".svg")
        drawing.write_bytes(options.drawing.read_bytes())
        place = output if output == "-" else str(Path(temporary, output))
        words = [*COMMAND, "post", str(drawing), "-o", place, *more, *flags]
        # Inkscape sets paths for its own Python, which another one must not have.
        own = {name: value for name, value in os.environ.items() if name[:6] != "PYTHON"}
        try:
            process = subprocess.run(
                words, cwd=folder, env=own, capture_output=True, stdin=subprocess.DEVNULL
            )
        except OSError as error:
            raise Refusal(
                f"{COMMAND[0]} cannot be run ({error.strerror}); install camtool, then run "
                "camtool inkscape"
            ) from error
        text = process.stderr.decode("utf-8", "replace").replace(str(drawing), drawing.name)
    lines = text.splitlines()
    messages = [line.removeprefix(PREFIX) for line in lines if line.startswith(PREFIX)]
    if process.returncode:
        usage = [line for line in lines if line.startswith("Error: ")]
        errors = [line for line in messages if line.startswith("error")]
        raise Refusal("\n".join((errors or usage or lines)[:MAX_MESSAGES]))
    return process.stdout, messages[:MAX_MESSAGES]


def show(text: str) -> None:
    """Write a text to stderr, which Inkscape shows in a dialog."""
    sys.stderr.buffer.write(f"{text}\n".encode())


def main() -> int:
    """Write the program to stdout, its warnings to stderr; return the exit code."""
    try:
        program, messages = post(read_arguments(sys.argv[1:]), "-")
    except Refusal as refusal:
        show(str(refusal))
        return 1
    sys.stdout.buffer.write(program)
    if messages:
        show("\n".join(messages))
    return 0


if __name__ == "__main__":
    sys.exit(main())
