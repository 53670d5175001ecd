"""Robots that have names: those of example-robot-data, and those that packages announce."""

from __future__ import annotations

import sys
from pathlib import Path

import plugins
import pytest
from arms import TURNING_HAND, arm_file
from conftest import Cli, Refused

import envs
from envs import InputError
from envs.robots import example_robot_data
from envs.robots.joint_graph import JointGraph
from envs.robots.named_robots import known_robots, robot_named
from envs.robots.planning_group import PlanningGroup
from envs.robots.robot_description import RobotDescription
from envs.robots.srdf import Srdf, read_srdf
from envs.robots.urdf_elements import parsed
from envs.robots.urdf_tree import tree_of

THEIRS = example_robot_data.robots()

SRDF = """<robot name="arm">
  <group name="all"><joint name="turn"/></group>
  <group_state name="out" group="all"><joint name="turn" value="1"/></group_state>
</robot>"""


def needs_their_files() -> None:
    if any(robot.missing for robot in THEIRS):
        pytest.skip('example-robot-data is not installed: pip install "plannerbench[robots]"')


def announce(folder: Path, text: str, name: str = "lab", attribute: str = "ROBOTS") -> None:
    """Puts a package into a folder that announces robots, beside a robot's files."""
    arm_file(folder, *TURNING_HAND)
    (folder / "arm.srdf").write_text(SRDF)
    plugins.install(folder, name, text, {f"bench.robots {name}": f"{name}:{attribute}"})


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of packages, in which modules are found, as long as a test lasts."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr("sys.modules", dict(sys.modules))
    return tmp_path


@pytest.mark.parametrize("robot", THEIRS, ids=lambda robot: robot.name)
def test_the_joints_that_move_are_there_and_as_many_as_is_said(robot: RobotDescription) -> None:
    needs_their_files()
    srdf = read_srdf(robot.srdf) if robot.srdf else Srdf()
    group = PlanningGroup(srdf, robot.group, robot.tip, robot.joints, robot.state)
    graph = JointGraph(parsed(robot.urdf)[0])
    assert tree_of(graph, group.locked(graph)).dimension == robot.dof


def test_a_name_stands_for_files_and_a_group(bench: Cli) -> None:
    needs_their_files()
    panda = robot_named("panda")
    written = f"arm:urdf={panda.urdf},srdf={panda.srdf},group=arm,self_collision=false"
    env = envs.make("arm:robot=panda,self_collision=false")
    assert env.dimension == 7
    assert env.fingerprint == envs.make(written).fingerprint


@pytest.mark.parametrize(
    ("chosen", "dimension"),
    [
        ("", 14),
        (",group=left_arm", 7),
        (",tip=head_pan_link", 2),
        (',joints="head_pan_joint,laser_tilt_mount_joint"', 2),
    ],
)
def test_what_is_said_beside_a_name_counts_instead(chosen: str, dimension: int) -> None:
    needs_their_files()
    env = envs.make(f"arm:robot=pr2,self_collision=false,geometry=visual{chosen}")
    assert env.dimension == dimension


@pytest.mark.parametrize("attribute", ["ROBOTS", "robots"])
def test_packages_announce_a_mapping_or_a_function(site: Path, attribute: str) -> None:
    announce(
        site,
        "ROBOTS = {'lab-arm': {'urdf': 'arm.urdf', 'srdf': 'arm.srdf', 'group': 'all',\n"
        "                      'description': 'turns', 'dof': 1},\n"
        "          'other': {'urdf': 'arm.urdf', 'joints': ['turn']}}\n"
        "def robots():\n"
        "    return ROBOTS\n",
        attribute=attribute,
    )
    files = site / "arm.urdf", site / "arm.srdf"
    first, second = known_robots()[len(THEIRS) :]
    assert first == RobotDescription(
        *("lab-arm", *files), group="all", dof=1, description="turns", origin="lab"
    )
    assert second == RobotDescription("other", files[0], joints=("turn",), dof=1, origin="lab")
    assert envs.make("arm:robot=lab-arm").dimension == 1


def test_srdf_and_state_of_a_name_count_unless_others_are_given(site: Path) -> None:
    text = "ROBOTS = {'arm': {'urdf': 'arm.urdf', 'srdf': 'arm.srdf', 'state': 'out'}}"
    announce(site, text)
    assert envs.make("arm:robot=arm").dimension == 1
    with pytest.raises(InputError, match="unknown state 'put'; did you mean 'out'"):
        envs.make("arm:robot=arm,state=put")
    (site / "empty.srdf").write_text("<robot name='arm'/>")
    with pytest.raises(InputError, match="unknown state 'out'"):
        envs.make(f"arm:robot=arm,srdf={site / 'empty.srdf'}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ROBOTS = {'panda': {'urdf': 'arm.urdf'}}", "there is a robot called 'panda' already"),
        ("ROBOTS = {'a': {'urdf': 'arm.urdf', 'gruop': 'b'}}", "'gruop'; did you mean 'group'"),
        ("ROBOTS = {'a': {'srdf': 'arm.srdf'}}", "robot 'a' has no urdf"),
        ("ROBOTS = {'a': {'urdf': 5}}", "a: urdf is 5, not a str"),
        ("ROBOTS = {'a': {'urdf': 'arm.urdf', 'joints': 'j'}}", "a: joints is 'j', not a list"),
        ("ROBOTS = {'a': 'arm.urdf'}", "a is 'arm.urdf', not a Mapping"),
        ("ROBOTS = {'a b': {'urdf': 'arm.urdf'}}", "'a b' is not a well-formed robot name"),
        ("ROBOTS = ['arm.urdf']", "robots is ['arm.urdf'], not a Mapping"),
        ("def ROBOTS():\n    raise KeyError('two\\nlines')", "KeyError"),
        ("robots = {}", "AttributeError"),
        ("raise SystemExit(5)", "SystemExit: 5"),
    ],
)
def test_a_package_that_is_broken_is_named_and_left_out(
    text: str, said: str, site: Path, bench: Cli
) -> None:
    announce(site, text, "bad")
    code, out, err = bench("list", "robots")
    assert code == 0
    [line] = [line for line in err.splitlines() if "robot plug-in 'bad' is skipped: " in line]
    assert said in line
    assert out.count("\n") == 1 + len(THEIRS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("arm:robot=panda,urdf=a.urdf", "urdf and robot both say which robot; give one of them"),
        ("arm:robot=pandas", "unknown robot 'pandas'; did you mean 'panda'"),
    ],
)
def test_mistakes_are_one_clear_line(text: str, said: str, refused: Refused) -> None:
    assert said in refused("show", "--env", text, "--out", "drawn.png")


def test_without_the_package_a_line_says_how_to_have_it(
    monkeypatch: pytest.MonkeyPatch, refused: Refused, bench: Cli
) -> None:
    monkeypatch.setattr(example_robot_data, "_FOLDERS", ("nowhere", "nowhere"))
    advice = 'pip install "plannerbench[robots]"'
    said = refused("show", "--env", "arm:robot=ur5", "--out", "drawn.png")
    assert "robot 'ur5' is in example-robot-data" in said
    assert advice in said
    code, out, err = bench("list", "robots")
    assert code == 0
    assert out.count("(not installed)") == len(THEIRS)
    assert err.count(advice) == 1
