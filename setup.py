"""Build camtool: its packages, and its kernels, which Cython compiles from the .pyx files.

`pip install .` runs this file with the Cython that pyproject.toml names. While you work on a
kernel, `python setup.py build_ext --inplace` compiles only what has changed. Results are kept in
build/, from where `pip install --editable .` takes them too.

With CAMTOOL_CHECKED=1 in the environment every index is checked, and undefined behaviour of C
(overflow of integers, floats that fit no integer, and so on) ends the program.
CAMTOOL_CHECKED=address also checks each access of memory; it needs the compiler's libasan, loaded
before Python.
"""

import os
import sys
import sysconfig
from pathlib import Path

import Cython
from Cython.Compiler import Options
from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext

# Cython passes arrays by value and reserves room for eight dimensions; our kernels have at most 3.
# Smaller arrays halve the cost of calls and slices. Read when Cython.Build is imported.
Options.buffer_max_dims = 4
from Cython.Build import cythonize  # noqa: E402
from Cython.Build.Dependencies import DependencyTree  # noqa: E402

FOLDERS = {"camtool": "camtool", "camtool_postprocessors": "postprocessors"}
CHECKED = os.environ.get("CAMTOOL_CHECKED", "")
CYTHON = Path(Cython.__file__).parent
BUILD = Path("build", f"checked-{CHECKED}" if CHECKED else "cython")

DIRECTIVES = {
    "language_level": 3,
    "annotation_typing": False,  # annotations are for readers, C types are declared by cdef
    "infer_types": True,
    "boundscheck": bool(CHECKED),
    "initializedcheck": bool(CHECKED),
    "wraparound": False,
    "cdivision": True,  # as in C: 1/0 is inf, // and % round towards 0
    "cpow": True,
    "auto_pickle": False,
}

# No product is fused with a sum, so that all processors round alike.
FLAGS = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0", "-w"]
if sys.platform == "win32":
    FLAGS = ["/O2", "/fp:precise"]
elif CHECKED:
    kinds = "undefined,float-cast-overflow" + (",address" if CHECKED == "address" else "")
    # Compiled in half the time of -O1; the tests with checks take as long.
    FLAGS += ["-Og", "-fno-wrapv", f"-fsanitize={kinds}", "-fsanitize-undefined-trap-on-error"]
    FLAGS += ["-DCAMTOOL_CHECKED"]


def changed_at(_: DependencyTree, file: str) -> float:
    """Return when a file changed, 0 for Cython's own, which pip unpacks anew for each build."""
    return 0.0 if Path(file).is_relative_to(CYTHON) else Path(file).stat().st_mtime


# What another version of Cython made, cythonize translates anew in any case.
DependencyTree.timestamp = changed_at


def packages() -> list[str]:
    """Return the names of all packages."""
    return [
        ".".join(filter(None, (package, inner)))
        for package, folder in FOLDERS.items()
        for inner in ["", *find_packages(folder)]
    ]


def kernels() -> list[Extension]:
    """Return the extension of each .pyx file, translated to C under build/."""
    # Changes when a checked build follows a plain one or the reverse: then all is compiled anew.
    mode = Path("build", "mode")
    mode.parent.mkdir(exist_ok=True)
    if not mode.exists() or mode.read_text(encoding="utf-8") != str(BUILD):
        mode.write_text(str(BUILD), encoding="utf-8")
    sources = {
        ".".join((package, *path.relative_to(folder).with_suffix("").parts)): path
        for package, folder in FOLDERS.items()
        for path in sorted(Path(folder).rglob("*.pyx"))
    }
    # One module holds Cython's own code for memoryviews, which all others need.
    shared = "camtool.kernels._memoryviews"
    sources[shared] = BUILD / "_memoryviews.c"
    return cythonize(
        [
            Extension(
                name,
                [str(path)],
                include_dirs=["camtool/kernels"],
                depends=["setup.py", "camtool/kernels/wide.h", str(mode)],
                extra_compile_args=FLAGS,
            )
            for name, path in sources.items()
        ],
        build_dir=str(BUILD),
        compiler_directives=DIRECTIVES,
        shared_utility_qualified_name=shared,
        nthreads=(os.cpu_count() or 1) if sys.platform == "linux" else 0,
        quiet=True,
    )


class BuildKernels(build_ext):
    """Compile into one folder, whether the installation is editable or not."""

    def finalize_options(self) -> None:
        """Replace the temporary folder of an editable installation by that of a normal one."""
        super().finalize_options()
        if self.editable_mode:
            folder = f"lib.{sysconfig.get_platform()}-{sys.implementation.cache_tag}"
            self.build_lib = str(Path("build", folder))


setup(
    packages=packages(),
    package_dir=FOLDERS,
    ext_modules=kernels(),
    cmdclass={"build_ext": BuildKernels},
    options={"build_ext": {"parallel": True}},
)
