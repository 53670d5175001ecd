"""OMPL 2's planners: what is said without the package; with it, in an interpreter of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from conftest import Cli, records_of

import planners
from bench.storage.record import Verdict
from envs import Environment, InputError
from planners.ompl import parameters
from planners.ompl.state_space import unit_square
from planners.peers.guest import Installed
from planners.peers.ompl2 import Ompl2Planner
from planners.peers.ompl2_parameters import parameters_of

IDS = [spec.id for spec in planners.REGISTRY.specs() if spec.id.startswith("ompl2-")]
IMPROVES = {"aorrtc", "rrtstar", "informedrrtstar", "prmstar", "bitstar"}


def test_they_are_chosen_by_name_or_as_peers() -> None:
    specs = [planners.REGISTRY.entry(id).spec for id in IDS]
    assert specs
    assert all(spec.groups == ("peers",) and not spec.in_all for spec in specs)


@pytest.mark.parametrize("id", IDS)
def test_it_says_whether_it_improves_its_path(id: str) -> None:
    assert planners.make(id).improves == (id.removeprefix("ompl2-") in IMPROVES)


@pytest.mark.parametrize("id", IDS)
def test_ompl_1_is_not_taken_for_ompl_2(id: str, c3d: Environment) -> None:
    """It is what is installed here, under the same name."""
    reason = planners.make(id).unsupported(c3d)
    assert reason is not None
    assert reason.startswith("OMPL 2 is wanted, and this interpreter has ompl 1.")
    assert "python=PATH" in reason
    assert "\n" not in reason


def test_another_interpreter_is_asked_for_its_version(c3d: Environment, tmp_path: Path) -> None:
    other = tmp_path / "python"
    other.symlink_to(sys.executable)  # another path, and so another interpreter
    reason = planners.make(f"ompl2-rrtconnect:python={other}").unsupported(c3d)
    assert reason is not None
    assert reason.startswith(f"OMPL 2 is wanted, and {other} has ")
    assert reason.endswith(f"{other} -m pip install --no-deps ompl==2.0.1")


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (Installed("", ("ompl",)), "this interpreter has no ompl"),
        (Installed("1.7.0", ()), "this interpreter has ompl 1.7.0"),
        (Installed("2.0.1", ("numba", "fcl")), "lacks what environments need (numba, fcl)"),
        (Installed("2.0.1", ()), None),
    ],
)
def test_it_says_what_is_lacking(found: Installed, said: str | None) -> None:
    reason = Ompl2Planner("RRTConnect").lacking(found)
    assert (reason is None) if said is None else (reason is not None and said in reason)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ompl2-rrtstar:rang=2", "RRTstar has no parameter 'rang'; did you mean 'range'"),
        ("ompl2-rrtconnect:goal_bias=0.1", "RRTConnect has no parameter 'goal_bias'"),
        ("ompl2-rrtconnect:pyton=x", "did you mean 'python'"),
        ("ompl2-rrtstar:range=far", "RRTstar refuses range=far"),
        ("ompl2-rrtstar:delay_collision_checking=5", "RRTstar refuses delay_collision_checking=5"),
        ("ompl2-fmt:num_samples=-1", "FMT refuses num_samples=-1"),
        ("ompl2-fmt:radius_multiplier=0", "FMT refuses radius_multiplier=0"),
        ("ompl2-rrtconnect:python=/no/such/file", "python=/no/such/file is no program"),
    ],
)
def test_wrong_arguments_are_refused(text: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        planners.make(text)
    assert said in str(refused.value)


_GONE = {"BFMT": {"balanced", "optimality"}}
"""What this binding cannot set."""


@pytest.mark.parametrize(
    "algorithm", ["RRTConnect", "RRTstar", "PRMstar", "BITstar", "FMT", "BFMT"]
)
def test_parameters_have_the_names_of_ompl_1(algorithm: str) -> None:
    _, geometric, util = parameters.load()
    names = util.vectorString()
    made = getattr(geometric, algorithm)(unit_square().information())
    made.params().getParamNames(names)
    assert set(parameters_of(algorithm)) == set(names) - _GONE.get(algorithm, set())


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An interpreter with OMPL 2, and all else from this one."""
    folder = tmp_path_factory.mktemp("ompl2")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True, timeout=120)
    names = {"base": str(folder), "platbase": str(folder)}
    packages = Path(sysconfig.get_path("purelib", "venv", vars=names))
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--target",
        str(packages),
    ]
    got = subprocess.run(
        [*pip, "ompl==2.0.1"], check=False, capture_output=True, text=True, timeout=300
    )
    if got.returncode:
        pytest.skip(f"pip cannot get ompl 2.0.1: {got.stderr.strip().splitlines()[-1:]}")
    ours = [sysconfig.get_path(kind) for kind in ("purelib", "platlib")]
    (packages / "of_the_tests.pth").write_text("\n".join(dict.fromkeys(ours)) + "\n")
    return folder / "bin" / "python"


