"""Bounds for the start of a command: the heavy packages that it may load, and no others.

docs/benchmarks.md has the times.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from camtool.cli.main import COMMANDS

ROOT = Path(__file__).parents[2]
HEAVY = {
    "build123d",
    "defusedxml",
    "ezdxf",
    "HersheyFonts",
    "numpy",
    "resvg_py",
    "rich",
    "scipy",
    "shapely",
    "svgpathtools",
}
PIC = ("--target", "pic-mmh", "-q")
MAX_STACK = 24
"""Functions of camtool that call each other, one within the other, in `post` of the logo. Whoever
adds a layer that only passes on takes another one out."""


def modules_of(*arguments: str) -> set[str]:
    """Return the modules that a run of `camtool ARGUMENTS` has loaded when it ends."""
    code = (
        "import sys, atexit; sys.argv = ['camtool', *sys.argv[1:]]; "
        "atexit.register(lambda: print('LOADED', *sys.modules)); "
        "from camtool.cli.main import main; main()"
    )
    command = [sys.executable, "-c", code, *arguments]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    return set(result.stdout.rpartition("LOADED")[2].split())


def loaded_heavy(*arguments: str) -> set[str]:
    """Return the heavy packages that a run of `camtool ARGUMENTS` has loaded when it ends."""
    return HEAVY & modules_of(*arguments)


@pytest.fixture
def output(tmp_path: Path) -> str:
    return str(tmp_path / "part.pic")


def test_post_of_a_dxf_without_verification(output: str) -> None:
    loaded = loaded_heavy("post", "samples/logo.dxf", *PIC, "-o", output, "--no-verify")
    assert loaded <= {"ezdxf", "numpy"}


def test_post_and_verify(output: str) -> None:
    loaded = loaded_heavy("post", "samples/logo.dxf", *PIC, "-o", output)
    assert loaded <= {"ezdxf", "numpy"}
    assert loaded_heavy("verify", output, *PIC) <= {"numpy"}
    # numpy.unique loads them to ask whether an array is masked; `distinct` does not.
    assert "numpy.ma.core" not in modules_of("verify", output, *PIC)


def test_post_of_an_svg(output: str) -> None:
    # Its curves are Béziers.
    loaded = loaded_heavy("post", "samples/logo.svg", *PIC, "-o", output)
    assert loaded <= {"defusedxml", "numpy"}


def test_post_of_points(tmp_path: Path) -> None:
    output = str(tmp_path / "star.m")
    loaded = loaded_heavy("post", "samples/star.csv", "-t", "matlab-router", "-q", "-o", output)
    assert loaded <= {"numpy"}


def test_few_functions_stand_within_each_other(output: str) -> None:
    code = (
        "import sys; sys.argv = ['camtool', *sys.argv[1:]]; deepest = depth = 0\n"
        "def watch(frame, event, _):\n"
        "    global deepest, depth\n"
        "    if frame.f_globals.get('__name__', '').startswith('camtool'):\n"
        "        depth += {'call': 1, 'return': -1}.get(event, 0)\n"
        "        deepest = max(deepest, depth)\n"
        "from camtool.cli.main import main\n"
        "sys.setprofile(watch)\n"
        "try: main()\n"
        "finally: sys.setprofile(None); print('DEEPEST', deepest)"
    )
    command = [sys.executable, "-c", code, "post", "samples/logo.dxf", *PIC, "-o", output]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    assert 15 < int(result.stdout.rpartition("DEEPEST")[2]) <= MAX_STACK


def test_what_is_loaded_is_seen() -> None:
    assert "ezdxf" in loaded_heavy("check", "samples/logo.dxf", "-q")
    assert heavy_of("import scipy") >= {"numpy", "scipy"}


def heavy_of(code: str) -> set[str]:
    """Return the heavy packages that a piece of Python has loaded when it ends."""
    command = [sys.executable, "-c", f"import sys, camtool; {code}; print('LOADED', *sys.modules)"]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    return HEAVY & set(result.stdout.rpartition("LOADED")[2].split())


def test_python_loads_what_its_calls_need() -> None:
    assert heavy_of("camtool.targets") <= {"numpy"}
    assert heavy_of("camtool.targets()") <= {"numpy"}
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
    assert loaded & {"ezdxf", "HersheyFonts", "defusedxml"} <= {"defusedxml"} | fonts


def test_targets_load_no_library_of_drawings() -> None:
    assert not loaded_heavy("targets") & {"ezdxf", "shapely"}


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (("check", "samples/logo.dxf", "-q"), {"check"}),
        (("targets", "--json"), {"targets"}),
        (("verify", "samples/circle-30-steps.pic", "-t", "pic-mmh", "-q"), {"verify"}),
        (("--version",), set()),
        (("--help",), set()),
    ],
)
def test_a_command_loads_no_other_command(arguments: tuple[str, ...], wanted: set[str]) -> None:
    loaded = {module.removeprefix("camtool.cli.") for module in modules_of(*arguments)}
    assert loaded & set(COMMANDS) <= wanted


def test_a_command_that_does_not_plan_loads_no_findings_of_planning(output: str) -> None:
    verified = ("verify", "samples/circle-30-steps.pic", "-t", "pic-mmh", "-q")
    for arguments in (("check", "samples/logo.dxf", "-q"), verified):
        assert "camtool.planning.findings" not in modules_of(*arguments)
    posted = modules_of("post", "samples/logo.dxf", *PIC, "-o", output, "--no-verify")
    assert "camtool.planning.findings" in posted


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


def test_a_checkout_without_compiled_kernels_names_the_command(tmp_path: Path) -> None:
    """Python puts the folder where it is started before the installed packages."""
    ignored = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__")
    shutil.copytree(ROOT / "camtool", tmp_path / "camtool", ignore=ignored)
    command = ["-m", "camtool", "post", str(ROOT / "samples" / "logo.dxf"), *PIC, "-o", "part.pic"]

    def run(*flags: str) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, *flags, *command]
        return subprocess.run(line, capture_output=True, text=True, cwd=tmp_path, check=False)

    shadowed = run()
    assert shadowed.returncode == 2
    assert shadowed.stderr.count("\n") == 1
    assert "kernels of this checkout are not compiled" in shadowed.stderr
    assert "python -P -m camtool" in shadowed.stderr
    assert not (tmp_path / "part.pic").exists()
    assert run("-P").returncode == 0
    assert (tmp_path / "part.pic").stat().st_size > 0


@pytest.mark.parametrize(("said", "threads"), [({}, 1), ({"OPENBLAS_NUM_THREADS": "3"}, 3)])
def test_linear_algebra_has_one_thread_unless_the_user_says_more(
    said: dict[str, str], threads: int
) -> None:
    code = (
        "import sys, os, atexit; sys.argv = ['camtool', *sys.argv[1:]]; "
        "atexit.register(lambda: print('ASKED', os.environ['OPENBLAS_NUM_THREADS'])); "
        "from camtool.cli.main import main; assert 'numpy' not in sys.modules; main()"
    )
    command = [sys.executable, "-c", code, "targets", "--json"]
    environment = {k: v for k, v in os.environ.items() if "_NUM_THREADS" not in k} | said
    result = subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=ROOT, check=True
    )
    assert result.stdout.rpartition("ASKED")[2].split() == [str(threads)]
