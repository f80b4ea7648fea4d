"""What pyproject.toml cannot say: which modules are compiled, and all packages."""

import sys
from pathlib import Path

from setuptools import setup

sys.path.insert(0, str(Path(__file__).parent / "build_backend"))

from camtool_build import settings

setup(**settings())
