"""Links: how they are spelled, opened, and what is said when they cannot be."""

import socket
import time

import pytest

from fdi.errors import FdiError, LogError, UsageError
from fdi.live.connection import is_connection, open_link


@pytest.mark.parametrize(
    "text", ["udp:127.0.0.1:14550", "udpin::14550", "udpout:h:1", "tcp:h:5760", "COM3,57600"]
)
def test_connections_are_told_from_files(text: str) -> None:
    assert is_connection(text)


def test_a_file_is_no_connection() -> None:
    assert not is_connection("flights/udp.tlog")
    assert not is_connection("/dev/null/x.tlog")


@pytest.mark.parametrize("text", ["udp:", "tcp:nowhere", "udp:127.0.0.1:99999", "udp:a:b:c"])
def test_an_address_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="names no host and port"):
        open_link(text)


def test_a_port_in_use_is_one_line_and_code_3() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(LogError, match="cannot be opened: Address already in use") as caught:
            open_link(f"udp:127.0.0.1:{taken.getsockname()[1]}")
    assert caught.value.exit_code == 3


def test_nobody_who_answers_is_one_line() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        with pytest.raises(LogError, match="cannot be opened: Connection refused"):
            open_link(f"tcp:127.0.0.1:{free.getsockname()[1]}")


def test_a_serial_port_is_opened_or_says_why_not() -> None:
    with pytest.raises(FdiError, match=r"pyserial|cannot be opened"):
        open_link("/dev/ttyNOWHERE9,57600")


def test_datagrams_come_as_they_were_sent() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    link = open_link(f"udp:127.0.0.1:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"one", ("127.0.0.1", port))
        sender.sendto(b"two", ("127.0.0.1", port))
        assert link.receive(1.0) == b"onetwo"
    assert link.receive(0.01) == b""
    link.close()


def test_udpout_tells_the_other_side_where_to_send() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        other.settimeout(60.0)
        link = open_link(f"udpout:127.0.0.1:{other.getsockname()[1]}")
        link.receive(0.0)
        beat, address = other.recvfrom(1000)
        assert beat[0] in (0xFD, 0xFE)
        other.sendto(b"answer", address)
        assert link.receive(1.0) == b"answer"
        link.close()


def test_tcp_connects_again_after_the_other_side_closed() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        server.accept()[0].close()
        assert link.receive(1.0) == b""
        since = time.monotonic()
        server.settimeout(60.0)
        found = b""
        again = None
        while not found and time.monotonic() - since < 60.0:
            found = link.receive(0.05)
            if again is None and link.port is not None:
                again = server.accept()[0]
                again.sendall(b"back")
        assert found == b"back"
        again.close()
        link.close()
