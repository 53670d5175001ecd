"""Signed distances on grids, against exact ones."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from envs.collision.distance_fields import distance_transform
from envs.collision.mesh import MeshQueries
from envs.collision.shapes import Mesh

SHAPES = {
    "box": trimesh.creation.box((1.0, 2.0, 3.0)),
    "ball": trimesh.creation.icosphere(4, 1.5),
    "torus": trimesh.creation.torus(1.2, 0.4),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("spacing", [0.1, 0.23])
def test_distances_are_hardly_too_great_and_have_the_right_sign(name: str, spacing: float) -> None:
    shape = SHAPES[name]
    surface = Mesh(shape.vertices, shape.faces)
    queries = MeshQueries(surface)
    axes = [np.arange(-2.5, 2.5, spacing), np.arange(-2, 3, spacing), np.arange(-3, 2, spacing)]
    found = distance_transform(surface, queries.closest, queries.is_inside, axes)
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    exact = queries.distance(nodes)
    error = np.abs(found.ravel()) - exact
    assert error.min() > -1e-9, "never too small"
    assert error.max() < spacing
    assert np.quantile(error, 0.99) < 0.5 * spacing
    beside = exact < spacing
    assert np.abs(error[beside]).max() < 1e-9, "exact beside the surface"
    inside = queries.is_inside(nodes)
    clear = exact > 1e-9
    assert ((found.ravel() < 0) == inside)[clear].all()


def test_large_triangles_are_covered_and_what_is_off_the_grid_is_left_out() -> None:
    corners = np.array([[-50.0, -50, 0.3], [50, -50, 0.3], [0, 90, 0.3]])
    surface = Mesh(corners, np.array([[0, 1, 2]]))
    queries = MeshQueries(surface)
    axes = [np.linspace(-1, 1, 9)] * 3
    found = distance_transform(
        surface, queries.closest, lambda x: np.zeros(len(x), dtype=np.bool_), axes
    )
    assert found[:, :, :] == pytest.approx(np.broadcast_to(np.abs(axes[2] - 0.3), (9, 9, 9)))
