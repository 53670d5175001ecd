"""Worlds whose meshes are files of others: the bunny and Gibson's scenes."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import trimesh

import envs
from envs import InputError
from envs.scenes import bunny
from envs.scenes.mesh_world import MeshWorld


class _Server(BaseHTTPRequestHandler):
    content: ClassVar[bytes]
    requests: ClassVar[int]

    def do_GET(self) -> None:
        type(self).requests += 1
        self.send_response(200)
        self.send_header("Content-Length", str(len(self.content)))
        self.end_headers()
        self.wfile.write(self.content)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing."""


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[type[_Server]]:
    """Serves a ball in the bunny's place, on this machine."""
    trimesh.creation.icosphere(subdivisions=2).export(tmp_path / "ball.ply")
    _Server.content, _Server.requests = (tmp_path / "ball.ply").read_bytes(), 0
    httpd = ThreadingHTTPServer(("127.0.0.1", 0), _Server)
    thread = threading.Thread(target=httpd.serve_forever)
    thread.start()
    monkeypatch.delenv("BENCH_DATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(bunny, "URL", f"http://127.0.0.1:{httpd.server_port}")
    monkeypatch.setattr(bunny, "SHA256", hashlib.sha256(_Server.content).hexdigest())
    yield _Server
    httpd.shutdown()
    thread.join()
    httpd.server_close()


def test_the_bunny_is_fetched_once(server: type[_Server], tmp_path: Path) -> None:
    world = envs.make("bunny")
    assert isinstance(world, MeshWorld)
    assert world.kind == "solid"
    assert world.clearance(np.array([[0.0, 0, 0], [0, 0, 8]])) == pytest.approx([-6, 2], abs=0.3)
    assert envs.make("bunny").fingerprint == world.fingerprint
    assert server.requests == 1
    assert (tmp_path / "cache/plannerbench/meshes/bunny.ply").read_bytes() == server.content


def test_another_file_in_its_place_is_refused(
    server: type[_Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    server.content = server.content[:-9] + bytes(9)
    with pytest.raises(InputError, match="checksum differs") as caught:
        envs.make("bunny")
    assert "\n" not in str(caught.value)


def test_without_a_network_one_line_says_where_to_put_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BENCH_DATA", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(bunny, "URL", "http://127.0.0.1:9")
    with pytest.raises(InputError, match="cannot be fetched") as caught:
        envs.make("bunny")
    assert str(tmp_path / "cache/plannerbench/meshes/bunny.ply") in str(caught.value)
    assert "BENCH_DATA" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bench_data_comes_first(server: type[_Server], monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(bunny.bunny_file()).parent / "data"
    (folder / "bunny").mkdir(parents=True)
    trimesh.creation.box((1.0, 1.0, 1.0)).export(folder / "bunny" / "bunny.ply")
    monkeypatch.setenv("BENCH_DATA", str(folder))
    assert bunny.bunny_file() == folder / "bunny" / "bunny.ply"


@pytest.fixture
def gibson(tmp_path: Path) -> Path:
    """Gibson's layout with one scene, a room without a ceiling."""
    folder = tmp_path / "gibson" / "Allensville"
    folder.mkdir(parents=True)
    room = trimesh.creation.box((8.0, 6.0, 5.0)).subdivide().subdivide()
    room.update_faces(room.triangles_center[:, 2] < 2.4)
    room.invert()
    room.export(folder / "mesh_z_up.obj")
    return tmp_path / "gibson"


def test_gibsons_own_layout(gibson: Path) -> None:
    world = envs.make(f"gibson:root={gibson},scene=Allensville")
    assert isinstance(world, MeshWorld)
    assert world.kind == "interior"
    assert world.min_clearance == 1.0
    assert len(world.obstacles) == 2, "the ceiling is closed by a lid"
    inside = world.transform.to_world(np.array([[0.0, 0, 0], [0, 0, 2.7]]))
    assert (world.clearance(inside) > 0).tolist() == [True, False]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("root=/no/such", "no such folder"),
        ("root=ROOT", "Allensville"),
        ("root=ROOT,scene=Alensville", "did you mean 'Allensville'?"),
        ("root=ROOT/Allensville,scene=Allensville", "it holds no SCENE/mesh_z_up.obj"),
        ("scene=Allensville", "gibson without root= is gibson-generated"),
        ("scene=-1", "scene must be between"),
    ],
)
def test_mistakes_about_gibson(arguments: str, said: str, gibson: Path) -> None:
    with pytest.raises(InputError) as caught:
        envs.make("gibson:" + arguments.replace("ROOT", str(gibson)))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_box_is_in_the_middle() -> None:
    world = envs.make("box")
    q = np.array([[0.0, 0, 0], [5.01, 0, 0], [0, -7, 0]])
    assert world.clearance(q) == pytest.approx([-4.01, 1, 2.99])
    assert envs.make("box:side=8").fingerprint == world.fingerprint
    with pytest.raises(InputError, match="side must be above 0"):
        envs.make("box:side=19")
