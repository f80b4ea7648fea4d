"""The drawings of the pieces are what their script writes."""

import subprocess
import sys
from pathlib import Path

from tests.validation.pieces import PIECES, ROOT


def test_the_script_writes_these_files_and_no_others(tmp_path: Path) -> None:
    script = ROOT / "samples" / "make_pieces.py"
    subprocess.run([sys.executable, "-B", str(script), str(tmp_path)], check=True)
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert made == {path.name: path.read_bytes() for path in PIECES.glob("*.dxf")}
    assert len(made) == 20
