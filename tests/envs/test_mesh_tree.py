"""Trees of triangles: what their boxes and balls must hold."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from envs.collision import mesh_tree
from envs.collision.mesh_tree import Trees, trees_of
from envs.collision.shapes import Mesh


def loose(n: int) -> Mesh:
    """Triangles anywhere, large and small, some without area."""
    rng = np.random.default_rng(n)
    corners = rng.normal(size=(n, 1, 3)) * 10 + rng.normal(size=(n, 3, 3)) * rng.random((n, 1, 1))
    corners[::7, 1] = corners[::7, 0]
    return Mesh(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def ball(scale: float) -> Mesh:
    mesh = trimesh.creation.icosphere(subdivisions=2)
    return Mesh(np.asarray(mesh.vertices) * scale, np.asarray(mesh.faces))


MESHES = {
    "one": loose(1),
    "two": loose(2),
    "few": loose(5),
    "many": loose(700),
    "ball": ball(1.0),
    "tiny": ball(1e-4),
    "same twice": Mesh(loose(40).vertices, np.repeat(loose(40).faces, 2, axis=0)),
}


def held(trees: Trees, node: int) -> list[int]:
    """The triangles below a node."""
    child = int(trees.child[node])
    return [-1 - child] if child < 0 else [*held(trees, child), *held(trees, child + 1)]


@pytest.mark.parametrize("name", MESHES)
def test_a_node_holds_the_triangles_below_it(name: str) -> None:
    mesh = MESHES[name]
    trees, [root] = trees_of([mesh])
    corners = mesh.vertices[mesh.faces]
    assert sorted(held(trees, int(root))) == list(range(len(corners))), "each in one leaf"
    for node in range(len(trees.radii)):
        away = corners[held(trees, node)].reshape(-1, 3) - trees.middles[node]
        assert (np.abs(away @ trees.axes[node].T) <= trees.halves[node]).all()
        assert (np.linalg.norm(away, axis=1) <= trees.radii[node]).all()
        assert trees.axes[node] @ trees.axes[node].T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize("name", MESHES)
def test_leaves_have_corners_from_their_middle(name: str) -> None:
    mesh = MESHES[name]
    trees, _ = trees_of([mesh])
    leaves = np.flatnonzero(trees.child < 0)
    triangles = -1 - trees.child[leaves]
    found = trees.triangles[triangles].reshape(-1, 3, 3) + trees.middles[leaves][:, None]
    assert found == pytest.approx(mesh.vertices[mesh.faces[triangles]], abs=1e-12, rel=1e-12)


def test_boxes_are_tight() -> None:
    trees, _ = trees_of([MESHES["ball"]])
    assert trees.halves[0] == pytest.approx([1, 1, 1], abs=0.05)
    assert trees.radii[0] == pytest.approx(1, abs=0.01)


def test_trees_of_several_meshes_are_one_after_another() -> None:
    both, roots = trees_of([MESHES["few"], MESHES["ball"]])
    assert sorted(held(both, int(roots[0]))) == list(range(5))
    assert sorted(held(both, int(roots[1]))) == list(range(5, 5 + 320))


def test_equal_meshes_share_a_tree() -> None:
    few, ball = MESHES["few"], MESHES["ball"]
    alone, _ = trees_of([ball, few])
    shared, roots = trees_of([ball, few, Mesh(ball.vertices, ball.faces), few])
    assert roots.tolist() == [0, roots[1], 0, roots[1]]
    assert len(shared.radii) == len(alone.radii)
    assert trees_of([few, few])[1].tolist() == [0, 0]
    assert len(trees_of([])[1]) == 0


@pytest.mark.parametrize("sizes", [[2, 3, 31, 2], [33, 2, 500, 40]])
def test_triangles_are_sorted_within_each_node_and_alike_ones_left(sizes: list[int]) -> None:
    rng = np.random.default_rng(0)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    along = rng.integers(0, 9, len(owner)).astype(float)
    order = rng.permutation(len(owner))
    expected = order[np.lexsort((along, owner))]
    mesh_tree._sort_each(order, along, np.array(sizes))
    assert order.tolist() == expected.tolist()
