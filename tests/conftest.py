"""Settings shared by all tests."""

import gc
import os
import signal

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

from tests.strategies import scaled

# What somebody who runs the tests keeps for camtool is no matter of theirs.
os.environ["XDG_CONFIG_HOME"] = "/nonexistent"

# Commands that tests start would compile all sources anew, each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# What tests write need not survive a crash of this computer, and a disk takes some 50 ms to say
# that it would. tests/cli/test_files.py shows that files are synchronised.
os.fsync = lambda handle: None

# Hypothesis draws some values from the constants of all modules that are loaded. Which those are
# depends on the tests that ran before in the same process: examples would differ between runs.
providers.is_local_module_file = lambda path: False

# Of a run, a quarter would be searches for garbage, each of which looks at thousands of tests that
# are kept. Commands search as seldom as this.
gc.set_threshold(150_000)

# The number of examples of a property that names none; tests.strategies scales all numbers. No
# deadline: speed is no matter of tests here.
settings.register_profile(
    "tests",
    max_examples=scaled(60),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.load_profile("tests")


def pytest_collection_finish() -> None:
    """The tests that were collected are kept to the end: no search looks at them."""
    gc.freeze()


def pytest_runtest_setup() -> None:
    """Let SIGINT interrupt again.

    A shell's background jobs ignore it, and so does `main()` at its end, which some tests call in
    this process: all processes that a later test begins would ignore it too.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--bless` writes golden files anew; without it a missing one fails."""
    parser.addoption("--bless", action="store_true", help="write the golden files anew")


@pytest.fixture
def bless(request: pytest.FixtureRequest) -> bool:
    """True if golden files are to be written anew (`--bless`)."""
    return bool(request.config.getoption("--bless"))
