"""The build backend of setuptools, with zig's C compiler where no other is installed.

zig comes as a wheel, `ziglang`, from the package index.
"""

import os
import shutil
import sys
import sysconfig

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403


def has_compiler() -> bool:
    """True if a C compiler is installed; on Windows setuptools looks for Visual Studio itself."""
    if sys.platform == "win32":
        return True
    compiler = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    return shutil.which(compiler.split()[0]) is not None


ZIG = [] if has_compiler() else ["ziglang"]

if ZIG:
    CC = f"{sys.executable} -m ziglang cc"
    os.environ |= {"CC": CC, "LDSHARED": f"{CC} -shared"}


def get_requires_for_build_wheel(config_settings=None):
    """Return what setuptools requires to build, and zig if needed."""
    return build_meta.get_requires_for_build_wheel(config_settings) + ZIG


def get_requires_for_build_editable(config_settings=None):
    """Return what setuptools requires to build, and zig if needed."""
    return build_meta.get_requires_for_build_editable(config_settings) + ZIG
