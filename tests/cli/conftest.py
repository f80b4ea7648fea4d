"""Running the command line as a user does: arguments in, exit code and output out."""

import io
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Done:
    """Exit code and output of a run."""

    returncode: int
    stdout: bytes
    stderr: bytes


Run = Callable[..., Done]


@pytest.fixture
def camtool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """`camtool("post", "a.dxf", ...)` in an empty folder, through `main()` in this process."""
    from camtool.cli.main import main

    def run(*arguments: str | Path, stdin: bytes = b"") -> Done:
        out, err = io.BytesIO(), io.BytesIO()
        with monkeypatch.context() as patch:
            patch.chdir(tmp_path)
            patch.setattr(sys, "argv", ["camtool", *map(str, arguments)])
            patch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin), encoding="utf-8"))
            patch.setattr(sys, "stdout", io.TextIOWrapper(out, encoding="utf-8"))
            patch.setattr(sys, "stderr", io.TextIOWrapper(err, encoding="utf-8"))
            patch.setattr(sys, "unraisablehook", sys.unraisablehook)
            handler = signal.getsignal(signal.SIGINT)
            try:
                with pytest.raises(SystemExit) as stopped:
                    main()
            finally:
                signal.signal(signal.SIGINT, handler)
            sys.stdout.flush()
            sys.stderr.flush()
            code = stopped.value.code
            return Done(code if isinstance(code, int) else -1, out.getvalue(), err.getvalue())

    return run


@pytest.fixture
def camtool_process(tmp_path: Path) -> Run:
    """The same as a process of its own: slower, and the whole truth."""

    def run(*arguments: str | Path, stdin: bytes = b"") -> Done:
        command = [sys.executable, "-m", "camtool", *map(str, arguments)]
        done = subprocess.run(command, cwd=tmp_path, input=stdin, capture_output=True, check=False)
        return Done(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of samples."""
    return ROOT / "samples"
