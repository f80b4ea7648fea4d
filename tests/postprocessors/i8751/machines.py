"""The sample machine for the i8751 tests, with options."""

from pathlib import Path

from camtool.target.registry import LoadedTarget, load_target

ROOT = Path(__file__).parents[3]
SAMPLE = ROOT / "samples" / "i8751-sample.toml"
STEP_MM = 0.0125

OPTIONS = (
    "plus_backward=xz",
    "key=each-packet",
    "dwell_mark=30H",
    "motor_reply='8'",
    "dwell_reply=M",
    "dwell_reply=none",
    "dwell_reply=unstated",
    "long_runs=true",
    "high_byte='255'",
    "first_pulse=repeats",
    "z_alone=with-step",
    "cruise=declared",
    "delay=counted",
    "start_reload=246",
    "elbow=flows",
)
"""One setting for each other reading of the thesis."""


def loaded(*settings: str) -> LoadedTarget:
    """The sample machine; settings are of [dialect]."""
    return load_target(
        "i8751", machine_file=SAMPLE, settings=[f"dialect.{setting}" for setting in settings]
    )
