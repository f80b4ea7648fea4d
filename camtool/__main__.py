"""`python -m camtool` is the same as the console script `camtool`: `run`."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from contextlib import suppress
from typing import NoReturn

from camtool.cli.main import main


def run() -> NoReturn:
    """Run the command line as the process's own, then end the process without freeing what the
    system frees anyway; this saves some 20 ms after a `post` (docs/decisions/0115-start.md)."""
    try:
        main()
    except SystemExit as end:
        if _is_watched() or not isinstance(end.code, int):
            raise
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                with suppress(OSError, ValueError):  # full, or closed
                    stream.flush()
        os._exit(end.code)


def _is_watched() -> bool:
    """Return True if the process must not end abruptly after its command: a profiler, a debugger,
    `python -i` or a thread still has work to do."""
    monitoring = getattr(sys, "monitoring", None)  # from Python 3.12 on
    tools = [] if monitoring is None else [monitoring.get_tool(number) for number in range(6)]
    threads = [each for each in threading.enumerate() if not each.daemon]
    return bool(
        sys.gettrace() or sys.getprofile() or sys.flags.inspect or any(tools) or threads[1:]
    )


if __name__ == "__main__":
    run()
