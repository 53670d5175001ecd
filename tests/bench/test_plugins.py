"""Planners and environments of strangers: installed ones by entry points, others by file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import plugins
import pytest
from conftest import Cli, Refused, records_of

import envs
import planners
from envs import Environment, InputError, Registry
from planners import Planner, user_plugins

Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Installs a package for the length of a test; registries know it, and little of our own."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(site)

    def call(name: str, text: str, **points: str) -> None:
        named = {key.replace("__", " ").replace("_", "."): value for key, value in points.items()}
        plugins.install(site, name, text, named)
        own = [planners.REGISTRY.entry("rrtconnect").spec]
        known = Registry[Planner]("planner", own, "bench.planners", Planner)
        monkeypatch.setattr(planners, "REGISTRY", known)
        worlds = [envs.REGISTRY.entry("c3d").spec]
        worlds_known = Registry[Environment]("environment", worlds, "bench.envs", Environment)
        monkeypatch.setattr(envs, "REGISTRY", worlds_known)

    return call


def spec(id: str, entry_point: str) -> str:
    return f'{id.upper()} = Spec("{id}", "{entry_point}", "a plug-in")\n'


WORLD = """
from envs import Spec
from envs.scenes.cluttered import Cluttered3D


class Sparse(Cluttered3D):
    def __init__(self, scene: int = 0):
        super().__init__(scene, boxes=2)

    def definition(self):
        return {**super().definition(), "class": "Sparse"}
"""


@pytest.mark.slow
def test_an_installed_planner_plans_in_an_installed_world(
    bench: Cli, install: Install, tmp_path: Path
) -> None:
    text = plugins.PLANNER + WORLD + spec("plain", "pair:Straight") + spec("sparse", "pair:Sparse")
    install("pair", text, bench_planners__p="pair:PLAIN", bench_envs__e="pair:SPARSE")
    code, out, err = bench("list", "--json")
    assert code == 0, err
    listed = json.loads(out)
    assert [one["id"] for one in listed["planners"]] == ["rrtconnect", "plain"]
    assert [one["id"] for one in listed["envs"]] == ["c3d", "sparse"]
    code, out, err = bench(
        *("run", "--env", "sparse:scene=4", "--planners", "plain:bends=3", "--problems", 2),
        *("--stop", "first", "--out", tmp_path / "run"),
    )
    assert code == 0, err
    records = records_of(tmp_path / "run")
    assert set(records["env"]) == {"sparse:scene=4"}
    assert set(records["planner"]) == {"plain:bends=3"}
    assert set(records["status"]) == {"EXACT_SOLUTION"}


@pytest.mark.parametrize(
    ("text", "point", "said"),
    [
        ("import no_such_module", "SPEC", "ModuleNotFoundError: No module named"),
        ("", "SPEC", "AttributeError"),
        ("raise ValueError('two\\nlines')", "SPEC", "ValueError: two lines"),
        ("raise SystemExit(5)", "SPEC", "SystemExit: 5"),
        ("def broken(:", "SPEC", "SyntaxError"),
        ("SPEC = 5", "SPEC", "is a int, not a Spec"),
        ("from envs import Spec\nSPEC = Spec('a/b', 'm:C', '')", "SPEC", "not a well-formed"),
        ("from envs import Spec\nSPEC = Spec(5, 'm:C', '')", "SPEC", "TypeError"),
    ],
)
def test_a_broken_plug_in_is_named_in_one_line_and_skipped(
    bench: Cli, install: Install, text: str, point: str, said: str, tmp_path: Path
) -> None:
    name = tmp_path.name  # another for each case, as modules stay imported
    install(name, text, bench_planners__bad=f"{name}:{point}")
    code, out, err = bench("list", "planners")
    assert code == 0
    assert "rrtconnect" in out
    assert err.count("\n") == 1
    assert err.startswith("planner plug-in 'bad' is skipped: ")
    assert said in err


LATE = """
class NoPlanner:
    pass


class BadStart(Straight):
    def __init__(self):
        raise ValueError("cannot begin")


class BadSupport(Straight):
    def unsupported(self, env):
        raise KeyError("which?")
