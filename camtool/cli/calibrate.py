"""`camtool calibrate`: a machine's numbers from measured coupons."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from camtool.calibration.measurements import read_measurements
from camtool.cli.files import STDOUT, check_places, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.plain import one_line, to_json
from camtool.tables import read_table


@click.command(cls=SectionedCommand, short_help="A machine's numbers from measured coupons.")
@click.argument("measurements", metavar="MEASUREMENTS")
@click.option("--target", "-t", metavar="NAME", help="The machine; see camtool targets.")
@click.option(
    "--machine", metavar="FILE", help="What is known of it so far, a file that extends the target."
)
@click.option("-o", "--output", metavar="FILE", help="The machine file to write; - is stdout.")
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@talk_options
def calibrate(
    measurements: str,
    target: str | None,
    machine: str | None,
    output: str | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Estimate steps, backlash and squareness from MEASUREMENTS, a TOML file of measured coupons.

    `camtool coupon` draws them and begins that file. With -o, a machine file for --machine is
    written, with the uncertainty and the source of each number behind it."""
    from camtool.calibration import calibrate as estimation
    from camtool.calibration.machine_file import machine_file

    flags = MachineFlags.of(target, machine, ()) if target or machine else None
    check_places([measurements, *(flags.files() if flags else ())], [output, report])
    measured = read_measurements(Path(measurements))
    flags = flags or MachineFlags.of(measured.target or None, None, ())
    machine_used = flags.load().machine
    progress().begin("estimating")
    result = estimation.calibrate(measured, machine_used)
    files: dict[str, bytes] = {}
    if output is not None:
        own_table = _own_table(flags.machine, str(flags.name()))
        files[output] = machine_file(result, measured, machine_used, own_table).encode()
    if report is not None:
        files[report] = to_json(estimation.to_data(result, machine_used)).encode()
    write_all(files)
    if STDOUT not in files and not quiet:
        for line in estimation.to_text(result, machine_used).splitlines():
            show_text(one_line(line))
    for line in estimation.outliers(result):
        say(f"camtool: warning: outlier: {one_line(line)}", quiet=quiet)
    if output is not None:
        say(f"written: {'stdout' if output == STDOUT else output}", quiet=quiet)


def _own_table(machine: str | None, target: str) -> dict[str, Any]:
    """Return the table of the user's machine file; without a file, a table with only the key
    `extends`."""
    return {"extends": target} if machine is None else read_table(Path(machine))
