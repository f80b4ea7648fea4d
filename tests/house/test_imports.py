"""The house's direction: rooms import only from below, and heavy packages only where used."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BASE = {
    "arrays",
    "bounds",
    "plain",
    "plugins",
    "errors",
    "units",
    "findings",
    "keys",
    "lock",
    "patterns",
    "progress",
    "records",
    "tables",
    "version",
}
SHARED = BASE | {"geometry", "kernels", "machine", "toolpath"}
TARGETS = SHARED | {"simulation", "target"}
JUDGE = TARGETS | {"importers", "planning"}
MADE = JUDGE | {"stock", "verification", "pictures", "run", "pipeline", "comparison"}

NAMED_FUNCTION = re.compile(r"(?:camtool|camtool_postprocessors)\.[\w.]+:\w+")

# Which rooms each room may import from (besides itself); docs/overview.md draws it.
ALLOWED = {
    "plain": set(),
    "plugins": set(),
    "errors": {"plain"},
    "bounds": {"errors"},
    "units": {"errors"},
    "findings": {"plain", "records"},
    "keys": {"errors", "patterns", "units"},
    "arrays": set(),
    "lock": set(),
    "patterns": set(),
    "progress": set(),
    "records": set(),
    "tables": {"errors", "patterns"},
    "version": set(),
    "project": {"errors", "patterns", "tables"},
    "geometry": BASE | {"kernels"},
    "kernels": BASE,
    "machine": BASE | {"geometry", "kernels"},
    "toolpath": BASE | {"geometry", "kernels", "machine"},
    "importers": SHARED,
    "libraries": SHARED | {"importers"},
    "planning": SHARED,
    "simulation": SHARED,
    "stock": SHARED | {"simulation", "planning", "target"},
    "target": SHARED | {"simulation", "project"},
    "postprocessors": TARGETS,
    "verification": JUDGE | {"stock"},
    "pictures": JUDGE | {"stock", "verification"},
    "waveforms": TARGETS | {"pictures", "verification"},
    "calibration": TARGETS,
    "jobs": TARGETS | {"importers", "planning"},
    "operations": SHARED | {"planning", "jobs"},
    "run": JUDGE | {"libraries", "stock", "verification", "pictures", "waveforms"},
    "pipeline": JUDGE | {"stock", "verification", "run"},
    "comparison": JUDGE | {"stock", "verification", "pictures", "run", "pipeline"},
    "inspection": MADE - {"pictures"} | {"jobs"},
    "batches": MADE,
    "sending": MADE,
    "panel": MADE | {"sending"},
    "cli": MADE
    | {"inspection", "calibration", "batches", "sending", "panel", "jobs", "project", "waveforms"},
    "__main__": {"cli"},
    "api": MADE | {"libraries", "inspection", "calibration", "jobs", "waveforms"},
    "__init__": {"api", "errors", "version"},
}
HEAVY = {
    "build123d",
    "dask",
    "distributed",
    "ezdxf",
    "fontTools",
    "HersheyFonts",
    "pressfit",
    "resvg_py",
    "rich",
    "scipy",
    "shapely",
    "svgpathtools",
}

HEAVY_WHOLE = {
    ("camtool/importers/board/reader.py", "shapely"),
    ("camtool/stock/nets.py", "shapely"),
}
"""Modules that work with a heavy package from end to end, and are imported within functions."""


MAX_LATE_IMPORTS = 210
"""Imports of our own modules within functions; the bound only goes down."""

MACHINES = [path.parent for path in sorted(ROOT.glob("postprocessors/*/machine.toml"))]
"""The folder of each target."""


def files() -> list[Path]:
    found = sorted([*ROOT.glob("camtool/**/*.py*"), *ROOT.glob("postprocessors/**/*.py*")])
    found = [path for path in found if path.suffix in {".py", ".pyx"}]
    assert len(found) > 100
    assert any(path.suffix == ".pyx" for path in found)
    return found


def source_of(path: Path) -> str:
    """Return the text of a Python file; of a Cython file its imports, in the syntax of Python."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return text
    imports = re.findall(r"^(?:from \S+ )?c?import (?:\([^)]*\)|.*)", text, re.MULTILINE)
    return "\n".join(re.sub(r"\bcimport\b", "import", line) for line in imports)


