"""Commands load build123d and svgpathtools only when an object or a solid needs them, and work
where they are not installed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOLIDS = ("build123d", "OCP", "svgpathtools")

BLOCKER = """
raise ModuleNotFoundError(f"No module named {__name__!r}", name=__name__)
"""

COMMANDS = [
    ("--version",),
    ("targets",),
    ("tools",),
    ("check", "samples/logo.dxf"),
    ("check", "samples/logo.svg"),
    ("post", "samples/logo.dxf", "-t", "pic-mmh", "-o", "OUT.pic", "--preview", "OUT.svg"),
    ("post", "samples/plate.dxf", "--job", "samples/plate.toml", "-t", "grbl", "-o", "OUT.nc"),
    ("job", "new", "samples/plate.dxf", "-o", "OUT.toml"),
    ("preview", "samples/logo.dxf", "-o", "OUT.html"),
    ("verify", "samples/logo.dxf", "--help"),
]


def run(
    folder: Path, *arguments: str, blocked: bool = False, text: str = BLOCKER
) -> subprocess.CompletedProcess[str]:
    """Run `camtool ARGUMENTS`; OUT in them is a file of the folder. The last line of stdout names
    the packages that were loaded. `blocked`: those of SOLIDS cannot be imported."""
    code = (
        "import sys, atexit; sys.argv = ['camtool', *sys.argv[1:]]; "
        "atexit.register(lambda: print('LOADED', *{m.split('.')[0] for m in sys.modules})); "
        "from camtool.cli.main import main; main()"
    )
    place = folder / "blocker"
    place.mkdir(exist_ok=True)
    for name in SOLIDS if blocked else ():
        (place / f"{name}.py").write_text(text)
    files = [each.replace("OUT", str(folder / "out")) for each in arguments]
    return subprocess.run(
        [sys.executable, "-c", code, *files],
        env=os.environ | {"PYTHONPATH": str(place)},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_commands_load_no_library_of_solids(command: tuple[str, ...], tmp_path: Path) -> None:
    done = run(tmp_path, *command)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.rpartition("LOADED")[2].split())
    assert "click" in loaded
    assert not loaded & set(SOLIDS)


@pytest.mark.parametrize("command", COMMANDS[3:6], ids=" ".join)
def test_commands_work_without_the_libraries(command: tuple[str, ...], tmp_path: Path) -> None:
    with_them, without = run(tmp_path, *command), run(tmp_path, *command, blocked=True)
    assert without.returncode == 0, without.stderr
    assert without.stderr == with_them.stderr


@pytest.mark.parametrize(
    ("name", "content", "flags"),
    [
        ("a.step", "ISO-10303-21;\nHEADER;\nENDSEC;\nEND-ISO-10303-21;\n", ()),
        ("a.brep", "CASCADE Topology V1\n", ()),
        ("a.py", "from build123d import Box\npart = Box(1, 2, 3)\n", ("--allow-scripts",)),
    ],
)
def test_a_solid_without_them_is_one_line(
    name: str, content: str, flags: tuple[str, ...], tmp_path: Path
) -> None:
    file = tmp_path / name
    file.write_text(content)
    done = run(tmp_path, "check", str(file), *flags, blocked=True)
    assert done.returncode == 2, done.stderr
    assert done.stderr == (
        f"camtool: error: {file}: is read by build123d, which is not installed here; "
        "pip install build123d\n"
    )


def test_a_library_of_the_system_that_is_missing_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.step"
    file.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nEND-ISO-10303-21;\n")
    text = 'raise ImportError("libX11.so.6: cannot open shared object file", name=__name__)'
    done = run(tmp_path, "check", str(file), blocked=True, text=text)
    assert done.returncode == 2, done.stderr
    assert (
        "which cannot be loaded here (libX11.so.6: cannot open shared object file)" in done.stderr
    )
    assert "apt install libx11-6" in done.stderr
