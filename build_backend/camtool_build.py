"""The build backend: setuptools, and the compiled loops made by Cython on the way.

A module is compiled when a .pxd lies beside it, which holds nothing but C types: its .py stays
plain Python, and runs uncompiled too. Cython is given a copy of both under build/, in which

- numbers stand in functions for the constants of modules (NAMES IN CAPITALS, math.inf and so on):
  C knows them when it is compiled, and a module's own names would be looked up in a dictionary;
- names that the .pxd cimports are not imported once more.

Where there is no C compiler, zig's is asked for, a wheel from the package index. With
CAMTOOL_CHECKED=1 in the environment every index is checked, and what C leaves undefined (integers
that overflow, numbers that fit no integer, and so on) ends the program. CAMTOOL_CHECKED=address
also checks each access of memory: it needs the compiler's libasan, loaded before Python.
"""

from __future__ import annotations

import ast
import math
import os
import re
import shutil
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from setuptools import Extension, build_meta
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).parents[1]
ROOMS = {"camtool": "camtool", "camtool_postprocessors": "postprocessors"}
"""The packages that are installed, and their folders here."""

SHARED = "camtool.kernels._memoryviews"
"""What all compiled modules need of Cython's memoryviews, once."""

CHECKED = os.environ.get("CAMTOOL_CHECKED", "")

DIRECTIVES = {
    "language_level": 3,
    "annotation_typing": False,  # types stand in the .pxd
    "infer_types": True,
    "boundscheck": bool(CHECKED),
    "initializedcheck": bool(CHECKED),
    "wraparound": False,
    "cdivision": True,  # as in C: 1/0 is inf, and // and % are for numbers that are not negative
    "cpow": True,
    "auto_pickle": False,
}

FLAGS = {
    "unix": ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0", "-w"],
    "msvc": ["/O2", "/fp:precise"],
}
"""No sum is fused with a product: all processors round alike."""

if CHECKED:
    kinds = "undefined,float-cast-overflow" + (",address" if CHECKED == "address" else "")
    FLAGS["unix"] += ["-O1", "-fno-wrapv", f"-fsanitize={kinds}"]
    FLAGS["unix"] += ["-fsanitize-undefined-trap-on-error"]

WIDE = """
#if defined(__x86_64__) && defined(__GNUC__)
#define WIDE_BODY(result) static inline __attribute__((always_inline)) result
#define WIDE(result, name, given, passed) \\
  __attribute__((flatten, target("avx512f,avx512bw,avx512dq,avx512vl"))) \\
  static result name##_512 given { return name##_body passed; } \\
  __attribute__((flatten, target("avx2"))) \\
  static result name##_256 given { return name##_body passed; } \\
  static result name##_128 given { return name##_body passed; } \\
  static result name given { \\
    if (__builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) \\
      return name##_512 passed; \\
    return __builtin_cpu_supports("avx2") ? name##_256 passed : name##_128 passed; \\
  }
#else
#define WIDE_BODY(result) static result
#define WIDE(result, name, given, passed) static result name given { return name##_body passed; }
#endif
"""
"""C for functions that a .pxd marks by a comment, `# wide`: machine code for three kinds of x86
processors, of which they take the one that runs them. What is rounded is the same in all."""

MOST_DIMENSIONS = 3
"""Of the arrays that kernels take. Cython hands an array over by value, sets it to 0 first, and
leaves room for eight dimensions, 208 bytes: half of what calls and slices cost."""

MARKED = "/* marked */\n"
"""How C ends in which functions are marked already; how it begins is known to Cython."""

NUMBERS = {
    ("math", "inf"): math.inf,
    ("math", "nan"): math.nan,
    ("math", "pi"): math.pi,
    ("np", "inf"): math.inf,
    ("np", "nan"): math.nan,
    ("np", "pi"): math.pi,
}


def compiled_modules() -> dict[str, Path]:
    """The source of each module that is compiled, by its name."""
    found = {}
    for package, folder in ROOMS.items():
        for types in sorted((ROOT / folder).rglob("*.pxd")):
            parts = types.relative_to(ROOT / folder).with_suffix("").parts
            if types.with_suffix(".py").exists():
                found[".".join([package, *parts])] = types.with_suffix(".py")
    return found