def test_cimports_are_imports_too(tmp_path: Path) -> None:
    file = tmp_path / "loops.pyx"
    file.write_text("from camtool.cli.post cimport (\n    a,\n    b,\n)\ncdef int k = 0\n")
    assert broken_rules(source_of(file), "kernels")


def room_of(name: str) -> str | None:
    """Return the room of a module name such as camtool.geometry.fit; None for foreign modules."""
    head, _, rest = name.partition(".")
    if head == "camtool_postprocessors":
        return "postprocessors"
    return (rest.split(".")[0] or "__init__") if head == "camtool" else None


def room_of_file(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return "postprocessors" if parts[0] == "postprocessors" else parts[1]


def imported(tree: ast.AST, *, neighbours: bool = False) -> list[tuple[int, str]]:
    """Return (line, module) of every import in the tree, inside functions too, and of every
    function that is named by text."""
    found: list[tuple[int, str]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            # One package, two names: postprocessors/ here, camtool_postprocessors installed.
            # So its modules import each other as neighbours, and nobody else does: "." is their
            # own folder, ".." the room.
            assert node.level == 0 or (neighbours and node.level <= 2), f"line {node.lineno}"
            module = ("camtool_postprocessors." if node.level else "") + (node.module or "")
            if module == "camtool":
                found += [(node.lineno, f"camtool.{alias.name}") for alias in node.names]
            else:
                found.append((node.lineno, module))
        elif isinstance(node, ast.Constant) and NAMED_FUNCTION.fullmatch(str(node.value)):
            found.append((node.lineno, node.value.partition(":")[0]))
    return found


def broken_rules(source: str, room: str) -> list[str]:
    faults = []
    for line, module in imported(ast.parse(source), neighbours=room == "postprocessors"):
        target = room_of(module)
        if target is None or target == room:
            continue
        if target not in ALLOWED[room]:
            faults.append(f"line {line}: {room} imports {module}")
    return faults


def test_few_of_our_own_modules_are_imported_late() -> None:
    """What every run of a module needs is imported at its top."""
    late = {
        (path, line, module)
        for path in files()
        for function in ast.walk(ast.parse(source_of(path)))
        if isinstance(function, ast.FunctionDef)
        for line, module in imported(function, neighbours=True)
        if room_of(module)
    }
    assert 100 < len(late) <= MAX_LATE_IMPORTS


def test_rooms_import_from_below_only() -> None:
    broken = {path: broken_rules(source_of(path), room_of_file(path)) for path in files()}
    assert {path: rules for path, rules in broken.items() if rules} == {}


@pytest.mark.parametrize(
    ("source", "room"),
    [
        ("from camtool.cli.post import post", "geometry"),
        ("import camtool.planning.plan", "importers"),
        ("def f():\n    from camtool.simulation.path import PathModel", "planning"),
        ("from camtool import verify", "postprocessors"),
    ],
)
def test_the_rule_can_be_broken(source: str, room: str) -> None:
    assert broken_rules(source, room)


def reached_rooms(source: str) -> set[str]:
    """Return the other folders of postprocessors/ from which a module in one of them imports."""
    nodes = ast.walk(ast.parse(source))
    far = [node for node in nodes if isinstance(node, ast.ImportFrom) and node.level > 1]
    return {str(node.module).split(".")[0] for node in far}


def module_of(path: Path) -> str:
    """Return the name under which a file is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = ("camtool_postprocessors", *parts[1:]) if parts[0] == "postprocessors" else parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def graph(sources: dict[str, tuple[str, bool]]) -> dict[str, set[str]]:
    """Return the modules that each module imports, inside functions and for typing too.

    `sources` maps a name to the module's text and True if it is a package.
    """
    arrows: dict[str, set[str]] = {}
    for name, (text, package) in sources.items():
        arrows[name] = set()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Import):
                arrows[name] |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                above = name.split(".")[: None if package else -1]
                base = above[: len(above) - node.level + 1] if node.level else []
                module = ".".join([*base, *([node.module] if node.module else [])])
                inner = {f"{module}.{alias.name}" for alias in node.names}
                arrows[name] |= (inner & sources.keys()) or {module}
        arrows[name] &= sources.keys() - {name}
    return arrows


def circles(arrows: dict[str, set[str]]) -> set[str]:
    """Return the modules in cycles, or that import modules in cycles.

    Modules that import none of the others are removed until no more can be removed.
    """
    left = {name: set(others) for name, others in arrows.items()}
    while ends := {name for name, others in left.items() if not others}:
        left = {name: others - ends for name, others in left.items() if name not in ends}
    return set(left)


def test_no_circle_of_imports() -> None:
    sources = {module_of(path): (source_of(path), path.name == "__init__.py") for path in files()}
    assert circles(graph(sources)) == set()


def test_a_circle_would_be_found() -> None:
    late = "def f():\n    from camtool import a\n"
    typed = "if TYPE_CHECKING:\n    from camtool.b import B\n"
    made = {"camtool": ("", True), "camtool.a": (typed, False), "camtool.b": (late, False)}
    assert circles(graph(made)) == {"camtool.a", "camtool.b"}
    beside = {"p": ("", True), "p.q": ("from .r import x", True), "p.q.r": ("import p.q", False)}
    assert circles(graph(beside)) == {"p.q", "p.q.r"}


@pytest.mark.parametrize("folder", MACHINES, ids=lambda path: path.name)
def test_a_target_never_imports_another(folder: Path) -> None:
    modules = [path for path in files() if path.is_relative_to(folder)]
    assert folder / "__init__.py" in modules
    for path in modules:
        assert reached_rooms(source_of(path)) <= {"gcode"}, path.name


def test_every_target_is_looked_at() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    points = settings["project"]["entry-points"]["camtool.postprocessors"]
    assert {f"camtool_postprocessors.{path.name}:POST" for path in MACHINES} == {*points.values()}
    assert reached_rooms("from ..grbl.read import read_program\nfrom .dialect import x") == {
        "grbl"
    }


def test_heavy_packages_are_imported_where_they_are_used() -> None:
    heavy = []
    for path in files():
        tree, name = ast.parse(source_of(path)), path.relative_to(ROOT).as_posix()
        top = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        tops = ast.Module(body=list(top), type_ignores=[])
        for line, module in imported(tops, neighbours=room_of_file(path) == "postprocessors"):
            package = module.split(".")[0]
            if package in HEAVY and (name, package) not in HEAVY_WHOLE:
                heavy.append(f"{name}, line {line}: {module}")
    assert heavy == []


def loaded_by(*arguments: str) -> set[str]:
    """Return the top-level packages that a run of `camtool ARGUMENTS` has loaded when it ends."""
    code = (
        "import sys, atexit; sys.argv = ['camtool', *sys.argv[1:]]; "
        "atexit.register(lambda: print('LOADED', *{m.split('.')[0] for m in sys.modules})); "
        "from camtool.cli.main import main; main()"
    )
    result = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )
    return set(result.stdout.rpartition("LOADED")[2].split())


def test_help_loads_nothing_heavy() -> None:
    assert not loaded_by("--help") & (HEAVY | {"numpy", "msgspec"})


def test_help_of_commands_without_geometry_loads_no_numpy() -> None:
    commands = ("calibrate", "servo", "twin")
    assert not [name for name in commands if "numpy" in loaded_by(name, "--help")]


def test_importing_camtool_loads_its_version_alone() -> None:
    code = "import sys, camtool; dir(camtool); print(*sys.modules)"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
    )
    loaded = set(result.stdout.split())
    assert not {module.split(".")[0] for module in loaded} & (
        HEAVY | {"numpy", "msgspec", "click"}
    )
    ours = {module for module in loaded if module.startswith("camtool")}
    assert ours == {"camtool", "camtool.version"}


def test_an_svg_does_not_load_the_dxf_library() -> None:
    loaded = loaded_by("check", "samples/logo.svg")
    assert "ezdxf" not in loaded
    assert "numpy" in loaded