def _planners(python: Path, *ids: str) -> str:
    return ",".join(f"ompl2-{id}:python={python}" for id in ids)


@pytest.mark.slow(minutes=3)
@pytest.mark.parametrize(
    ("env", "ids"),
    [
        ("c3d", IDS),
        ("arm6", IDS),
        ("rigid:body=piano,space=se2,world=c3d", ["ompl2-aorrtc", "ompl2-informedrrtstar"]),
    ],
)
def test_they_plan_behind_certified_checks(
    env: str, ids: list[str], python: Path, bench: Cli, tmp_path: Path
) -> None:
    chosen = _planners(python, *(id.removeprefix("ompl2-") for id in ids))
    run = ("run", "--env", env, "--planners", chosen, "--problems", 4, "--stop", "first")
    code, _, err = bench(*run, "--out", tmp_path / "out")
    assert code == 0, err
    records = records_of(tmp_path / "out")
    assert len(records) == 4 * len(ids)
    failed = records[records["verdict"] != Verdict.VALID.value]
    assert failed.empty, failed[["env", "planner", "problem", "status", "outcome", "error"]]
    assert (records["solve_s"] < 2).all(), "they stop at their first path"


@pytest.mark.slow(minutes=1)
def test_deadlines_are_kept(python: Path, bench: Cli, tmp_path: Path) -> None:
    chosen = _planners(python, *sorted(IMPROVES))
    run = ("run", "--env", "c3d,arm6", "--planners", chosen, "--problems", 4, "--stop", "limit")
    code, _, err = bench(*run, "--time-limit", 0.5, "--out", tmp_path / "out")
    assert code == 0, err
    records = records_of(tmp_path / "out")
    failed = records[records["verdict"] != Verdict.VALID.value]
    assert failed.empty, failed[["env", "planner", "problem", "status", "outcome", "error"]]
    assert (records["solve_s"] <= 0.5).all()
    for stats in records["stats"]:
        told = json.loads(stats) if isinstance(stats, str) else stats
        assert told["library"] == "ompl 2.0.1"
        assert told["collision_checks"] > 0
        assert 0 < told["callback_s"] < 0.5
        lengths = [length for _, length in told["cost_history"]]
        assert lengths == sorted(lengths, reverse=True)


@pytest.mark.slow(minutes=1)
def test_the_same_seed_gives_the_same_first_path(python: Path, bench: Cli, tmp_path: Path) -> None:
    """The seed is the problem's, whatever was planned before."""
    chosen = _planners(python, "rrtconnect", "rrtstar", "aorrtc", "bitstar", "fmt")
    run = ("run", "--env", "c3d", "--planners", chosen, "--problems", 3, "--stop", "first")
    lengths = []
    for name in ("one", "other"):
        assert bench(*run, "--out", tmp_path / name)[0] == 0
        records = records_of(tmp_path / name).sort_values(["planner", "problem"])
        lengths.append(records["length"].tolist())
    assert lengths[0] == lengths[1]
