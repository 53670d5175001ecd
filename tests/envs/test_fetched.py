"""Files of MotionBenchMaker that are fetched once and checked, from a server on this machine."""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import mbm_files as made
import pytest
from conftest import Cli, has_data

import envs
from envs import InputError
from envs.scenes import motion_bench_maker
from envs.scenes.motion_bench_maker_sets import SETS

FILES = ("panda.urdf", "panda.srdf", "problems.tar.bz2")


class _Handler(SimpleHTTPRequestHandler):
    asked: list[str]

    def do_GET(self) -> None:
        self.asked.append(self.path)
        super().do_GET()

    def log_message(self, format: str, *args: object) -> None:
        """Nothing."""


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """What a server is asked for that has the files of a robot, which are not here."""
    folder = tmp_path / "there"
    one = made.scene(), made.request([0, 0], [1, 0])
    made.write(folder / "panda", {"box_panda": [one]})
    _Handler.asked = []
    httpd = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, directory=str(folder)))
    thread = threading.Thread(target=httpd.serve_forever)
    thread.start()
    monkeypatch.setenv("BENCH_DATA", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(motion_bench_maker, "URL", f"http://127.0.0.1:{httpd.server_port}")
    digests = {
        name: hashlib.sha256((folder / "panda" / name).read_bytes()).hexdigest() for name in FILES
    }
    monkeypatch.setattr(motion_bench_maker, "_digests", lambda robot: digests)
    yield _Handler.asked
    httpd.shutdown()
    thread.join()
    httpd.server_close()


def test_files_are_fetched_once(asked: list[str], tmp_path: Path) -> None:
    for _ in range(2):
        folder = motion_bench_maker.robot_folder("panda")
    assert folder == tmp_path / "cache" / "plannerbench" / "mbm" / "panda"
    assert sorted(asked) == sorted(f"/panda/{name}" for name in FILES)
    assert envs.make("mbm:robot=panda,set=box").problem_count == 1


def test_what_is_damaged_or_missing_is_fetched_again(asked: list[str]) -> None:
    folder = motion_bench_maker.robot_folder("panda")
    (folder / "panda.urdf").write_text("<robot")
    (folder / "panda.srdf").unlink()
    asked.clear()
    motion_bench_maker.robot_folder("panda")
    assert sorted(asked) == ["/panda/panda.srdf", "/panda/panda.urdf"]
    assert (folder / "panda.urdf").read_text() == made.URDF


def test_other_content_is_refused_in_a_line(asked: list[str], tmp_path: Path) -> None:
    (tmp_path / "there" / "panda" / "panda.srdf").write_text("<robot/>")
    with pytest.raises(InputError, match=r"panda.srdf cannot be fetched \(checksum differs\)") as e:
        motion_bench_maker.robot_folder("panda")
    assert "\n" not in str(e.value)
    assert asked


@pytest.mark.usefixtures("asked")
def test_without_a_network_a_line_says_what_to_fetch_and_where_to_put_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(motion_bench_maker, "URL", "http://127.0.0.1:9")
    with pytest.raises(InputError) as caught:
        motion_bench_maker.robot_folder("panda")
    said = str(caught.value)
    kept = tmp_path / "cache" / "plannerbench" / "mbm" / "panda"
    assert f"http://127.0.0.1:9/panda/{FILES[0]} cannot be fetched" in said
    assert f"put it at {kept / FILES[0]}, or the whole folder at mbm/panda in one that" in said
    assert "BENCH_DATA" in said
    assert "\n" not in said


@pytest.mark.usefixtures("asked")
def test_a_command_says_no_more(monkeypatch: pytest.MonkeyPatch, bench: Cli) -> None:
    monkeypatch.setattr(motion_bench_maker, "URL", "http://127.0.0.1:9")
    code, out, err = bench("problems", "--env", "mbm-panda-box")
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1, err


@pytest.mark.parametrize("robot", list(SETS))
def test_what_is_fetched_is_what_robots_collide_with(robot: str) -> None:
    digests = motion_bench_maker._digests(robot)
    assert {f"{robot}.urdf", f"{robot}.srdf", "problems.tar.bz2"} < digests.keys()
    assert all(len(digest) == 64 for digest in digests.values())
    if not has_data(f"mbm/{robot}/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    folder = Path(os.environ["BENCH_DATA"]) / "mbm" / robot
    for name, digest in digests.items():
        found = hashlib.sha256((folder / name).read_bytes()).hexdigest()
        assert (found == digest) or name == "problems.tar.bz2", "its archive may be shortened"
