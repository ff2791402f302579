"""``fdi structure``: its pictures, sizes and exports, and what it refuses of them."""

import json
from pathlib import Path

import pytest

from tests.residuals.plants import TANKS

from .conftest import LOG, Run


def test_sizes_are_those_of_the_stated_accuracy(run: Run, model: Path) -> None:
    ended = run("structure", model, "--log", LOG, "--sizes", "--json")
    assert ended.code == 0
    sizes = json.loads(ended.out)["sizes"]
    (gps,) = (row for row in sizes["faults"] if row["fault"] == "GPS_RAW_INT.alt")
    assert gps["known"]
    assert 0.5 < gps["seen"] < 20  # 3 m of accuracy against another height
    assert "Smallest step" in run("structure", model, "--log", LOG, "--sizes").out


def test_the_cheapest_messages_for_a_wish_are_told(run: Run, model: Path) -> None:
    ended = run("structure", model, "--log", LOG, "--tell", "GPS_RAW_INT.alt=100", "--json")
    enough = json.loads(ended.out)["enough"]
    assert enough["wished"] == [{"fault": "GPS_RAW_INT.alt", "size": 100.0, "unit": "m"}]
    assert "GPS_RAW_INT" in enough["messages"]
    assert len(enough["messages"]) == 2  # a height and another one
    small = run("structure", model, "--log", LOG, "--tell", "GPS_RAW_INT.alt=0.001")
    assert "nothing in this log is enough" in small.out
    assert run("structure", model, "--log", LOG, "--tell", "GPS_RAW_INT.alt").code == 2
    assert "no fault of" in run("structure", model, "--log", LOG, "--tell", "nobody=1").err


def test_figures_and_exports_are_written(run: Run, model: Path) -> None:
    wanted = ("--figure", "sequence", "--export", "own.py")
    assert run("structure", model, *wanted).code == 0
    assert Path(f"{model.stem}-sequence.svg").read_text().startswith("<?xml")
    assert "def residuals(" in Path("own.py").read_text()
    assert run("structure", model, "--figure", "matrix.png").code == 0
    assert Path("matrix.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--sizes",), "need a flight"),
        (("--tell", "GPS_RAW_INT.alt=5"), "need a flight"),
        (("--figure", "portrait"), "no figure is called"),
        (("--figure", "a.bmp"), "no picture ends with"),
        (("--figure", "graph", "--out", "a.bmp"), "no picture ends with"),
        (("--out", "a.svg"), "--out is for a figure"),
        (("--figure", "sequence", "--test", "r99"), "no residual generator"),
        (("--export", "a.txt"), "no export ends with"),
    ],
)
def test_what_makes_no_sense_is_one_line(
    run: Run, model: Path, arguments: tuple[str, ...], said: str
) -> None:
    ended = run("structure", model, *arguments)
    assert ended.code == 2
    assert said in ended.err


def test_tests_that_integrate_are_counted_where_asked_for(run: Run, tmp_path: Path) -> None:
    model = tmp_path / "tanks.yaml"
    model.write_text(TANKS, encoding="utf-8")
    counts = []
    for option in ((), ("--integrate",)):
        found = json.loads(run("structure", model, "--json", *option).out)["structure"]
        counts.append((found["residual_generators"], found["not_implementable"]))
    assert counts == [(2, {"dynamic loop": 2}), (4, {})]
