"""What starting costs: the packages that a command loads, and the kernels that it compiles.

Both lists are here so that whoever drags more in has to say so; docs/benchmarks.md has the times.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAVY = {
    "build123d",
    "defusedxml",
    "ezdxf",
    "HersheyFonts",
    "numba",
    "numpy",
    "resvg_py",
    "rich",
    "scipy.linalg",
    "shapely",
    "svgpathtools",
    "numba.np.arraymath",  # with it comes all that numba compiles with, and scipy.linalg
}
PIC = ("--target", "pic-mmh", "-q")


def modules_of(*arguments: str) -> set[str]:
    """Modules that a run of `camtool ARGUMENTS` has loaded when it ends."""
    code = (
        "import sys, atexit; sys.argv = ['camtool', *sys.argv[1:]]; "
        "atexit.register(lambda: print('LOADED', *sys.modules)); "
        "from camtool.cli.main import main; main()"
    )
    command = [sys.executable, "-c", code, *arguments]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    return set(result.stdout.rpartition("LOADED")[2].split())


def warm(*arguments: str) -> set[str]:
    """The heavy ones of a run whose kernels an earlier one has compiled."""
    modules_of(*arguments)
    return HEAVY & modules_of(*arguments)


@pytest.fixture
def output(tmp_path: Path) -> str:
    return str(tmp_path / "part.pic")


def test_post_of_a_dxf_without_verification(output: str) -> None:
    loaded = warm("post", "samples/logo.dxf", *PIC, "-o", output, "--no-verify")
    assert loaded == {"ezdxf", "numba", "numpy"}


def test_post_and_verify(output: str) -> None:
    loaded = warm("post", "samples/logo.dxf", *PIC, "-o", output)
    assert loaded == {"ezdxf", "numba", "numpy"}
    assert warm("verify", output, *PIC) == {"numba", "numpy"}


def test_post_of_an_svg(output: str) -> None:
    loaded = warm("post", "samples/letter.svg", *PIC, "-o", output, "--no-verify")
    assert loaded == {"defusedxml", "numba", "numpy"}


def test_post_of_points(tmp_path: Path) -> None:
    output = str(tmp_path / "star.m")
    loaded = warm("post", "samples/star.csv", "-t", "matlab-router", "-q", "-o", output)
    assert loaded == {"numba", "numpy"}


def heavy_of(code: str) -> set[str]:
    """The heavy packages that a piece of Python has loaded when it ends."""
    command = [sys.executable, "-c", f"import sys, camtool; {code}; print('LOADED', *sys.modules)"]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    return HEAVY & set(result.stdout.rpartition("LOADED")[2].split())


def test_python_loads_what_its_calls_need() -> None:
    assert heavy_of("camtool.targets") == {"numpy"}
    assert heavy_of("camtool.targets()") == {"numpy"}
    assert "ezdxf" not in heavy_of("camtool.read_drawing('samples/letter.svg')")


@pytest.mark.parametrize(("mode", "fonts"), [("skip", set()), ("stroke", {"HersheyFonts"})])
def test_text_of_an_svg_loads_the_fonts_that_it_needs(
    mode: str, fonts: set[str], tmp_path: Path
) -> None:
    file = tmp_path / "text.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm">'
        '<text y="9">A</text><path d="M0 0h9"/></svg>'
    )
    loaded = heavy_of(f"camtool.read_drawing({str(file)!r}, text={mode!r})")
    assert loaded & {"ezdxf", "HersheyFonts", "defusedxml"} == {"defusedxml"} | fonts


def test_no_kernel_is_compiled_for_targets() -> None:
    assert not warm("targets") & {"numba", "ezdxf", "shapely"}


def test_a_short_run_does_not_look_for_garbage() -> None:
    code = (
        "import sys, gc; sys.argv = ['camtool', 'targets', '--json']; "
        "gc.set_debug(gc.DEBUG_STATS); from camtool.cli.main import main; "
        "print('BEGINS', file=sys.stderr, flush=True); main()"
    )
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    told = result.stderr.partition("BEGINS")[2]
    looks = re.findall(r"objects in each generation: ([\d ]+)", told)
    seen = [sum(map(int, look.split())) for look in looks]
    assert seen, "Python tells of every look"
    assert sum(seen) < 5_000  # a hundred thousand, were it left as it is


def compiled_by(cache: Path, *arguments: str) -> set[str]:
    """The files of `camtool/kernels` of which a run compiled kernels, with an empty cache."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-m", "camtool", *arguments]
    subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=True)
    return {file.name.partition(".")[0] for file in cache.rglob("*.nbi")}


@pytest.mark.slow
def test_kernels_of_a_drawing_of_lines(tmp_path: Path) -> None:
    drawing, output = tmp_path / "square.csv", str(tmp_path / "square.pic")
    drawing.write_text("0,0\n1,0\n1,1\n0,1\n0,0\n")
    made = compiled_by(tmp_path / "cache", "post", str(drawing), *PIC, "-o", output, "--no-verify")
    assert "tour_rows" in made
    assert not made & {"arc_chain", "bezier", "biarc", "fit_bezier", "spans", "recognise"}
    assert not {name for name in made if name.startswith(("offset_loops", "offset_meet", "discs"))}


@pytest.mark.slow
def test_kernels_of_a_program_judged(tmp_path: Path) -> None:
    program = ROOT / "tests" / "golden" / "pic-mmh-example.pic"
    made = compiled_by(tmp_path, "verify", str(program), *PIC)
    assert "dda" in made
    assert not {name for name in made if name.startswith(("tour", "offset_loops", "fit_"))}
