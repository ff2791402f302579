"""``fdi observe`` and ``fdi watch`` of a connection: what they print, keep and refuse."""

import socket
from pathlib import Path

import pytest
from live.playing import Player, frames_of
from methods.observer.build import write
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.report.observer_files import FILES

from .conftest import Run


@pytest.fixture(scope="module")
def weak(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("weak") / "weak.tlog", weak=(1, 0.7, 40.0, 50.0))


def played(path: Path) -> str:
    return Player(b"".join(frames_of(path)[0])).name


def test_a_flight_is_observed_kept_and_told(run: Run, weak: Path) -> None:
    ended = run("observe", played(weak), "--record", "k.tlog", "--seconds", 4, "--out", "seen")
    assert ended.code == 0
    assert "heard system 1, a quad with ardupilot\n" in ended.out
    assert "\nMOTOR 1 gives less than it is asked for since 4" in ended.out
    assert frames_of(Path("k.tlog"))[0] == frames_of(weak)[0]
    assert {one.name for one in Path("seen").iterdir()} >= set(FILES)
    assert f"{len(frames_of(weak)[0])} messages are in k.tlog" in ended.err


def test_without_a_folder_the_command_for_the_figures_is_told(run: Run, weak: Path) -> None:
    ended = run("observe", played(weak), "--record", "my flight.tlog", "--seconds", 1)
    assert ended.code == 0
    assert "the figures of it: fdi observe 'my flight.tlog' --out observed" in ended.err
    ended = run("watch", played(weak), "--record", "k.tlog", "--seconds", 1)
    assert ended.code == 0
    assert "the report of the whole flight: fdi analyze k.tlog --out analysis" in ended.err


def test_an_aeroplane_is_refused_and_what_was_heard_is_kept(run: Run, tmp_path: Path) -> None:
    plane = write(tmp_path / "plane.tlog", 10.0, kind=mav.MAV_TYPE_FIXED_WING)
    ended = run("observe", played(plane), "--record", "k.tlog", "--seconds", 5)
    assert ended.code == 3
    assert "multicopter" in ended.err
    assert frames_of(Path("k.tlog"))[0]


@pytest.mark.parametrize("command", ["observe", "watch"])
def test_nothing_heard_leaves_no_file(command: str, run: Run) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ended = run(command, f"udp:127.0.0.1:{port}", "--seconds", 0.3)
    assert ended.code == 0
    assert f"nothing was heard on udp:127.0.0.1:{port}; no file is left" in ended.err
    assert not list(Path().glob("*.tlog"))


@pytest.mark.parametrize("command", ["observe", "watch"])
def test_a_port_in_use_is_one_line(command: str, run: Run) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        ended = run(command, f"udp:127.0.0.1:{taken.getsockname()[1]}")
    assert ended.code == 3
    assert ended.err.count("\n") == 1
    assert "cannot be opened: Address already in use" in ended.err
    assert not list(Path().glob("*.tlog"))


def test_an_existing_record_is_not_written_over(run: Run, weak: Path) -> None:
    Path("k.tlog").write_bytes(b"mine")
    ended = run("watch", played(weak), "--record", "k.tlog")
    assert ended.code != 0
    assert "k.tlog: is there already, and is not written over" in ended.err
    assert Path("k.tlog").read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("observe", "udp:127.0.0.1:9", "--json"), "are of a log, not of a connection"),
        (("observe", "flight.tlog", "--seconds", 3), "are of a connection"),
        (("watch", "flight.tlog"), "is no connection"),
        (("watch", "udp:127.0.0.1:9", "--policy", "paper"), "its thresholds from a whole flight"),
        (("observe", "udp:127.0.0.1:9", "--outputs", "phi,theta,psi"), "x, y, z"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_opened(
    words: tuple[object, ...], told: str, run: Run
) -> None:
    ended = run(*words)
    assert ended.code == 2
    assert told in ended.err
