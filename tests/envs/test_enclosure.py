"""What surfaces enclose, however often and whichever way their faces are written."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from envs import InputError
from envs.collision.enclosure import Enclosure, filled, room
from envs.collision.mesh import queries
from envs.collision.shapes import Mesh
from envs.problem import Array
from envs.scenes.mesh_world import MeshWorld

BOTH = (False, True)


def box(
    center: tuple[float, ...], sides: tuple[float, ...], inward: bool = False
) -> trimesh.Trimesh:
    made = trimesh.creation.box(sides).apply_translation(center)
    if inward:
        made.invert()
    return made


def together(*meshes: trimesh.Trimesh) -> Mesh:
    whole = trimesh.util.concatenate(meshes)
    return Mesh(whole.vertices, whole.faces)


def rewritten(mesh: Mesh, seed: int) -> Mesh:
    """The same surface, its triangles without common vertices, in another order, some turned round
    and some written again."""
    rng = np.random.default_rng(seed)
    triangles = mesh.vertices[mesh.faces]
    again = rng.random(len(triangles)) < rng.choice([0.0, 0.3, 1.0])
    triangles = np.concatenate([triangles, triangles[again]])
    turned = rng.random(len(triangles)) < rng.random()
    triangles[turned] = triangles[turned][:, ::-1]
    triangles = triangles[rng.permutation(len(triangles))]
    return Mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def within(enclosure: Enclosure, *points: tuple[float, float, float]) -> list[bool]:
    assert enclosure.known
    return [bool(one) for one in enclosure.encloses(np.array(points)) > 0.5]


@pytest.mark.parametrize("inward", list(itertools.product(BOTH, BOTH)))
@pytest.mark.parametrize("small", [(2.0, 0, 0), (0, 0, 0), (5.0, 0, 0), (3.0, 0, 0)])
def test_solids_are_the_union_of_their_parts(
    inward: tuple[bool, bool], small: tuple[float, ...]
) -> None:
    """Overlapping, one within the other, apart, and touching."""
    parts = box((0, 0, 0), (4, 4, 4), inward[0]), box(small, (2, 2, 2), inward[1])
    points = (0, 0, 0), (-1.9, 0, 0), small, (2.5, 1.5, 0), (-2.1, 0, 0)
    assert within(filled(together(*parts)), *points) == [True, True, True, False, False]


@pytest.mark.parametrize("inward", list(itertools.product(BOTH, BOTH, BOTH)))
def test_furniture_is_solid_in_a_room(inward: tuple[bool, bool, bool]) -> None:
    """It hangs there, with something in it, or reaches through a wall; a room beside it is one."""
    first, second, third = inward
    parts = (
        box((0, 0, 0), (10, 10, 4), first),
        box((2, 0, 0), (2, 2, 2), second),
        box((2, 0, 0), (1, 1, 1), third),
        box((-4.5, 0, 0), (2, 1, 1), second),
        box((20, 0, 0), (8, 8, 4), third),
    )
    found = room(together(*parts))
    points = (0, 0, 0), (2.8, 0, 0), (2, 0, 0), (-4, 0, 0), (-5.2, 0, 0), (20, 0, 0), (6, 0, 0)
    assert within(found, *points) == [True, False, False, False, False, True, False]
    assert found.solids == 3


@pytest.mark.parametrize("inward", BOTH)
def test_furniture_that_shares_faces_with_the_room(inward: bool) -> None:
    """A cube on the floor, whose bottom is a square of it."""
    floor = [(x, y, 0.0) for y in range(4) for x in range(4)]
    grid = trimesh.creation.box((3, 3, 3)).apply_translation((1.5, 1.5, 1.5))
    grid.update_faces(grid.triangles_center[:, 2] > 0.1)
    squares = [
        (y * 4 + x, y * 4 + x + 1, y * 4 + x + 5, y * 4 + x + 4) for y in range(3) for x in range(3)
    ]
    tiles = trimesh.Trimesh(floor, [f for a, b, c, d in squares for f in ((a, b, c), (a, c, d))])
    fan = []  # the walls' lower edges are cut where the floor's are
    for a, b in ((0, 1), (1, 3), (3, 2), (2, 0)):
        corners = np.array([(0, 0), (3, 0), (0, 3), (3, 3)], dtype=float)
        low = np.linspace(corners[a], corners[b], 4)
        rim = [*np.c_[low, np.zeros(4)], (*corners[b], 3.0), (*corners[a], 3.0)]
        fan += [(rim[5], rim[k], rim[k + 1]) for k in range(4)]
    walls = trimesh.Trimesh(np.reshape(fan, (-1, 3)), np.arange(3 * len(fan)).reshape(-1, 3))
    top = trimesh.Trimesh([(0, 0, 3), (3, 0, 3), (3, 3, 3), (0, 3, 3)], [(0, 1, 2), (0, 2, 3)])
    cube = box((1.5, 1.5, 0.5), (1, 1, 1), inward)
    found = room(rewritten(together(tiles, walls, top, cube), 1))
    assert not found.has_holes
    points = (1.5, 1.5, 2), (1.5, 1.5, 0.5), (0.5, 1.5, 0.5), (1.5, 1.5, -0.5)
    assert within(found, *points) == [True, False, True, False]


def test_blocks_that_share_a_face_and_walls_within() -> None:
    blocks = together(*(box((x, 0, 0), (1, 1, 1)) for x in range(4)))
    for seed in range(5):
        found = filled(rewritten(blocks, seed))
        assert not found.has_holes
        points = (0, 0, 0), (3, 0, 0), (0.49, 0, 0), (4, 0, 0), (0, 0.6, 0)
        assert within(found, *points) == [True, True, True, False, False]


def test_blocks_that_share_an_edge_or_a_corner() -> None:
    found = filled(together(*(box(p, (1, 1, 1)) for p in ((0, 0, 0), (1, 1, 0), (2, 2, 1)))))
    assert not found.has_holes
    assert within(found, (0, 0, 0), (1, 1, 0), (2, 2, 1), (1, 0, 0)) == [True, True, True, False]


def test_second_coverings_cut_along_other_diagonals() -> None:
    """As from quadrilaterals that are written for each side and cut by fans from other corners."""
    one = box((0, 0, 0), (2, 2, 2))
    corners = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    other = [f for a, b, c, d in corners for f in ((b, c, d), (b, d, a))]
    first = [f for a, b, c, d in corners for f in ((a, c, b), (a, d, c))]
    both = Mesh(cube, np.array(other + first))
    assert within(filled(both), (0, 0, 0), (1.1, 0, 0)) == [True, False]
    assert within(room(both), (0, 0, 0), (1.1, 0, 0)) == [True, False]
    half_open = Mesh(cube, np.array(other[2:] + first[2:]))
    assert within(filled(half_open), (0.5, 0, 0), (1.1, 0, 0)) == [True, False]
    assert len(one.faces) == len(other)


def test_a_sheet_encloses_nothing_and_spoils_nothing() -> None:
    """A floor without thickness that a box stands on or in."""
    sheet = trimesh.Trimesh(
        [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2), (0, 2, 3)]
    )
    for inward in BOTH:
        found = filled(together(sheet, box((0, 0, 0.5), (2, 2, 2), inward)))
        points = (0, 0, -0.01), (0, 0, 0.01), (0, 0, 1.4), (3, 0, 0.01), (3, 0, -0.01)
        assert within(found, *points) == [True, True, True, False, False]
        found = room(together(sheet, box((0, 0, 0.5), (20, 20, 6), inward)))
        points = (0, 0, -0.01), (0, 0, 0.01), (0, 0, 3), (0, 0, 4)
        assert within(found, *points) == [True, True, True, False]


@pytest.mark.parametrize("inward", list(itertools.product(BOTH, BOTH)))
def test_furniture_is_solid_in_a_room_with_a_hole(inward: tuple[bool, bool]) -> None:
    walls = trimesh.creation.box((10, 10, 4)).subdivide().subdivide().subdivide()
    walls.update_faces(
        (walls.triangles_center[:, 2] < 1.9) | (np.abs(walls.triangles_center[:, 0]) > 1)
    )
    if inward[0]:
        walls.invert()
    for piece in ((2.0, 0.0, -1.0), (5.0, 2.0, 0.0)):  # the second reaches through the wall
        found = room(together(walls, box(piece, (2, 2, 1), inward[1])))
        beyond = (piece[0] + 0.9, piece[1], piece[2])
        assert within(found, (-2, 0, 0), piece, beyond, (6, 0, 0)) == [True, False, False, False]
        assert (found.has_holes, found.solids) == (True, 1)


def test_holes_and_both_sides_in_one_piece() -> None:
    """One piece has one inside, whichever way it is wound; of several nothing says what they
    enclose together."""
    open_box = trimesh.creation.box((4, 4, 4)).subdivide()
    open_box.update_faces(open_box.triangles_center[:, 2] < 1.9)
    back = open_box.copy()
    back.invert()
    both = together(open_box, back)
    assert within(filled(both), (0, 0, -1), (0, 0, -3)) == [True, False]
    moved = Mesh(both.vertices + np.array([9, 0, 1]), both.faces)
    assert not filled(both.joined(moved)).known
    assert not room(both.joined(moved)).known


def test_faces_that_lie_on_one_another_in_part_are_not_guessed_at() -> None:
    """Boxes one within the other and flush with it in three planes."""
    flush = together(box((1, 1, 1), (2, 2, 2)), box((1, 1, 0.5), (2, 2, 1)))
    for seed in range(10):
        found = filled(rewritten(flush, seed))
        inside = found.encloses(np.array([(1, 1, 0.5), (1, 1, 1.5), (3, 1, 1)])) > 0.5
        assert not found.known or inside.tolist() == [True, True, False]


def test_a_strip_with_one_side_has_no_inside() -> None:
    turns = np.linspace(0, 2 * np.pi, 40)
    middle = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    across = np.stack(
        [np.cos(turns / 2) * np.cos(turns), np.cos(turns / 2) * np.sin(turns), np.sin(turns / 2)], 1
    )
    points = np.concatenate([middle - 0.3 * across, middle + 0.3 * across])
    points[39], points[79] = points[40], points[0]
    faces = [f for i in range(39) for f in ((i, i + 1, i + 40), (i + 1, i + 41, i + 40))]
    found = filled(Mesh(points, np.array(faces)))
    assert found.has_holes
    assert (found.encloses(np.random.default_rng(0).uniform(-2, 2, (500, 3))) < 0.5).mean() > 0.95


places = st.integers(0, 4)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(places, places, places, *3 * [st.integers(1, 3)]), min_size=1, max_size=4),
    st.integers(0, 2**32 - 1),
)
def test_unions_of_boxes_are_themselves_however_they_are_written(
    boxes: list[tuple[int, ...]], seed: int
) -> None:
    """On a grid, so that faces, edges and corners coincide, in whole or in part."""
    low = np.array([b[:3] for b in boxes], dtype=float)
    high = low + np.array([b[3:] for b in boxes])
    whole = together(*(box((a + b) / 2, b - a) for a, b in zip(low, high, strict=True)))
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 8, (300, 3))
    points = points[np.abs(points - np.round(points)).min(axis=1) > 0.02]
    inside = ((points[:, None] > low) & (points[:, None] < high)).all(axis=2).any(axis=1)
    found = filled(rewritten(whole, seed))
    assert not found.known or ((found.encloses(points) > 0.5) == inside).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_rooms_are_themselves_however_they_are_written(seed: int) -> None:
    """With furniture that stands apart, overlaps or lies within other."""
    rng = np.random.default_rng(seed)
    sides = rng.uniform(0.5, 4, (5, 3))
    centers = rng.uniform(-3, 3, (5, 3)) * (1.5, 1, 0.3)
    parts = [box((0, 0, 0), (16, 12, 7)), *map(box, centers, sides)]
    points = rng.uniform(-8.5, 8.5, (300, 3))
    free = (np.abs(points) < (8, 6, 3.5)).all(axis=1)
    for center, size in zip(centers, sides, strict=True):
        free &= ~(np.abs(points - center) < size / 2).all(axis=1)
    found = room(rewritten(together(*parts), seed))
    assert found.known
    assert found.solids == 5
    assert ((found.encloses(points) > 0.5) == free).all()


def same_world(mesh: Mesh, file: Path, kind: str, seed: int) -> tuple[MeshWorld, Array]:
    other = rewritten(mesh, seed)
    trimesh.Trimesh(other.vertices, other.faces, process=False).export(file)
    world = MeshWorld(str(file), kind=kind)
    q = np.random.default_rng(0).uniform(-10, 10, (300, 3))
    return world, world.clearance(q)


@pytest.mark.parametrize("kind", ["solid", "interior"])
@pytest.mark.parametrize("ending", ["stl", "obj"])
def test_worlds_are_the_same_however_their_faces_are_written(
    kind: str, ending: str, tmp_path: Path
) -> None:
    mesh = together(
        box((0, 0, 0), (10, 8, 4)), box((2, 0, 0), (2, 2, 2)), box((4, 3, 0), (4, 4, 1))
    )
    file = tmp_path / f"mesh.{ending}"
    trimesh.Trimesh(mesh.vertices, mesh.faces).export(file)
    right = MeshWorld(str(file), kind=kind)
    q = np.random.default_rng(0).uniform(-10, 10, (300, 3))
    for seed in range(3):
        world, clearance = same_world(mesh, file, kind, seed)
        assert clearance == pytest.approx(right.clearance(q), abs=1e-6)
        model = world.collision_model()
        assert [model.is_valid(one) for one in q[:50]] == (clearance[:50] > 0).tolist()


def test_a_solid_written_for_both_sides_is_not_passed_through(tmp_path: Path) -> None:
    cube = box((0, 0, 0), (2, 2, 2))
    back = cube.copy()
    back.invert()
    both = together(cube, back)
    file = tmp_path / "cube.obj"
    trimesh.Trimesh(both.vertices, both.faces, process=False).export(file)
    world = MeshWorld(str(file))
    assert world.kind == "solid"
    assert world.clearance(np.zeros((1, 3)))[0] < 0
    model = world.collision_model()
    assert not model.is_valid(np.zeros(3))
    assert not model.segment_is_free(np.array([-3.0, 0, 0]), np.array([3.0, 0, 0]))
    for problem in world.sample_problems(20, 0):
        assert np.abs([problem.start, problem.goal]).max(axis=1).min() > 6


def test_blocks_that_share_a_face_are_a_solid_by_default(tmp_path: Path) -> None:
    blocks = together(box((0, 0, 0), (5, 10, 10)), box((5, 0, 0), (5, 10, 10)))
    file = tmp_path / "blocks.obj"
    trimesh.Trimesh(blocks.vertices, blocks.faces, process=False).export(file)
    world = MeshWorld(str(file))
    assert world.kind == "solid"
    assert (world.clearance(np.array([[-3.0, 0, 0], [3.0, 0, 0], [0.0, 0, 7]])) > 0).tolist() == [
        False,
        False,
        True,
    ]


def test_what_cannot_be_known_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    sheets = [box((0, 0, z), (4, 4, 1)) for z in (0, 3)]
    for sheet in sheets:
        sheet.update_faces(sheet.triangles_center[:, 2] < sheet.triangles_center[:, 2].max() - 0.1)
    backs = [sheet.copy() for sheet in sheets]
    for back in backs:
        back.invert()
    whole = together(*sheets, *backs)
    file = tmp_path / "sheets.obj"
    trimesh.Trimesh(whole.vertices, whole.faces, process=False).export(file)
    for kind in ("solid", "interior"):
        with pytest.raises(InputError, match=r"nothing tells what .*sheets\.obj encloses"):
            MeshWorld(str(file), kind=kind)
    with caplog.at_level("INFO"):
        assert MeshWorld(str(file)).kind == "shell"
    assert "free on both sides, also within" in caplog.text
    assert "edges have one face, as at" in caplog.text


def test_links_and_obstacles_are_solids_as_well() -> None:
    """They ask `MeshQueries`."""
    cube = box((0, 0, 0), (2, 2, 2))
    nested = box((0, 0, 0), (1, 1, 1), inward=True)
    asked = queries(rewritten(together(cube, nested), 3))
    assert asked.is_inside(np.array([(0, 0, 0), (0.9, 0, 0), (1.1, 0, 0.0)])).tolist() == [
        True,
        True,
        False,
    ]