def source_of(module: str) -> Path | None:
    """The file of a module of ours, or None."""
    package, *parts = module.split(".")
    if package not in ROOMS or not parts:
        return None
    path = (ROOT / ROOMS[package]).joinpath(*parts).with_suffix(".py")
    return path if path.exists() else None


def imported_from(node: ast.ImportFrom, module: str) -> str:
    """The whole name of the module that an import in `module` speaks of."""
    above = module.split(".")[: -node.level] if node.level else []
    return ".".join([*above, *([node.module] if node.module else [])])


def constants(module: str) -> dict[str, Any]:
    """The numbers, and tuples of numbers, that a module has under names in capitals."""
    path = source_of(module)
    known: dict[str, Any] = {}
    if path is None:
        return known
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            names = [(each.name, each.asname or each.name) for each in node.names]
            if any(name.isupper() for name, _ in names):
                theirs = constants(imported_from(node, module))
                known |= {mine: theirs[name] for name, mine in names if name in theirs}
        elif isinstance(node, ast.Assign):
            code = compile(ast.Expression(node.value), str(path), "eval")
            try:
                value = eval(code, {"__builtins__": {"range": range}, "math": math}, dict(known))
            except (NameError, TypeError, AttributeError, KeyError):
                continue
            for target in node.targets:
                if isinstance(target, ast.Name):
                    known[target.id] = value
                elif isinstance(target, ast.Tuple):
                    each = [name.id for name in target.elts if isinstance(name, ast.Name)]
                    known |= dict(zip(each, value, strict=True))
    return {
        name: value
        for name, value in known.items()
        if name.isupper() and all(isinstance(part, int | float) for part in _parts(value))
    }


def _parts(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) and value else (value,)


def large(value: Any) -> bool:
    """Whether C needs to be told the type of a number; Cython would make a Python object of it."""
    return isinstance(value, int) and abs(value) >= 1 << 31


def named_in_c(known: dict[str, Any]) -> str:
    """C's names of large numbers, for a .pxd."""
    lines = []
    for name, value in known.items():
        if large(value):
            sign = "unsigned " if value >= 1 << 63 else ""
            define = f"#define CAMTOOL_{name} {value}{'U' if sign else ''}LL"
            lines += ['    """', f"    {define}", '    """', f"    {sign}long long CAMTOOL_{name}"]
    return "".join(
        f"\n\ncdef extern from *:\n{chr(10).join(lines[k : k + 4])}"
        for k in range(0, len(lines), 4)
    )


def as_text(value: Any) -> str:
    """A number, or a tuple of numbers, as Cython reads it."""
    if isinstance(value, tuple):
        return f"({', '.join(as_text(part) for part in value)},)"
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return f"({value!r})"


def lowered(text: str, module: str, cimported: set[str]) -> str:
    """What Cython is given of a module."""
    known, lines = constants(module), text.encode().split(b"\n")
    tree = ast.parse(text)
    for node in reversed(list(_replaced(tree, known, cimported))):
        low, high = node.lineno - 1, (node.end_lineno or node.lineno) - 1
        if isinstance(node, ast.Name):
            value = known[node.id]
            new = f"CAMTOOL_{node.id}" if large(value) else as_text(value)
        elif isinstance(node, ast.Attribute):
            new = as_text(NUMBERS[_dotted(node)])
        else:
            new = _without(node, cimported)
        whole = (
            lines[low][: node.col_offset] + new.encode() + lines[high][node.end_col_offset or 0 :]
        )
        # As many lines as before, so that Cython's messages point to the right ones.
        lines[low : high + 1] = [whole, *[b""] * (high - low)]
    return b"\n".join(lines).decode()


