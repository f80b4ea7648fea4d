"""Commands of camtool, in this process and as processes of their own."""

import io
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.waiting import HANG_S

CAMTOOL = (sys.executable, "-m", "camtool")


@dataclass(frozen=True)
class Done:
    """Exit code and output of a run."""

    returncode: int
    stdout: bytes
    stderr: bytes


def run_here(*words: str | Path, folder: Path, stdin: bytes = b"", merged: bool = False) -> Done:
    """Run a command through `main()` in this process, in a folder; its messages are among its
    output if that is `merged`."""
    from camtool.cli.main import main

    with pytest.MonkeyPatch.context() as patch:
        out, err, given = (
            io.TextIOWrapper(io.BytesIO(data), encoding="utf-8") for data in (b"", b"", stdin)
        )
        patch.chdir(folder)
        patch.setattr(sys, "argv", ["camtool", *map(str, words)])
        patch.setattr(sys, "stdin", given)
        patch.setattr(sys, "stdout", out)
        patch.setattr(sys, "stderr", out if merged else err)
        patch.setattr(sys, "unraisablehook", sys.unraisablehook)
        handler = signal.getsignal(signal.SIGINT)
        try:
            with pytest.raises(SystemExit) as stopped:
                main()
        finally:
            signal.signal(signal.SIGINT, handler)
        code = stopped.value.code
        printed = []
        for stream in (out, err):
            stream.flush()
            printed.append(stream.buffer.getvalue())  # type: ignore[attr-defined]
        return Done(code if isinstance(code, int) else -1, *printed)


def run_camtool(
    *words: str | Path, cwd: Path | None = None, typed: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; its input is empty, or `typed`, as from a pipe."""
    return subprocess.run(
        [*CAMTOOL, *map(str, words)],
        cwd=cwd,
        input=typed or "",
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )
