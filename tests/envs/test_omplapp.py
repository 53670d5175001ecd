"""Problems of OMPL.app's `.cfg` files, with files of the same form."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from dae_files import dae, geometry, node, polylist, triangles
from mesh_files import WALL, prism
from omplapp_files import CENTER, PLANAR, SPATIAL, Values, cfg, write_meshes, write_problem

import bench
import envs
from bench.storage.record import Verdict
from envs import InputError, Problem
from envs.files.assimp_mesh import read_as_assimp
from envs.files.mesh_formats.dae import drawn_vertices, turn_to_y_up
from envs.files.omplapp_cfg import Pose, read_problem
from envs.problem import Array
from envs.scenes.omplapp import OmplApp
from planners.ompl.parameters import load

TRIANGLES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
TETRAHEDRON = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 5.0]])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("omplapp")
    write_meshes(folder)
    (folder / "spatial.cfg").write_text(cfg(SPATIAL))
    (folder / "planar.cfg").write_text(cfg(PLANAR))
    return folder


def made(folder: Path, values: Values, arguments: str = "") -> OmplApp:
    file = folder / "made.cfg"
    file.write_text(cfg(values))
    env = envs.make(f"omplapp:file={file}{arguments}")
    assert isinstance(env, OmplApp)
    return env


def corners_at(env: OmplApp, q: Array) -> Array:
    """The vertices of the body (n, 3) at a configuration."""
    return env.robot.placed(env.robot.parts[0].solid.triangulate().vertices, q[None])[0]


def test_a_problem_in_space_is_as_its_file_says(folder: Path) -> None:
    env = made(folder, SPATIAL)
    [problem] = env.sample_problems(1, 0)
    assert problem.start == pytest.approx([1, 1.5, -2, 0, 0, 0, 1])
    assert problem.goal == pytest.approx([4, 1.5, 3, 0, math.sin(0.75), 0, math.cos(0.75)])
    assert env.lower[:3].tolist() == [0, 0, -3]
    assert env.upper[:3].tolist() == [5, 3, 4]
    assert str(env.space) == f"R^3 x {env.robot.radius:.3g} SO(3)"
    assert str(made(folder, SPATIAL, ",weight=0.5").space) == "R^3 x 0.5 SO(3)"
    assert env.world.is_interior is False
    assert env.clearance(problem.start[None])[0] == pytest.approx(2 - 0.15, abs=1e-6)


def test_a_problem_in_the_plane_is_as_its_file_says(folder: Path) -> None:
    """The body keeps its z, which its centre's does not change."""
    env = made(folder, PLANAR)
    [problem] = env.sample_problems(1, 0)
    assert problem.start == pytest.approx([-3, -3, 0])
    assert problem.goal == pytest.approx([3, 3, 2.5])
    assert str(env.space) == f"R^2 x {env.robot.radius:.3g} S^1"
    lifted = trimesh.load(folder / "flat.obj").apply_translation((7, 7, 0.9))
    lifted.export(folder / "lifted.obj")
    above = made(folder, {**PLANAR, "robot": "lifted.obj"})
    assert corners_at(above, problem.start) == pytest.approx(
        corners_at(env, problem.start) + [0, 0, 0.9]
    )
    assert above.clearance(np.array([[3.0, 0, 0]]))[0] < 0
    lifted.apply_translation((0, 0, 1)).export(folder / "lifted.obj")  # over the walls, 1 high
    over = made(folder, {**PLANAR, "robot": "lifted.obj"})
    assert over.clearance(np.array([[3.0, 0, 0]]))[0] == pytest.approx(0.65, abs=1e-6)


@pytest.mark.parametrize("scale", [1.0, -1.0, 0.1, 40.0])
def test_an_axis_and_an_angle_are_ompls(scale: float) -> None:
    rng = np.random.default_rng(3)
    base, _, _ = load()
    space = base.SO3StateSpace()
    state = space.allocState()
    for axis, angle in zip(rng.normal(size=(20, 3)), rng.uniform(-7, 7, 20), strict=True):
        pose = Pose(np.zeros(3), scale * axis, float(angle))
        state.setAxisAngle(*pose.axis, float(angle))
        theirs = np.array([state.x, state.y, state.z, state.w])
        assert abs(pose.quaternion @ theirs) == pytest.approx(1, abs=1e-12)
    space.freeState(state)


def test_the_body_turns_about_the_mean_of_its_vertices(folder: Path) -> None:
    """A quarter turn about x takes y to z and z to -y."""
    quarter = {"start.theta": math.pi / 2, "start.axis.x": 3}
    env = made(folder, {**SPATIAL, **quarter})
    [problem] = env.sample_problems(1, 0)
    vertices, _ = prism([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)])
    x, y, z = (0.3 * (vertices - CENTER)).T
    expected = np.column_stack([x, -z, y]) + [1, 1.5, -2]
    found = corners_at(env, problem.start)
    assert np.array(sorted(found.round(9).tolist())) == pytest.approx(
        np.array(sorted(expected.round(9).tolist())), abs=1e-6
    )


def test_a_heading_turns_x_towards_y(folder: Path) -> None:
    env = made(folder, {**PLANAR, "start.theta": math.pi / 2})
    [problem] = env.sample_problems(1, 0)
    straight = corners_at(env, np.array([-3.0, -3, 0]))
    turned = corners_at(env, problem.start)
    x, y, z = (straight - [-3, -3, 0]).T
    assert turned == pytest.approx(np.column_stack([-y, x, z]) + [-3, -3, 0])


@pytest.mark.parametrize(
    ("axis", "turned"),
    [("X_UP", [-2, 1, 3]), ("Y_UP", [1, 2, 3]), ("Z_UP", [1, 3, -2]), ("", [1, 2, 3])],
)
def test_the_up_axis_is_applied_as_assimp_does(
    axis: str, turned: list[int], tmp_path: Path
) -> None:
    """The figures are those of Assimp 6.0.5 for a point at (1, 2, 3)."""
    asset = f"<up_axis>{axis}</up_axis>" if axis else ""
    shape = geometry(TETRAHEDRON, triangles(TRIANGLES))
    (tmp_path / "one.dae").write_bytes(dae(shape, asset=asset))
    assert turn_to_y_up(tmp_path / "one.dae") @ [1, 2, 3] == pytest.approx(turned)


def test_meshes_with_another_up_axis_make_the_same_problem(folder: Path, tmp_path: Path) -> None:
    """A wall that is written with z up, along x and z, is the one with y up."""
    write_problem(tmp_path, SPATIAL)
    vertices, faces = prism(WALL)
    x, y, z = vertices.T
    shape = geometry(np.column_stack([x, -z, y]), polylist(faces))
    lying = dae(shape, asset="<up_axis>Z_UP</up_axis>")
    (tmp_path / "wall.dae").write_bytes(lying)
    [one], [other] = (made(at, SPATIAL).sample_problems(1, 0) for at in (folder, tmp_path))
    here, there = (made(at, SPATIAL) for at in (folder, tmp_path))
    q = here.space.sample(np.random.default_rng(0), 40)
    assert there.clearance(q) == pytest.approx(here.clearance(q), abs=1e-6)
    assert (one.goal == other.goal).all()


def test_vertices_count_once_for_each_normal_and_those_of_lines_too(tmp_path: Path) -> None:
    """The figures are Assimp's, with the flags that OMPL.app gives it: 12 vertices of the faces,
    and 2 of a line."""
    shape = geometry(TETRAHEDRON, triangles(TRIANGLES)).replace(
        '<input semantic="NORMAL" source="#g-normals" offset="1"/>',
        '<input semantic="TEXCOORD" source="#g-normals" offset="1"/>',
    )
    line = (
        '<lines count="1"><input semantic="VERTEX" source="#g-vertices" offset="0"/><p>0 1</p>'
        "</lines></mesh>"
    )
    file = tmp_path / "one.dae"
    file.write_bytes(dae(shape))
    assert len(drawn_vertices(file)) == 12
    assert drawn_vertices(file).mean(axis=0) == pytest.approx([0.5, 0.75, 1.25])
    file.write_bytes(dae(shape.replace("</mesh>", line)))
    assert len(drawn_vertices(file)) == 14
    assert drawn_vertices(file).mean(axis=0) == pytest.approx(np.array([4, 4.5, 7.5]) / 7)
    moved = "<translate>1 2 3</translate>"
    file.write_bytes(dae(shape, node(moved + '<instance_geometry url="#g"/>')))
    assert drawn_vertices(file).mean(axis=0) == pytest.approx([1.5, 2.75, 4.25])


def test_smooth_normals_make_one_vertex_of_a_place(tmp_path: Path) -> None:
    (tmp_path / "one.dae").write_bytes(dae(geometry(TETRAHEDRON, triangles(TRIANGLES))))
    assert len(drawn_vertices(tmp_path / "one.dae")) == 4  # all corners have the same
    ball = trimesh.creation.icosphere(2, 2.0)
    assert len(ball.vertex_normals) == len(ball.vertices)
    ball.export(tmp_path / "ball.dae")
    assert len(drawn_vertices(tmp_path / "ball.dae")) == len(ball.vertices) == 162


def test_without_a_volume_bounds_hold_the_world_and_both_ends(folder: Path) -> None:
    values = {key: value for key, value in SPATIAL.items() if not key.startswith("volume")}
    env = made(folder, values)
    assert env.lower[:3] == pytest.approx([0, 0, -2])
    assert env.upper[:3] == pytest.approx([5, 3, 3])
    far = made(folder, {**SPATIAL, "goal.x": 9})
    assert far.upper[:3] == pytest.approx([9, 3, 4])


def test_a_space_that_is_given_is_taken(folder: Path) -> None:
    flat = made(folder, PLANAR)
    risen = made(folder, PLANAR, ",space=se3")
    [one], [other] = flat.sample_problems(1, 0), risen.sample_problems(1, 0)
    assert len(other.start) == 7
    for a, b in ((one.start, other.start), (one.goal, other.goal)):
        assert corners_at(flat, a) == pytest.approx(corners_at(risen, b))
    level = {**SPATIAL, "goal.z": -2, "goal.axis.y": 0, "goal.axis.z": -2}
    [problem] = made(folder, level, ",space=se2").sample_problems(1, 0)
    assert problem.start == pytest.approx([1, 1.5, 0])
    assert problem.goal == pytest.approx([4, 1.5, -1.5])
    with pytest.raises(InputError, match="differ in z, so that space=se2 cannot be"):
        made(folder, SPATIAL, ",space=se2")
    with pytest.raises(InputError, match="other axes than z, so that space=se2 cannot be"):
        made(folder, {**SPATIAL, "goal.z": -2}, ",space=se2")


def test_in_a_closed_room_the_world_is_a_surface_as_in_omplapp(folder: Path) -> None:
    """A box that is wound outward is solid, unless the problem is within."""
    trimesh.creation.box((12, 12, 12)).export(folder / "room.obj")
    inside = {**SPATIAL, "world": "room.obj"}
    env = made(folder, inside)
    assert env.allowed is not None
    assert env.sample_problems(1, 0)
    with pytest.raises(InputError, match="its start touches the world, or is where the world is"):
        made(folder, inside, ",kind=solid")
    outside = {**inside, "start.x": 9, "goal.x": 9}
    solid = made(folder, outside)
    middle = np.array([[0.0, 0, 0, 0, 0, 0, 1]])
    assert solid.clearance(middle)[0] < 0
    assert made(folder, outside, ",kind=shell").clearance(middle)[0] > 0
    assert env.clearance(np.array([[1.0, 1, 1, 0, 0, 0, 1]]))[0] > 0


def test_a_body_with_holes_is_a_surface(folder: Path) -> None:
    vertices, faces = np.array(trimesh.creation.box((1, 1, 1)).vertices), [[0, 1, 3]]
    trimesh.Trimesh(vertices, faces).export(folder / "sheet.obj")
    env = made(folder, {**SPATIAL, "robot": "sheet.obj"})
    assert env.allowed is not None  # the wall is solid
    assert made(folder, {**SPATIAL, "robot": "sheet.obj"}, ",kind=shell").allowed is None