def _replaced(
    tree: ast.Module, known: dict[str, Any], cimported: set[str]
) -> Iterator[ast.Name | ast.Attribute | ast.Import | ast.ImportFrom]:
    """What does not stay as it is, in its order."""
    found: list[Any] = []
    for top in tree.body:
        if isinstance(top, ast.Import | ast.ImportFrom):
            if any((each.asname or each.name) in cimported for each in top.names):
                found.append(top)
            continue
        within = isinstance(top, ast.FunctionDef | ast.ClassDef)
        for node in ast.walk(top):
            constant = within and isinstance(node, ast.Name) and node.id in known
            if constant or (isinstance(node, ast.Attribute) and _dotted(node) in NUMBERS):
                found.append(node)
    yield from sorted(found, key=lambda node: (node.lineno, node.col_offset))


def _dotted(node: ast.Attribute) -> tuple[str, str]:
    return (node.value.id if isinstance(node.value, ast.Name) else "", node.attr)


def _without(node: ast.Import | ast.ImportFrom, cimported: set[str]) -> str:
    """An import without the names that the .pxd cimports."""
    node.names = [each for each in node.names if (each.asname or each.name) not in cimported]
    return ast.unparse(node) if node.names else "pass"


def cimported_names(types: str) -> set[str]:
    """The names that a .pxd cimports."""
    found = re.findall(r"^from \S+ cimport (?:\(([^)]*)\)|(.*))$", types, re.MULTILINE)
    names = ",".join(within or plain for within, plain in found).split(",")
    return {name.split()[-1] for name in names if name.strip()}


def lowered_copies(folder: Path) -> list[Extension]:
    """Writes what Cython is given into `folder`; what is to be compiled there."""
    made = []
    for types in (ROOT / ROOMS["camtool"] / "kernels").glob("*.pxd"):
        if not types.with_suffix(".py").exists():
            _write(folder / "camtool" / "kernels" / types.name, types.read_text(encoding="utf-8"))
    for module, source in compiled_modules().items():
        target = folder.joinpath(*module.split(".")).with_suffix(".py")
        target.parent.mkdir(parents=True, exist_ok=True)
        for above in target.parents[: len(module.split(".")) - 1]:
            (above / "__init__.py").touch()
        types = source.with_suffix(".pxd").read_text(encoding="utf-8")
        text = lowered(source.read_text(encoding="utf-8"), module, cimported_names(types))
        types += named_in_c(constants(module)) + "\n"
        if CHECKED:
            # What is found wrong is raised, and not only said.
            types = types.replace(" noexcept", "")
        _write(target, text)
        _write(target.with_suffix(".pxd"), types)
        made.append(Extension(module, [str(target)]))
    shared = folder.joinpath(*SHARED.split(".")).with_suffix(".c")
    return [*made, Extension(SHARED, [str(shared)])]


