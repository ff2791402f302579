"""Where do the bytes of a vehicle come from while it flies? A `Link`.

In: a text as pymavlink spells connections. Out: an open link that gives what has arrived.

=========================  =========================================================================
``udp:HOST:PORT``          listens there, as ``udpin:`` does
``udpout:HOST:PORT``       listens to who is there; a ground station's heartbeat a second says whom
                           to send to, which is the only thing that is ever sent
``tcp:HOST:PORT``          connects, and again when the other side has closed
``/dev/tty...[,BAUD]``     a serial port (``COM3,57600``), 115200 baud; needs pyserial
=========================  =========================================================================

Sockets are the standard library's: pymavlink's print, let two programs bind one UDP port, and wait
for seconds while they connect anew.
"""

from __future__ import annotations

import re
import select
import socket
import stat
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Protocol

from fdi.errors import LogError, UsageError

PIECE: Final = 1 << 16
"""Bytes that a link gives at once."""
CONNECT_S: Final = 5.0
AGAIN_S: Final = 1.0
"""A connection that was closed is tried again so often, and a heartbeat sent."""
BAUD: Final = 115200
_NETWORK: Final = re.compile(r"(udp|udpin|udpout|tcp):(.*)")
_ADDRESS: Final = re.compile(r"(?:(\[[0-9A-Fa-f:]+\]|[^:\[\]]*):)?(\d{1,5})")
_SERIAL: Final = re.compile(r"(/dev/[^,]+|COM\d+)(?:,(\d+))?", re.IGNORECASE)


class Link(Protocol):
    """An open connection."""

    def receive(self, wait_s: float) -> bytes:
        """Return what has come, at most `PIECE` bytes; nothing after so long, s, without any."""

    def close(self) -> None:
        """Close it."""


def is_connection(text: str) -> bool:
    """Return whether a text names a connection and no file.

    Examples
    --------
    >>> [is_connection(text) for text in ("udp:127.0.0.1:14550", "COM3", "flight.tlog")]
    [True, True, False]
    """
    if _NETWORK.fullmatch(text):
        return True
    serial = _SERIAL.fullmatch(text)
    if serial is None:
        return False
    path = Path(serial[1])
    if serial[1][:4] != "/dev" or stat.S_ISCHR(_mode(path)):
        return True
    # one that is not plugged in; and no file of a folder that there is not
    return _mode(path) == 0 and path.parent.is_dir()


def _mode(path: Path) -> int:
    try:
        return path.stat().st_mode
    except OSError:
        return 0


def open_link(text: str) -> Link:
    """Return an open link.

    Raises
    ------
    UsageError
        The text names no connection.
    LogError
        It cannot be opened: the port is in use, nobody answers, a serial port needs pyserial.
    """
    network = _NETWORK.fullmatch(text)
    if network is None:
        serial = _SERIAL.fullmatch(text)
        if serial is None:
            raise UsageError(f"{text!r} is no connection", hint="udp:, udpout:, tcp: or a port")
        return _serial(text, serial[1], int(serial[2] or BAUD))
    kind, rest = network.groups()
    address = _ADDRESS.fullmatch(rest)
    if address is None or not 0 < int(address[2]) < 1 << 16:
        raise UsageError(f"{text!r} names no host and port", hint=f"{kind}:127.0.0.1:14550")
    host = (address[1] or "").strip("[]") or ("0.0.0.0" if kind in ("udp", "udpin") else "")
    place = host or "127.0.0.1", int(address[2])
    try:
        if kind == "tcp":
            return Tcp(place, socket.create_connection(place, CONNECT_S))
        return _udp(place, is_out=kind == "udpout")
    except OSError as error:
        raise LogError(_reason(error), where=text) from error


def _reason(error: OSError) -> str:
    return f"cannot be opened: {error.strerror or error}"


@dataclass(slots=True)
class Udp:
    """Datagrams to a port; ``beat``: what is sent once a second, nothing for a port of our own."""

    port: socket.socket
    beat: bytes = b""
    _sent: float = field(default=-AGAIN_S)

    def receive(self, wait_s: float) -> bytes:
        """Return the datagrams that have come."""
        if self.beat and time.monotonic() - self._sent >= AGAIN_S:
            self._sent = time.monotonic()
            self._send()
        if not select.select([self.port], [], [], wait_s)[0]:
            return b""
        found, size = [], 0
        while size < PIECE:
            try:
                found.append(self.port.recv(PIECE))
            except OSError:  # no more, or nobody listens there yet
                break
            size += len(found[-1])
        return b"".join(found)

    def _send(self) -> None:
        try:
            self.port.send(self.beat)
        except OSError:  # nobody listens there yet: it is sent again
            return

    def close(self) -> None:
        """Close the port."""
        self.port.close()


def _udp(place: tuple[str, int], *, is_out: bool) -> Udp:
    found = socket.getaddrinfo(*place, type=socket.SOCK_DGRAM)[0]
    port = socket.socket(found[0], found[1])
    try:
        (port.connect if is_out else port.bind)(found[4])
    except OSError:
        port.close()
        raise
    port.setblocking(False)
    return Udp(port, _heartbeat() if is_out else b"")


def _heartbeat() -> bytes:
    """Return the heartbeat of a ground station."""
    from pymavlink.dialects.v20 import common

    kind, none = common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID
    beat = common.MAVLink_heartbeat_message(kind, none, 0, 0, common.MAV_STATE_ACTIVE, 3)
    return bytes(beat.pack(common.MAVLink(None, 255, 190)))


@dataclass(slots=True)
class Tcp:
    """A connection that is made again when the other side closes it; None while there is none."""

    place: tuple[str, int]
    port: socket.socket | None
    _tried: float = 0.0

    def receive(self, wait_s: float) -> bytes:
        """Return what has come."""
        if self.port is None:
            self._connect(wait_s)
        if self.port is None or not select.select([self.port], [], [], wait_s)[0]:
            return b""
        try:
            found = self.port.recv(PIECE)
        except OSError:
            found = b""
        if not found:
            self.close()
            self._tried = time.monotonic()
        return found

    def _connect(self, wait_s: float) -> None:
        if time.monotonic() - self._tried < AGAIN_S:
            time.sleep(wait_s)
            return
        self._tried = time.monotonic()
        try:
            self.port = socket.create_connection(self.place, AGAIN_S)
        except OSError:  # the link is dead, as is told; it is tried again
            time.sleep(wait_s)

    def close(self) -> None:
        """Close the connection."""
        if self.port is not None:
            self.port.close()
            self.port = None


@dataclass(slots=True)
class Serial:
    """A serial port of pyserial; one that fails is opened again."""

    port: Any

    def receive(self, wait_s: float) -> bytes:
        """Return what has come."""
        try:
            self.port.timeout = wait_s
            if not self.port.is_open:
                self.port.open()
            first: bytes = self.port.read(1)
            return first + bytes(self.port.read(min(self.port.in_waiting, PIECE - 1)))
        except OSError:  # unplugged: the link is dead, as is told
            self.port.close()
            time.sleep(wait_s)
            return b""

    def close(self) -> None:
        """Close the port."""
        self.port.close()


def _serial(text: str, name: str, baud: int) -> Serial:
    try:
        import serial  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError as error:
        told = "is a serial port, which the package pyserial reads, and that is not installed"
        raise LogError(told, where=text, hint="pip install pyserial") from error
    try:
        return Serial(serial.Serial(name, baud, timeout=0))
    except (OSError, ValueError) as error:
        raise LogError(f"cannot be opened: {error}", where=text) from error
