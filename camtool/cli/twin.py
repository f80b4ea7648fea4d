"""`camtool twin`: a virtual machine at a port, to try a sender on."""

from __future__ import annotations

import signal
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, TextIO

import click

from camtool.cli.files import check_new
from camtool.cli.messages import say, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.errors import OptionError, OutputError
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.twin import Clock, PseudoTerminal, TcpPort, TwinPort, serve

if TYPE_CHECKING:
    from camtool.target.twin import Twin, TwinTrace

MAX_SPEED = "max"
"""The value of --speed for a clock that does not wait."""

LOOPBACK = "127.0.0.1"

COLUMNS = "time_s,block,x_commanded_mm,y_commanded_mm,z_commanded_mm,x_mm,y_mm,z_mm"
"""The head of a trace; blocks count from 0, −1 is a command."""


def parse_speed(text: str) -> float | None:
    """Parse a factor above 0, or `max` to None. OptionError for other text."""
    if text == MAX_SPEED:
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.0 < speed < float("inf"):
        raise OptionError(f"--speed {text!r} is no factor", mend="give 1, 10, or max")
    return speed


def parse_address(text: str) -> tuple[str, int]:
    """Parse `5007` (on loopback) or `192.168.1.4:5007`; port 0 is any free one."""
    host, _, port = text.rpartition(":")
    if not port.isdigit() or int(port) > 65535:
        raise OptionError(f"--tcp {text!r} is no port", mend="give 5007, or ADDRESS:5007")
    return host.strip("[]") or LOOPBACK, int(port)


@click.command(cls=SectionedCommand, short_help="A virtual machine at a port.")
@click.argument("target", metavar="TARGET")
@click.option("--machine", metavar="NAME", help="Your own machine, by name or TOML file.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Of the machine.")
@click.option("--tcp", metavar="[ADDRESS:]PORT", help="Not a pseudo-terminal; on loopback.")
@click.option("--speed", default="1", metavar="FACTOR", help="Of its clock, or max.  [1]")
@click.option(
    "--assume",
    multiple=True,
    metavar="KEY=VALUE",
    help="What its sources leave open; docs/wires has the choices of each target.",
)
@click.option(
    "--fault",
    default="",
    metavar="FAULTS",
    help="Of the line: drop=0.01,double,garble,late=2s,unplug=30s.",
)
@click.option("--seed", default=0, help="Of the faults.")
@click.option("--trace", metavar="FILE", help="What its slides did, as CSV.")
@click.option(
    "--once", "ends_with_client", is_flag=True, help="End when the first client has gone."
)
@talk_options
def twin(
    target: str,
    machine: str | None,
    settings: tuple[str, ...],
    tcp: str | None,
    speed: str,
    assume: tuple[str, ...],
    fault: str,
    seed: int,
    trace: str | None,
    ends_with_client: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Be the controller of TARGET, byte by byte, on a pseudo-terminal whose path is printed.

    It runs programs by the same model as camtool verify, in real time or faster. Ctrl-C ends it.

    \b
    camtool twin grbl                          then camtool send part.nc -t grbl --port PATH
    camtool twin grbl --tcp 5007 --speed max
    camtool twin pic-mmh --assume echo=character --fault drop=0.001 --trace slides.csv"""
    name = target if machine is None else None
    loaded_target = MachineFlags.of(name, machine, settings).load()
    virtual = loaded_target.twin(assume)
    factor, faults = parse_speed(speed), Faults.of(fault)
    wired = WiredTwin(virtual, faults, faults, seed=seed, paced=factor is not None)
    file = None if trace is None else _opened(trace)
    port: TwinPort = PseudoTerminal() if tcp is None else TcpPort(*parse_address(tcp))
    journal = _TraceWriter(virtual, file, verbose=verbose)
    show_text(port.name)
    say(f"camtool: {loaded_target.target.name} ({virtual.wire}); Ctrl-C ends it", quiet=quiet)
    before = signal.signal(signal.SIGTERM, _interrupted)
    try:
        with suppress(KeyboardInterrupt):
            serve(wired, port, Clock(factor), ends_with_client=ends_with_client, each=journal.note)
    finally:
        signal.signal(signal.SIGTERM, before)
        port.close()
        journal.note()
        if file is not None:
            file.close()
    x, y, z = virtual.slides.commanded_mm.tolist()
    summary = f"{len(virtual.decoded)} blocks in {virtual.now:.3f} s"
    say(f"camtool: {summary}; at X{x:.3f} Y{y:.3f} Z{z:.3f}", quiet=quiet)
    return 0


def _interrupted(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def _opened(name: str) -> TextIO:
    check_new(name)
    try:
        file = Path(name).open("w", encoding="ascii", newline="\n")  # noqa: SIM115 - `twin` closes it
    except OSError as error:
        raise OutputError(f"cannot be written ({error.strerror})", file=name) from error
    file.write(f"{COLUMNS}\n")
    return file


class _TraceWriter:
    """The trace that is written and the messages that are shown while a twin runs."""

    def __init__(self, virtual: Twin, file: TextIO | None, *, verbose: bool) -> None:
        self._twin, self._file, self._verbose = virtual, file, verbose
        self._shown = 0

    def note(self) -> None:
        """Write and show everything since the last call."""
        samples = self._twin.slides.drain()
        if self._file is not None and len(samples):
            self._file.write(rows(samples))
        for block in self._twin.decoded[self._shown :] if self._verbose else ():
            say(f"camtool: {self._twin.now:.3f} s: {block.decode('latin-1')}")
        self._shown = len(self._twin.decoded)


def rows(trace: TwinTrace) -> str:
    """Return a trace as CSV text."""
    columns = zip(
        trace.time_s.tolist(),
        trace.block.tolist(),
        trace.commanded.tolist(),
        trace.slide.tolist(),
        strict=True,
    )
    return "".join(
        f"{time!r},{block},{','.join(map(repr, [*commanded, *slide]))}\n"
        for time, block, commanded, slide in columns
    )