@pytest.mark.slow
def test_problem_0_is_the_files_for_all_seeds_and_the_others_are_sampled(folder: Path) -> None:
    env = made(folder, PLANAR)
    one, other = env.sample_problems(4, 1), env.sample_problems(3, 2)
    assert (one[0].start == other[0].start).all()
    assert one[0].seed != other[0].seed
    assert [p.index for p in one] == [0, 1, 2, 3]
    assert not (one[1].start == other[1].start).all()
    ends = np.array([[p.start, p.goal] for p in one[1:]])
    assert (env.clearance(ends.reshape(-1, 3)) >= 0.1).all()
    assert (np.linalg.norm(ends[:, 0, :2] - ends[:, 1, :2], axis=1) >= 2).all()
    assert env.sample_problems(0, 1) == []
    assert env.problem_statistics(4, 1) == {"pairs_dropped_as_unsolved": 0}


def test_ends_that_are_near_the_world_are_decided_finely(folder: Path) -> None:
    """The body reaches 5/6 beyond its centre, and the wall to y = -0.25."""
    beside = -0.25 - 5 / 6
    env = made(folder, {**PLANAR, "start.y": beside - 0.002})
    assert env.min_clearance == pytest.approx(0.002, abs=1e-6)
    assert env.tolerance == env.min_clearance / 4
    with pytest.raises(InputError, match=r"its start is only .*e-05 from the world, too near"):
        made(folder, {**PLANAR, "start.y": beside - 5e-5})


def test_fingerprints_tell_problems_apart(folder: Path) -> None:
    first = made(folder, PLANAR).fingerprint
    assert made(folder, {**PLANAR, "objective": "length"}).fingerprint == first
    for other in ({"goal.x": 3.1}, {"goal.theta": 2}, {"volume.max.x": 6}, {"robot": "ell.dae"}):
        assert made(folder, {**PLANAR, **other}).fingerprint != first
    assert made(folder, PLANAR, ",kind=shell").fingerprint != first
    assert made(folder, PLANAR, ",weight=0.5").fingerprint != first


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spatial", "planar"])
def test_rrtconnect_solves_the_files_problem(name: str, folder: Path, tmp_path: Path) -> None:
    entry = f"omplapp:file={folder / name}.cfg"
    run = bench.run(entry, "rrtconnect", problems=1, time_limit=60, out=tmp_path / "out")
    [attempt] = run.attempts.to_dict("records")
    assert attempt["verdict"] == "VALID", attempt


@pytest.mark.slow
def test_the_judge_refuses_the_way_through_the_wall(folder: Path) -> None:
    entry = f"omplapp:file={folder / 'planar.cfg'}"
    [problem] = envs.make(entry).sample_problems(1, 0)
    straight = [problem.start, problem.goal]
    through = np.array([problem.start, [-3, 3, 0], problem.goal])
    gap = np.array([problem.start, [0, -3, 0], [0, 3, 0], problem.goal])
    found = [bench.judge(entry, problem, path).verdict for path in (straight, through, gap)]
    assert found[1:] == [Verdict.COLLISION, Verdict.VALID]
    beyond = Problem(problem.start, np.array([9.0, 3, 0]))
    off = bench.judge(entry, beyond, [beyond.start, beyond.goal])
    assert off.verdict is Verdict.OUT_OF_BOUNDS


