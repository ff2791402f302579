"""What docs/airframe.md and docs/tutorial.md show is what happens, when one follows them.

The pages are followed as their reader does: a block of YAML is added to the model, what a console
shows is run and compared letter by letter. Running this file writes the answers anew.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from fdi.analysis import analyze
from fdi.model import load_airframe

pytestmark = pytest.mark.flights

ROOT = Path(__file__).resolve().parents[1]
PAGE, TUTORIAL = (ROOT / "docs" / name for name in ("airframe.md", "tutorial.md"))
ROVER = ROOT / "examples" / "rover"
BLOCK = re.compile(r"```(yaml|console)\n(.*?)```", re.S)


def run(call, folder):
    """Return what a command says, in the reader's folder."""
    words = shlex.split(call)
    if words[0] != "fdi":
        assert words[0] in ("cp", "touch")
        subprocess.run(words, cwd=folder, check=True)
        return ""
    own = {"PYTHONPATH": str(ROOT), "COLUMNS": "100", "PYTHONIOENCODING": "utf-8"}
    words = [sys.executable, "-m", "fdi", *words[1:]]
    ended = subprocess.run(words, cwd=folder, env={**os.environ, **own}, capture_output=True)
    return ((ended.stdout if ended.returncode == 0 else b"") + ended.stderr).decode()


def added(tree, part):
    """Return a model with further lines under the headings that are there already."""
    both = {**tree, **part}
    for key in tree.keys() & part.keys():
        both[key] = added(tree[key], part[key])
    return both


def followed(folder, page=PAGE):
    """Return a page with the answers that its reader gets in a folder with the examples alone."""
    shutil.copytree(ROOT / "examples", folder / "examples")
    model, tree, yaml = folder / "rover.yaml", {}, YAML(typ="safe")

    def block(found):
        nonlocal tree
        language, text = found.groups()
        if language == "console":
            calls = [line for line in text.splitlines() if line.startswith("$ ")]
            shown = [f"{line}\n{run(line[2:], folder)}" for line in calls]
            return f"```console\n{''.join(shown)}```"
        shutil.copy(model, folder / "before.yaml")
        tree = added(tree, yaml.load(text))
        with model.open("w", encoding="utf-8") as file:
            yaml.dump(tree, file)
        return found[0]

    return BLOCK.sub(block, page.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reader")
    return folder, followed(folder)


def test_every_answer_on_the_page_is_the_one_its_reader_gets(reader):
    assert reader[1] == PAGE.read_text(encoding="utf-8")


def test_every_answer_in_the_tutorial_is_the_one_its_reader_gets(tmp_path):
    assert followed(tmp_path, TUTORIAL) == TUTORIAL.read_text(encoding="utf-8")


def test_the_page_ends_with_the_model_of_the_example(reader):
    made, example = (load_airframe(path / "rover.yaml") for path in (reader[0], ROVER))
    for part in ("components", "variables", "parameters"):
        assert getattr(made, part) == getattr(example, part)
    for part in ("equations", "measurements"):
        assert set(getattr(made, part)) == set(getattr(example, part))


def test_a_limit_on_what_another_test_reads_costs_that_test(tmp_path):
    text = (ROVER / "rover.yaml").read_text(encoding="utf-8")
    assert text.count("limits:\n") == 1
    further = tmp_path / "further.yaml"
    limit = "limits:\n  current_high: {variable: current, max: 25}\n"
    further.write_text(text.replace("limits:\n", limit), encoding="utf-8")
    words = ["fdi", "structure", further, "--log", ROVER / "rover.tlog"]
    call = [*map(str, words), "--against", str(ROVER / "rover.yaml")]
    lost = run(shlex.join(call), tmp_path).partition("Tests no longer there\n")[2]
    assert lost.strip().startswith("drive_motor.current, SYS_STATUS.current_battery by cur_1")


def test_the_log_is_what_its_script_writes(tmp_path):
    made = tmp_path / "rover.tlog"
    subprocess.run([sys.executable, ROVER / "drive.py", made], check=True)
    assert made.read_bytes() == (ROVER / "rover.tlog").read_bytes()
    assert len(made.read_bytes()) < 200_000


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")

    def found(*options):
        log = folder / "drive.tlog"
        subprocess.run([sys.executable, ROVER / "drive.py", log, *options], check=True)
        return analyze(log, model=ROVER / "rover.yaml").document()

    return found


@pytest.mark.parametrize("seed", ["2", "3"])
def test_a_healthy_drive_accuses_nobody_and_knows_its_gains(drive, seed):
    document = drive("--seed", seed, "--works", "1")
    assert document["findings"] == []
    known = document["model"]["parameters"]
    # 1/TOP_SPEED; LOCK/AXLES for small angles, of which the tangent makes a little more; the motors
    truth = {"throttle_per_speed": 1 / 6, "turn_per_steer": 0.45 / 0.55, "current_per_throttle": 14}
    for name, value in truth.items():
        assert known[name]["source"] == "identified"
        assert known[name]["value"] == pytest.approx(value, rel=0.03)


@pytest.mark.parametrize("seed", ["2", "3"])
def test_a_wheel_motor_that_dies_is_named_within_ten_seconds(drive, seed):
    (finding,) = drive("--seed", seed, "--fails", "60")["findings"]
    assert finding["component"] == "drive_motor"
    assert 0 <= finding["alarm"]["log_s"] - 60 < 10


if __name__ == "__main__":
    for page in (PAGE, TUTORIAL):
        with tempfile.TemporaryDirectory() as empty:
            page.write_text(followed(Path(empty), page), encoding="utf-8")