"""


@pytest.mark.slow
def test_one_that_breaks_when_it_is_made_is_left_out_of_groups_and_refused_by_name(
    bench: Cli, install: Install, tmp_path: Path
) -> None:
    wrong = {
        "gone": ("late:Gone", "has no attribute 'Gone'"),
        "other": ("late:NoPlanner", "is not a Planner"),
        "start": ("late:BadStart", "cannot begin"),
        "support": ("late:BadSupport", "which?"),
        "function": ("late:test", "not a class"),
    }
    specs = "".join(spec(id, where) for id, (where, _) in wrong.items())
    points = {f"bench_planners__{id}": f"late:{id.upper()}" for id in wrong}
    install("late", plugins.PLANNER + LATE + "def test():\n    pass\n" + specs, **points)
    small = ("--env", "c3d", "--problems", 1, "--stop", "first", "--out", tmp_path / "run")
    code, out, err = bench("run", "--planners", "all", *small)
    assert code == 0, err
    assert set(records_of(tmp_path / "run")["planner"]) == {"rrtconnect"}
    for id, (_, said) in wrong.items():
        [line] = [line for line in err.splitlines() if f"plug-in {id!r} of late is skipped" in line]
        assert said in line
    for id in ("gone", "other", "start", "function"):
        code, out, err = bench("run", "--planners", id, *small)
        assert (code, out) == (2, "")
        assert err.startswith("bench: error: ")
        assert wrong[id][1] in err
        assert err.count("\n") == 1


@pytest.mark.parametrize("id", ["rrtconnect", "all"])
def test_an_id_that_is_taken_is_an_error_each_time(bench: Cli, install: Install, id: str) -> None:
    name = f"taker_{id}"
    text = f'from envs import Spec\nSPEC = Spec("{id}", "m:C", "")\n'
    install(name, text, bench_planners__p=f"{name}:SPEC")
    for _ in range(2):
        code, _out, err = bench("list", "planners")
        assert code == 2
        assert f"there is a planner called {id!r} already, so {name} cannot add it" in err
        assert err.count("\n") == 1


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "plain.py"
    made.write_text(plugins.PLANNER, encoding="utf-8")
    return made


@pytest.mark.slow
def test_a_file_adds_its_planners_for_one_command(bench: Cli, file: Path, tmp_path: Path) -> None:
    code, out, err = bench("list", "planners", "--planner-file", file)
    assert code == 0, err
    assert "straight             Claims the straight line." in out
    code, out, err = bench(
        *("run", "--env", "c3d", "--planners", "straight,straight:bends=2", "--problems", 1),
        *("--planner-file", file, "--stop", "first", "--out", tmp_path / "run"),
    )
    assert code == 0, err
    assert set(records_of(tmp_path / "run")["status"]) == {"EXACT_SOLUTION"}
    assert "straight" not in [spec.id for spec in planners.REGISTRY.specs()]


def test_classes_say_more_of_themselves_in_attributes(tmp_path: Path) -> None:
    file = tmp_path / "several.py"
    file.write_text(
        plugins.PLANNER
        + "class HTTPPlanner2D(Straight):\n    pass\n"
        + "class Named(Straight):\n"
        + "    id, version, not_repeatable, in_all = 'mine+', 7, 'it asks around', False\n"
        + "class _Hidden(Straight):\n    pass\n"
        + "Again = Named\n"
    )
    first, second, third = user_plugins.specs_of_file(file)
    assert (first.id, second.id, third.id) == ("straight", "http-planner2-d", "mine+")
    assert first.version == second.version != 7
    assert (third.version, third.not_repeatable, third.in_all) == (7, "it asks around", False)
    assert third.load().__name__ == "Named"


def test_a_changed_file_is_another_version(file: Path) -> None:
    [before] = user_plugins.specs_of_file(file)
    [same] = user_plugins.specs_of_file(file)
    file.write_text(plugins.PLANNER.replace("[problem.start", "[problem.start + 1"))
    [after] = user_plugins.specs_of_file(file)
    assert before.version == same.version != after.version
    assert before.load() is after.load(), "what is loaded is what is there now"


@pytest.mark.parametrize(("stated", "changes"), [("", True), (", version=2", False)])
def test_an_edited_package_is_another_version_unless_it_states_one(
    stated: str, changes: bool, install: Install
) -> None:
    name = f"edited_{changes}"
    said = f'MINE = Spec("mine", "{name}:Straight", "a plug-in"{stated})\n'
    versions = []
    for text in (plugins.PLANNER, plugins.PLANNER, plugins.PLANNER + "# edited\n"):
        install(name, text + said, bench_planners__p=f"{name}:MINE")
        versions.append(planners.REGISTRY.entry("mine").spec.version)
    before, same, after = versions
    assert before == same
    assert (after != same) == changes


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "cannot read"),
        ("", "defines no subclass of planners.Planner"),
        ("import no_such_module", "ModuleNotFoundError"),
        ("def broken(:", "SyntaxError"),
        ("raise SystemExit(5)", "SystemExit: 5"),
        ("raise KeyError('two\\nlines')", "KeyError"),
        ("from planners import Planner\nclass A(Planner):\n    pass", "A lacks a method `solve`"),
        (plugins.PLANNER + "    id = 5\n", "Straight.id must be a str"),
        (plugins.PLANNER + "    id = 'a b'\n", "'a b' is not a well-formed planner name"),
        (plugins.PLANNER + "    id = 'fmm'\n", "called 'fmm' already"),
        (plugins.PLANNER + "    id = 'rrt*'\n", "called 'rrt*' already"),
        (plugins.PLANNER + "    id = 'paper'\n", "called 'paper' already"),
    ],
)
def test_a_file_that_is_not_in_order_is_refused(
    refused: Refused, tmp_path: Path, text: str | None, said: str
) -> None:
    file = tmp_path / "mine.py"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    before = planners.REGISTRY.specs()
    assert said in refused("list", "--planner-file", file)
    assert planners.REGISTRY.specs() == before


def test_other_mistakes_with_files_are_refused(refused: Refused, file: Path) -> None:
    error = refused("list", "--planner-file", file, "--planner-file", file)
    assert "called 'straight' already" in error
    with pytest.raises(InputError, match=r"no file of Python"):
        user_plugins.specs_of_file(file.with_suffix(".txt"))