def _write(path: Path, text: str) -> None:
    """Leaves a file alone that has this text: what was made of it is still good."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def mark_functions(folder: Path, module: Extension) -> None:
    """Does in the C of a module what the comments `# inline` and `# wide` of its .pxd ask for."""
    types = folder.joinpath(*module.name.split(".")).with_suffix(".pxd")
    source = types.with_suffix(".c")
    if not types.exists() or (text := source.read_text(encoding="utf-8")).endswith(MARKED):
        return
    prefix = "__pyx_f_" + "".join(f"{len(part)}{part}_" for part in module.name.split("."))
    marks = re.findall(
        r"(\w+)\([^()]*\) noexcept  # (inline|wide)$", types.read_text(), re.MULTILINE
    )
    for name, mark in ((prefix + name, mark) for name, mark in marks):
        if mark == "inline":
            pattern = rf"^static (?=[^\n;]* {name}\()"
            text = re.sub(pattern, "static CYTHON_INLINE ", text, flags=re.MULTILINE)
            continue
        head = re.search(rf"^static (.+) {name}\((.*)\) \{{$", text, re.MULTILINE)
        assert head, f"{module.name}: {name}"
        result, given = head.groups()
        passed = ", ".join(each.split()[-1] for each in given.split(", "))
        body = f"static {result} {name}({given}); WIDE_BODY({result}) {name}_body({given}) {{"
        text = text[: head.start()] + body + text[head.end() :]
        text += f"\nWIDE({result}, {name}, ({given}), ({passed}))\n"
    text = text.replace('#include "Python.h"', '#include "Python.h"' + WIDE, 1)
    source.write_text(text + MARKED, encoding="utf-8")


class BuildKernels(build_ext):
    """Makes the modules that are compiled."""

    def finalize_options(self) -> None:
        """All cores, and where the copies for Cython lie."""
        super().finalize_options()
        self.parallel = self.parallel or os.cpu_count()

    def run(self) -> None:
        """From Python to C, and from there to machine code."""
        from Cython.Compiler import Options

        Options.buffer_max_dims = MOST_DIMENSIONS + 1  # read when what follows is loaded
        from Cython.Build import cythonize

        before, mode = Path.cwd(), f"checked-{CHECKED}" if CHECKED else "lowered"
        folder, latest = ROOT / "build" / mode, ROOT / "build" / "latest"
        # What the other kind of build left beside the sources is newer than what this one reads.
        self.force = self.force or not latest.exists() or latest.read_text() != mode
        modules = lowered_copies(folder)
        os.chdir(folder)
        try:
            relative = [
                Extension(each.name, [str(Path(each.sources[0]).relative_to(folder))])
                for each in modules
            ]
            made = cythonize(
                relative,
                compiler_directives=DIRECTIVES,
                shared_utility_qualified_name=SHARED,
                nthreads=0 if sys.platform == "win32" else os.cpu_count() or 1,
                quiet=True,
            )
        finally:
            os.chdir(before)
        for each in made:
            mark_functions(folder, each)
            each.sources = [str(folder / source) for source in each.sources]
            each._needs_stub = False
        self.extensions = made
        super().run()
        latest.write_text(mode)

    def build_extensions(self) -> None:
        """With the flags of the compiler at hand."""
        kind = "msvc" if self.compiler.compiler_type == "msvc" else "unix"
        for each in self.extensions:
            each.extra_compile_args = FLAGS[kind]
        super().build_extensions()


def settings() -> dict[str, Any]:
    """What setup.py tells setuptools."""
    packages = []
    for package, folder in ROOMS.items():
        for init in sorted((ROOT / folder).rglob("__init__.py")):
            parts = init.parent.relative_to(ROOT / folder).parts
            packages.append(".".join([package, *parts]))
    modules = [Extension(name, []) for name in [*compiled_modules(), SHARED]]
    return {
        "packages": packages,
        "package_dir": ROOMS,
        "ext_modules": modules,
        "cmdclass": {"build_ext": BuildKernels},
    }


def has_compiler() -> bool:
    """Whether a C compiler is there; on Windows setuptools looks for Visual Studio's itself."""
    if sys.platform == "win32":
        return True
    named = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    return shutil.which(named.split()[0]) is not None


def use_zig() -> None:
    """Let zig's compiler stand in for the one that is not there."""
    if not has_compiler():
        compiler = f"{sys.executable} -m ziglang cc"
        os.environ |= {"CC": compiler, "LDSHARED": f"{compiler} -shared"}


# The hooks of a build backend.

build_sdist = build_meta.build_sdist
prepare_metadata_for_build_wheel = build_meta.prepare_metadata_for_build_wheel
prepare_metadata_for_build_editable = build_meta.prepare_metadata_for_build_editable
get_requires_for_build_sdist = build_meta.get_requires_for_build_sdist


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """setuptools and Cython stand in pyproject.toml."""
    return [] if has_compiler() else ["ziglang"]


get_requires_for_build_editable = get_requires_for_build_wheel


def build_wheel(folder: str, config_settings: Any = None, metadata: str | None = None) -> str:
    """A wheel with what was compiled."""
    use_zig()
    return str(build_meta.build_wheel(folder, config_settings, metadata))


def build_editable(folder: str, config_settings: Any = None, metadata: str | None = None) -> str:
    """The compiled modules lie beside their sources."""
    use_zig()
    return str(build_meta.build_editable(folder, config_settings, metadata))
