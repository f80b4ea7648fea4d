"""Commands of camtool as processes of their own."""

import subprocess
import sys
from pathlib import Path

from tests.waiting import HANG_S

CAMTOOL = (sys.executable, "-m", "camtool")


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
