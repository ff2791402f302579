"""``fdi observe``: what it prints and writes, its JSON, its exit codes."""

import json
from importlib.resources import files
from pathlib import Path

import jsonschema
import pytest
from methods.observer.build import write
from pymavlink.dialects.v20 import ardupilotmega as mav

from fdi.report.observer_files import FILES

from .conftest import Run


@pytest.fixture(scope="module")
def weak(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("weak") / "weak.tlog", weak=(1, 0.7, 30.0, 45.0))


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("healthy") / "healthy.tlog")


def test_a_weak_motor_is_told_first(run: Run, weak: Path) -> None:
    ended = run("observe", weak)
    assert ended.code == 0
    assert ended.err == ""
    assert ended.out.splitlines()[1].startswith("Motor 1 gives less than it is asked for, 30.")


def test_a_healthy_flight_says_so(run: Run, healthy: Path) -> None:
    ended = run("observe", healthy)
    assert ended.code == 0
    assert "No residual stays beyond what noise and the model explain." in ended.out


def test_json_keeps_its_schema_and_is_the_same_every_time(
    run: Run, weak: Path, healthy: Path
) -> None:
    schema = json.loads(files("fdi.report").joinpath("observer.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    first = run("observe", weak, "--json")
    some = run("observe", healthy, "--json", "--outputs", "x,y,z,phi,theta,psi")
    for ended in (first, some):
        jsonschema.Draft202012Validator(schema).validate(json.loads(ended.out))
    assert [one["component"] for one in json.loads(first.out)["weak_motors"]] == ["motor_1"]
    assert run("observe", weak, "--json").out == first.out


def test_the_schema_is_strict(run: Run, weak: Path) -> None:
    schema = json.loads(files("fdi.report").joinpath("observer.schema.json").read_text())
    document = json.loads(run("observe", weak, "--json").out)
    for damage in (
        lambda d: d.update(extra=1),
        lambda d: d["residuals"].pop(),
        lambda d: d["alarms"][0].update(residual="odd"),
        lambda d: d["weak_motors"][0].update(component="motor"),
    ):
        damaged = json.loads(json.dumps(document))
        damage(damaged)
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.Draft202012Validator(schema).validate(damaged)


def test_a_folder_holds_text_table_and_three_figures(run: Run, weak: Path, tmp_path: Path) -> None:
    out = tmp_path / "observed"
    assert run("observe", weak, "--out", out).code == 0
    assert {path.name for path in out.iterdir()} == {*FILES, ".fdi-manifest.json"}
    assert (out / "residuals.png").read_bytes().startswith(b"\x89PNG")
    head, *rows = (out / "residuals.csv").read_text().splitlines()
    assert len(head.split(",")) == 1 + 2 * 13
    assert len(rows) > 400


def test_a_vehicle_of_ones_own_is_taken(run: Run, weak: Path, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("mass: 2\ninertia: [0.01, 0.01, 0.02]\narm: 0.3\ntorque_per_thrust: 0.04\n")
    told = json.loads(run("observe", weak, "--vehicle", path, "--json").out)
    assert told["observer"]["vehicle"]["mass_kg"] == 2
    assert told["observer"]["vehicle"]["inertia_kg_m2"] == [0.01, 0.01, 0.02]
    assert [one["component"] for one in told["weak_motors"]] == ["motor_1"]


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("--outputs", "vx,vy"), 2),
        (("--outputs", "x,height"), 2),
        (("--flight", "9"), 2),
        (("--vehicle", "nowhere.yaml"), 4),
    ],
)
def test_what_is_wrong_ends_with_its_code_and_one_line(
    run: Run, weak: Path, words: tuple[str, ...], code: int
) -> None:
    ended = run("observe", weak, *words)
    assert ended.code == code
    assert ended.out == ""
    assert len(ended.err.splitlines()) == 1


def test_a_plane_ends_with_3(run: Run, tmp_path: Path) -> None:
    path = write(tmp_path / "plane.tlog", kind=mav.MAV_TYPE_FIXED_WING, seconds=20.0)
    ended = run("observe", path)
    assert ended.code == 3
    assert "is of a plane" in ended.err


def test_what_is_beyond_for_a_moment_is_told_as_brief_and_never_as_within(
    run: Run, tmp_path: Path
) -> None:
    log = write(tmp_path / "blow.tlog", weak=(1, 0.0, 30.0, 30.15))
    residuals = json.loads(run("observe", log, "--json").out)["residuals"]
    brief = [one["name"] for one in residuals if one["state"] == "briefly beyond"]
    assert brief
    assert {one["state"] for one in residuals if one["largest_over_threshold"] > 1} <= {
        "beyond",
        "briefly beyond",
    }
    said = run("observe", log).out
    assert f"Only briefly beyond it, which accuses nothing: {', '.join(brief)}." in said
    assert said.count("  briefly beyond") == len(brief)
