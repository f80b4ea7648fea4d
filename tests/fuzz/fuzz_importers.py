"""A target for atheris, which looks for bytes that take ways through the importers not yet taken.

    pip install atheris
    python -m tests.fuzz.fuzz_importers CORPUS            # until stopped; -runs=100000 for so many
    python -m tests.fuzz.fuzz_importers CRASH_FILE        # one file again

CORPUS is a folder for what it finds; it starts with the seeds of the fuzz tests. The first byte
chooses the reader, so that small files reach all of them. What it finds becomes a test first.
"""

from __future__ import annotations

import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["camtool", "ezdxf", "defusedxml"]):
    import camtool.importers.dxf.reader
    import camtool.importers.points.reader
    import camtool.importers.svg.reader  # noqa: F401  (to be instrumented)
    from camtool.importers.options import ReadOptions
    from tests.fuzz.reading import read_or_refuse
    from tests.fuzz.seeds import BINARIES, TEXTS

READERS = ("dxf", "svg", "points", None)


def target(data: bytes) -> None:
    """Reads the bytes; any exception that is no CamtoolError is a find."""
    if data:
        options = ReadOptions(format=READERS[data[0] % len(READERS)], recognise_arcs=True)
        read_or_refuse(data[1:], "fuzz", options)


def plant(corpus: Path) -> None:
    """The seeds, each behind the byte that chooses its reader."""
    corpus.mkdir(parents=True, exist_ok=True)
    for name, make in (TEXTS | BINARIES).items():
        suffix = name.rpartition(".")[2]
        reader = READERS.index(suffix) if suffix in READERS else READERS.index("points")
        (corpus / name).write_bytes(bytes([reader]) + make())


def main() -> None:
    """Hands the command line to atheris."""
    for argument in sys.argv[1:]:
        if not argument.startswith("-") and not Path(argument).is_file():
            plant(Path(argument))
    atheris.Setup(sys.argv, target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
