"""Inkscape: say in a dialog what a machine would cut of the drawing, and how far off.

The drawing on stdout is the one that came: an effect gives back what stays on the canvas."""

from __future__ import annotations

import sys

from camtool_output import Refusal, post, read_arguments, show


def main() -> int:
    """Show the report of the verification, and the findings; return the exit code."""
    options = read_arguments(sys.argv[1:])
    sys.stdout.buffer.write(options.drawing.read_bytes())
    try:
        page, messages = post(options, "program", "--report", "-")
    except Refusal as refusal:
        show(str(refusal))
        return 0
    summary = page.decode("utf-8", "replace").partition("\n## ")[0].strip()
    show("\n".join([summary, *messages]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
