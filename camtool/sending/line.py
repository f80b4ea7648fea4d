"""The line to a controller: a serial port, a pseudo-terminal or a socket, locked by one process.

pyserial opens all of them: `/dev/ttyUSB0`, `COM3`, `socket://localhost:5007`. Nothing listens on
the network here."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from camtool.errors import InputError, MachineError, OptionError
from camtool.lock import held
from camtool.target.wire import Manner, NoWire, Wire, port_fault

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget

WRITE_S: Final = 10.0

DRAIN_S: Final = 1.0
"""Time for the last bytes, such as those that stop a machine, to leave the computer."""

REOPEN_S: Final = 0.1
"""Interval at which a port that is gone is tried again."""

MAX_READ_BYTES: Final = 4096

_FRAMES: Final = ("8N1", "7N1", "8E1", "7E1", "8O1", "7O1", "8N2", "7E2")


class Port(Struct, frozen=True):
    """A port and its settings; `baud` None for ports without a rate."""

    name: str
    baud: int | None = None
    frame: str = "8N1"

    @property
    def is_virtual(self) -> bool:
        """True for sockets and pseudo-terminals, which have no rate."""
        if "://" in self.name:
            return True
        return os.path.realpath(self.name).startswith("/dev/pts/")


class OpenPort:
    """An open port. Raises OSError (of pyserial too) when it is gone."""

    def __init__(self, port: Port) -> None:
        self.port = port
        self._serial = _open_serial(port)

    def read(self, wait_s: float) -> bytes:
        """Return the bytes that have arrived, after at most `wait_s`."""
        self._serial.timeout = max(wait_s, 0.0)
        data = bytes(self._serial.read(1))
        if data:
            data += bytes(self._serial.read(min(self._serial.in_waiting, MAX_READ_BYTES)))
        return data

    def write(self, data: bytes) -> None:
        """Write all bytes."""
        self._serial.write(data)

    def reopen(self, wait_s: float) -> None:
        """Close the port for `REOPEN_S`, so that the other end notices, and open it again; wait at
        most `wait_s` for it to exist."""
        self.close()
        end = time.monotonic() + wait_s
        while True:
            time.sleep(REOPEN_S)
            try:
                self._serial = _open_serial(self.port)
            except (OSError, ValueError):
                if time.monotonic() >= end:
                    raise
            else:
                return

    def close(self) -> None:
        """Close the port once all written bytes have left the computer, at the latest after
        `DRAIN_S`."""
        end = time.monotonic() + DRAIN_S
        with suppress(OSError, ValueError, AttributeError):  # a socket does not say
            while self._serial.is_open and self._serial.out_waiting and time.monotonic() < end:
                time.sleep(DRAIN_S / 100.0)
        with suppress(OSError, ValueError):
            self._serial.close()


@contextmanager
def opened_line(port: Port) -> Iterator[OpenPort]:
    """Open and lock the port within the block; InputError if it cannot be used or another camtool
    has it."""
    if port.frame not in _FRAMES:
        raise InputError(f"{port.frame!r} is no frame", mend=f"give one of {', '.join(_FRAMES)}")

    def refuse_taken(who: str) -> InputError:
        return InputError(
            f"another camtool sends there ({who})", file=port.name, mend="end it first"
        )

    with held(_lock_of(port), refuse_taken):
        try:
            line = OpenPort(port)
        except (OSError, ValueError) as error:
            reason, mend = port_fault(error)
            raise InputError(
                f"the port cannot be opened ({reason})", file=port.name, mend=mend
            ) from error
        try:
            yield line
        finally:
            line.close()


def _lock_of(port: Port) -> Path:
    name = port.name if "://" in port.name else os.path.realpath(port.name)
    digest = hashlib.sha256(name.encode()).hexdigest()[:16]
    return Path(tempfile.gettempdir()) / f"camtool-port-{digest}.lock"


def _open_serial(port: Port) -> Any:
    import serial  # seldom needed

    settings: dict[str, Any] = {"timeout": 0.0, "write_timeout": WRITE_S}
    if port.baud is not None:
        settings["baudrate"] = port.baud
    if "://" not in port.name:
        bits, parity, stops = tuple(port.frame)
        # XON/XOFF stays off: 11H and 13H are bytes like any other to some controllers.
        settings |= {"bytesize": int(bits), "parity": parity, "stopbits": int(stops)}
        settings["exclusive"] = None if sys.platform == "win32" else True
    return serial.serial_for_url(port.name, **settings)


class SerialPort(Struct, frozen=True):
    """A serial port of this computer: its name, its description and its hardware id."""

    name: str
    description: str
    hardware: str


def list_serial_ports() -> list[SerialPort]:
    """List the serial ports of this computer, by name."""
    from serial.tools import list_ports

    serial_ports = [
        SerialPort(each.device, _known_text(each.description), _known_text(each.hwid))
        for each in list_ports.comports()
    ]
    return sorted(serial_ports, key=lambda each: each.name)


def _known_text(text: str | None) -> str:
    return "" if text in (None, "n/a") else str(text)


def wire_of(target: LoadedTarget) -> Wire:
    """Return the wire of a machine; MachineError with the reason and an alternative if it has
    none."""
    wire = target.target.wire()
    if isinstance(wire, NoWire):
        name = target.machine.target.name
        raise MachineError(f"camtool does not drive {name}: {wire.why}", mend=wire.mend)
    return wire


def manner_of(target: LoadedTarget, **choices: Any) -> Manner:
    """Return the settings of a conversation with the target's controller; MachineError for choices
    that the controller has no command for."""
    if choices.get("unlock") and not wire_of(target).unlocks:
        raise MachineError(
            f"{target.machine.target.name} has no command to unlock over its line",
            where="--unlock",
            mend="leave it out",
        )
    return Manner(**choices)


def port_of(name: str, baud: int | None, wire: Wire, target: LoadedTarget) -> Port:
    """Return the port of this name. Its rate is the given one, else that of the wire or the
    machine file; OptionError if the port needs a rate and none is known."""
    link = target.machine.link
    rate = baud or wire.baud or (round(link.baud) if link.baud else None)
    port = Port(name, rate, wire.frame)
    if rate is None and not port.is_virtual:
        raise OptionError("the rate of the port is not known", where="--baud", mend="give it")
    return port
