"""LinuxCNC itself, as Debian's linuxcnc-uspace installs it, without a screen.

`headless/` has its configuration: the axes of the machine file, tools 1 to 9, and a sampler of the
joints at 1 kHz. One instance runs at a time on a computer, in real time: a lock sees to that.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

COMMAND = ("linuxcnc", "machine.ini")
"""What runs it in the folder."""


def laid_out(folder: Path, display: str, above: Sequence[Path]) -> dict[str, str]:
    """Its configuration in a folder, with the script `display` in the place of a screen; the
    environment for `COMMAND`. Started by root, its real-time part gives root away, and must still
    reach the folder and those `above` it, which are opened to everybody."""
    shutil.copytree(Path(__file__).parent / "headless", folder, dirs_exist_ok=True)
    (folder / "machine.var").touch()
    (folder / "display").write_text(display, encoding="utf-8")
    (folder / "display").chmod(0o755)
    for each in (folder, *above):
        with suppress(PermissionError):
            each.chmod(0o777)
    return os.environ | {
        "RTAPI_UID": str(os.getuid() or 65534),
        "RTAPI_FIFO_PATH": str(folder / "fifo"),
        "HOME": str(folder),
        "DISPLAY": "",
    }


@contextmanager
def alone() -> Iterator[None]:
    """No other LinuxCNC runs on this computer meanwhile."""
    with Path(tempfile.gettempdir(), "linuxcnc.lock").open("a", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