def without(key: str) -> Values:
    return {name: value for name, value in SPATIAL.items() if name != key}


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (without("robot"), r"its \[problem\] has no robot; add robot ="),
        ({**without("robot"), "robto": "ell.dae"}, "has no robot; .*'robto'"),
        (without("goal.z"), r"has no goal.z"),
        (without("start.axis.y"), r"has no start.axis.y"),
        ({**SPATIAL, "start.thta": 1}, "line .*: unknown 'start.thta'; did you mean 'start.theta'"),
        ({**SPATIAL, "volume.min.w": 1}, "unknown 'volume.min.w'"),
        (without("volume.max.y"), "the volume lacks volume.max.y; give all of it, or none"),
        ({**SPATIAL, "volume.max.y": 0}, "volume.min.y is 0, which is not below volume.max.y, 0"),
        ({**SPATIAL, "start.x": "nan"}, "start.x must be a finite number up to 1e.09, not 'nan'"),
        (
            {**SPATIAL, "goal.theta": "inf"},
            "goal.theta must be a finite number up to 1e.09, not 'inf'",
        ),
        ({**SPATIAL, "goal.y": "1,5"}, "goal.y must be a finite number up to 1e.09, not '1,5'"),
        ({**SPATIAL, "goal.y": ""}, "has no goal.y"),
        ({**SPATIAL, "goal.axis.y": 0}, "goal.theta is 1.5, but goal.axis has no length"),
        ({**SPATIAL, "robot": "el.dae"}, "no such file: .*el.dae"),
        ({**SPATIAL, "world": "wall.3ds"}, "meshes are read from .*convert it"),
        ({**SPATIAL, "robot": "../../ell.dae"}, "climbs out of the folder"),
        ({**SPATIAL, "start.z": 0.5}, "its start touches the world, .*correct start.x"),
        ({**SPATIAL, "goal.z": 0.5}, "its goal touches the world, .*correct goal.x"),
        ({**PLANAR, "control": "kinematic_car"}, "control = kinematic_car: .*take that line out"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(values: Values, said: str, folder: Path) -> None:
    with pytest.raises(InputError, match=said):
        made(folder, values)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "say which problem, as in omplapp:file=Home.cfg"),
        ("file=nowhere.cfg", "no such file: nowhere.cfg"),
        ("file={},space=se4", "no space is called 'se4'; did you mean"),
        ("file={},kind=sold", "no kind is called 'sold'; did you mean 'solid'"),
        ("file={},weight=-1", "weight must be between 0 and 500, not -1"),
    ],
)
def test_arguments_that_cannot_be_are_said(arguments: str, said: str, folder: Path) -> None:
    file = folder / "planar.cfg"
    with pytest.raises(InputError, match=said):
        envs.make(f"omplapp:{arguments.format(file)}".rstrip(":"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"no \[problem\] in it"),
        ("[planner]\nrrt=\n", r"no \[problem\] in it"),
        ("[problem]\nrobot ell.dae\n", "line 2 is no KEY = VALUE: 'robot ell.dae'"),
        ("[problem]\nrobot=a.obj\nrobot=b.obj\n", "line 3 says robot again"),
    ],
)
def test_files_of_another_form_are_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "own.cfg").write_text(text)
    with pytest.raises(InputError, match=said):
        read_problem(tmp_path / "own.cfg")


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "own.cfg").write_bytes(b"[problem]\nname = \xff\n")
    with pytest.raises(InputError, match=r"cannot read .*own\.cfg"):
        read_problem(tmp_path / "own.cfg")


def test_comments_spaces_other_sections_and_ends_of_lines_do_not_matter(folder: Path) -> None:
    plain = read_problem(folder / "spatial.cfg")
    lines = [f"  {key}={value}   # said so" for key, value in SPATIAL.items()]
    text = "\r\n".join(["\ufeff# own", "[benchmark]", "x", "", "[ problem ]", *lines, "[planner]"])
    (folder / "noisy.cfg").write_bytes(text.encode())
    noisy = read_problem(folder / "noisy.cfg")
    assert noisy.robot == plain.robot == folder.absolute() / "ell.dae"
    assert (noisy.goal.position == plain.goal.position).all()
    assert noisy.goal.angle == plain.goal.angle == 1.5
    assert plain.volume is not None
    assert noisy.volume is not None
    assert (noisy.volume[1] == plain.volume[1]).all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Y_UP", "W_UP", "its up_axis is 'W_UP', not X_UP, Y_UP or Z_UP"),
        ("<p>0 1</p>", "<p>0 9</p>", "out of bounds"),
        ("<p>0 1</p>", "<p>0 x</p>", "invalid literal"),
    ],
)
def test_collada_that_assimp_would_not_read_is_refused(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    line = '<lines><input semantic="VERTEX" source="#g-vertices" offset="0"/><p>0 1</p></lines>'
    shape = geometry(TETRAHEDRON, triangles(TRIANGLES)).replace("</mesh>", line + "</mesh>")
    whole = dae(shape, asset="<up_axis>Y_UP</up_axis>")
    file = tmp_path / "one.dae"
    file.write_bytes(whole)
    assert read_as_assimp(file)[0].closed
    file.write_bytes(whole.replace(old.encode(), new.encode()))
    with pytest.raises(InputError, match=f"one.dae cannot be read as a mesh: .*{said}"):
        read_as_assimp(file)


def test_a_file_alone_says_what_to_write(folder: Path) -> None:
    with pytest.raises(InputError, match=r"a problem of OMPL\.app is omplapp:file="):
        envs.make(str(folder / "planar.cfg"))
