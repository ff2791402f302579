"""main moves to what all checks pass, and to nothing else: on a house whose check is one line."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")

TOOL = Path(__file__).parents[1] / "tools" / "land"
NOBODY = {
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_NOSYSTEM": "1",
    **{
        f"GIT_{who}_{what}": "a@b.c"
        for who in ("AUTHOR", "COMMITTER")
        for what in ("NAME", "EMAIL")
    },
}


class House:
    """A repository whose checks are what ``.ci/run`` says."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / ".ci").mkdir(parents=True)
        self.git("init", "-q", "-b", "main")
        self.first = self.commit("true")
        self.git("switch", "-q", "-c", "work")

    def git(self, *words: str) -> str:
        return self.run("git", *words).stdout.strip()

    def run(self, *words: str, is_right: bool = True) -> subprocess.CompletedProcess[str]:
        env = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")} | NOBODY
        return subprocess.run(
            words, cwd=self.folder, env=env, text=True, capture_output=True, check=is_right
        )

    def commit(self, check: str) -> str:
        (self.folder / ".ci" / "run").write_text(f"{check}\n", encoding="utf-8")
        self.git("add", "-A")
        self.git("commit", "-q", "-m", check)
        return self.git("rev-parse", "HEAD")

    def land(self, *words: str) -> subprocess.CompletedProcess[str]:
        return self.run(str(TOOL), *words, is_right=False)

    @property
    def main(self) -> str:
        return self.git("rev-parse", "main")


@pytest.fixture
def house(tmp_path: Path) -> House:
    return House(tmp_path / "a house")


def test_main_moves_to_what_is_green_and_the_clone_is_gone(house: House) -> None:
    green = house.commit('test $CI = true && test -z "$(git status --porcelain)"')
    ended = house.land()
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == f"land: main is at {green[:10]}, green\n"
    assert house.main == green
    assert [one.name for one in house.folder.parent.iterdir()] == ["a house"]


def test_main_stays_where_it_is_red(house: House) -> None:
    red = house.commit("exit 1")
    ended = house.land()
    assert ended.returncode == 1
    assert ended.stderr == f"land: {red[:10]} is red, main stays at {house.first[:10]}\n"
    assert house.main == house.first
    assert [one.name for one in house.folder.parent.iterdir()] == ["a house"]


def test_what_is_not_committed_is_neither_tried_nor_landed(house: House) -> None:
    green = house.commit("true  # committed")
    (house.folder / ".ci" / "run").write_text("exit 1\n", encoding="utf-8")
    assert house.land().returncode == 0
    assert house.main == green


def test_a_commit_beside_main_is_refused_before_anything_runs(house: House) -> None:
    beside = house.commit("touch ran")
    house.git("switch", "-q", "main")
    ahead = house.commit("true  # main goes on")
    ended = house.land(beside)
    assert ended.returncode == 2
    assert "does not contain main: rebase or merge first" in ended.stderr
    assert house.main == ahead


def test_main_that_is_checked_out_moves_with_its_files(house: House) -> None:
    green = house.commit("true  # with files")
    house.git("switch", "-q", "main")
    assert house.land("work").returncode == 0
    assert house.main == green
    assert house.git("status", "--porcelain") == ""
