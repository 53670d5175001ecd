"""`bench check` through the command line, on runs stored in folders."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest
from conftest import Cli, Refused
from records import record_of, row

from bench.analysis import regression
from bench.storage.store import Store
from envs import InputError

N = 20
SOLVED = {"fmm": N, "rrtstar": N - 1, "prmstar": N}
SCALES = {"fmm": 1.0, "rrtstar": 2.0, "prmstar": 1.5}


def stored(
    folder: Path, solved: dict[str, int] = SOLVED, scales: dict[str, float] = SCALES, **others: Any
) -> Path:
    """A folder as `bench run` leaves it: `solved` of N problems in c3d, and how planners' times,
    lengths and margins compare to each other; those `absent` were asked for and not attempted, and
    `n` is in place of N."""
    absent, n = others.pop("absent", ()), others.pop("n", N)
    settings = {"time_limit_s": others.pop("time_limit_s", 5.0), "stop": "first", "jobs": 1}
    selection = {
        "envs": [{"id": "c3d", "fingerprint": others.get("env_fingerprint", "f")}],
        "planners": list(solved),
        "problems": n,
        "seed": others.get("problems_seed", 0),
        "settings": settings,
        "settings_digest": "s",
    }
    with Store(folder) as store:
        store.put_selection(selection)
        for planner, count in solved.items():
            for i in range(n if planner not in absent else 0):
                value = scales.get(planner, 1.0) * (10 + i)
                measured = {"solve_s": value / 100, "length": value, "safety_margin": value / 50}
                outcome = "VALID" if i < count else others.get("outcome", "TIMEOUT")
                told = {**(measured if outcome == "VALID" else {}), **others}
                told.pop("outcome", None)
                store.put(record_of(row(planner, i, outcome, **told)))
        store.put_session("r", {"run_id": "r"})
    return folder


@pytest.fixture
def baseline(bench: Cli, tmp_path: Path) -> Path:
    """Of three planners, with all measures, in a folder that was not there."""
    file = tmp_path / "kept" / "c3d.csv"
    run = stored(tmp_path / "before")
    code, out, _ = bench(
        "check", run, "--baseline", file, "--update", "--ratios", "time,length,margin"
    )
    assert code == 0
    assert "`rrtstar` in `c3d`: none → 19 of 20 solved, length 38, margin 0.76, time 0.38" in out
    return file


def test_the_same_again_passes(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    kept = baseline.read_bytes()
    code, out, _ = bench("check", stored(tmp_path / "now"), "--baseline", baseline)
    assert code == 0
    assert out.startswith("## Pass: no regression\n")
    assert out.count("| no drop shown |") == 3
    assert "95.0 %" in out
    assert "- regression:" not in out
    assert baseline.read_bytes() == kept, "only --update writes"
    assert [f.name for f in baseline.parent.iterdir()] == ["c3d.csv"]


def test_fewer_solved_fails_in_one_line(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    now = stored(tmp_path / "now", {**SOLVED, "rrtstar": 5})
    out_file = tmp_path / "comment.md"
    code, out, _ = bench("check", now, "--baseline", baseline, "--out", out_file)
    assert code == 1
    assert out.startswith("## Regression: 1 of 3 tests\n")
    [line] = [line for line in out.splitlines() if line.startswith("- regression")]
    assert line.startswith("- regression: `rrtstar` in `c3d`: success from 95.0 % to 25.0 % (p ")
    [told] = [line for line in out.splitlines() if "**regression**" in line]
    assert "↓ 70.0 points" in told
    assert out_file.read_text(encoding="utf-8") + "\n" == out


def test_alpha_decides(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    """Other paths, so that luck may have lost some: p is 2^-7, by three tests 0.023."""
    now = stored(tmp_path / "now", {**SOLVED, "rrtstar": 12}, {**SCALES, "rrtstar": 2.001})
    assert bench("check", now, "--baseline", baseline)[0] == 0
    assert bench("check", now, "--baseline", baseline, "--alpha", 0.05)[0] == 1


def test_a_fall_from_20_to_18_fails_where_the_paths_are_as_they_were(
    bench: Cli, tmp_path: Path, baseline: Path
) -> None:
    now = stored(tmp_path / "now", {**SOLVED, "fmm": N - 2})
    code, out, _ = bench("check", now, "--baseline", baseline)
    assert code == 1
    assert "- regression: `fmm` in `c3d`: success from 100.0 % to 90.0 % (p " in out
    assert "| a fall to 18 of 20 (repeated)" in out
    assert "that 5 % of what was solved is lost is noticed with probability" in out


def test_paths_drawn_anew_need_a_larger_fall(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    """Lengths differ, so random numbers do, too, and luck may have lost some."""
    anew = {**SCALES, "fmm": 1.001}
    for solved, expected in ((N - 6, 0), (N - 9, 1)):
        now = stored(tmp_path / f"now{solved}", {**SOLVED, "fmm": solved}, anew)
        code, out, _ = bench("check", now, "--baseline", baseline)
        assert code == expected
        assert "| a fall to 11 of 20 (McNemar)" in out


def test_which_were_solved_matters(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    """As many are solved, but others: a rise makes up for a fall."""
    other = stored(tmp_path / "now", {**SOLVED, "rrtstar": N})
    with Store(other) as store:
        store.put(record_of(row("rrtstar", 4, "TIMEOUT")))
    code, out, _ = bench("check", other, "--baseline", baseline)
    assert code == 0, out
    [line] = [line for line in out.splitlines() if line.startswith("| `c3d` | `rrtstar` | success")]
    assert "| 95.0 %     | 95.0 %" in line


def test_an_older_baseline_is_tested_as_it_was(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    lines = [line.split(",") for line in baseline.read_text().splitlines()]
    column = lines[0].index("outcomes")
    older = [",".join([*cells[:column], *cells[column + 1 :]]) for cells in lines]
    baseline.write_text("\n".join(older) + "\n")
    now = stored(tmp_path / "now", {**SOLVED, "rrtstar": 12})  # p 0.0098, by three tests 0.029
    code, out, _ = bench("check", now, "--baseline", baseline)
    assert code == 0
    assert "(Fisher)" in out
    assert "`fmm` in `c3d`: success is tested as if problems were others" in out
    assert "--update writes it so" in out
    assert bench("check", now, "--baseline", baseline, "--alpha", 0.05)[0] == 1


def test_lengths_and_margins_compare_without_a_reference(
    bench: Cli, tmp_path: Path, baseline: Path
) -> None:
    options = ("--ratios", "length,margin")
    same = stored(tmp_path / "same")
    code, out, _ = bench("check", same, "--baseline", baseline, *options)
    assert code == 0
    assert out.count("| no drop shown |") == 9, "of each planner"
    assert out.count("10 % worse") == 6, "nothing is left to chance"
    longer = stored(tmp_path / "longer", scales={**SCALES, "fmm": 1.2})
    code, out, _ = bench("check", longer, "--baseline", baseline, *options)
    assert code == 1
    assert "- regression: `fmm` in `c3d`: length from " in out
    assert "A measure is the geometric mean of the problems that were solved both times" in out


RATIOS = ("--ratios", "length,margin,time", "--reference", "fmm")


@pytest.mark.parametrize(
    ("factor", "worse", "better"), [(1.3, ["length", "time"], "margin"), (0.7, ["margin"], "time")]
)
def test_ratios_fall_in_their_own_direction(
    factor: float, worse: list[str], better: str, bench: Cli, tmp_path: Path, baseline: Path
) -> None:
    now = stored(tmp_path / "now", scales={**SCALES, "prmstar": 1.5 * factor})
    code, out, _ = bench("check", now, "--baseline", baseline, *RATIOS)
    assert code == 1
    lines = [line for line in out.splitlines() if line.startswith("- regression")]
    assert [line.partition("`c3d`: ")[2].split()[0] for line in lines] == worse
    assert f"{worse[0]} / fmm's from 1.5 to {1.5 * factor:.3g} (p " in lines[0]
    assert f"{better} / fmm's" not in "".join(lines)
    assert "worse is more length, less margin, more time, by more than 10 %" in out


def test_a_slower_machine_is_no_regression(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    now = stored(tmp_path / "now", scales={name: 7 * scale for name, scale in SCALES.items()})
    code, out, _ = bench("check", now, "--baseline", baseline, *RATIOS)
    assert code == 0
    assert out.count("| no drop shown |") == 9, "success of three, three ratios of two"


def test_ratios_within_the_tolerance_pass(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    now = stored(tmp_path / "now", scales={**SCALES, "prmstar": 1.5 * 1.3})
    assert bench("check", now, "--baseline", baseline, *RATIOS)[0] == 1
    assert bench("check", now, "--baseline", baseline, *RATIOS, "--tolerance", 0.4)[0] == 0


def test_ratios_of_other_problems_are_left_out(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    now = stored(tmp_path / "now", scales={**SCALES, "prmstar": 9.0}, problems_seed=3)
    code, out, _ = bench("check", now, "--baseline", baseline, *RATIOS)
    assert code == 0
    assert out.count("| success |") == 3
    assert "`prmstar` in `c3d`: no ratios, as the problems are others: their seeds are 0, 3" in out


@pytest.mark.parametrize("outcome", ["UNSUPPORTED", "SKIPPED"])
def test_what_was_not_attempted_is_noted(
    outcome: str, bench: Cli, tmp_path: Path, baseline: Path
) -> None:
    now = stored(tmp_path / "now", {"prmstar": 0}, outcome=outcome)
    code, out, _ = bench("check", now, "--baseline", baseline)
    assert code == 3
    assert out.startswith("## Nothing comparable was measured\n")
    assert "`prmstar` in `c3d`: not compared, as it was UNSUPPORTED or SKIPPED" in out
    assert "`fmm` in `c3d`: not compared, as this run lacks it" in out
    kept = baseline.read_bytes()
    code, out, err = bench("check", now, "--baseline", baseline, "--update")
    assert (code, out, baseline.read_bytes()) == (3, "", kept)
    assert "nothing was measured" in err


@pytest.mark.parametrize(
    ("others", "said"),
    [
        ({"env_fingerprint": "g"}, "its fingerprint was f and is g"),
        ({"time_limit_s": 1.0}, "they were time_limit_s=5.0 and are time_limit_s=1.0"),
    ],
)
def test_other_conditions_do_not_compare(
    others: dict[str, Any], said: str, bench: Cli, tmp_path: Path, baseline: Path
) -> None:
    now = stored(tmp_path / "now", {**SOLVED, "rrtstar": 0}, **others)
    code, out, _ = bench("check", now, "--baseline", baseline)
    assert code == 3
    assert out.count(said) == 3


def test_planners_that_came_and_went_are_noted(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    now = stored(tmp_path / "now", {"fmm": N, "eitstar": 0})
    code, out, _ = bench("check", now, "--baseline", baseline)
    assert code == 0
    assert "`eitstar` in `c3d`: not in the baseline yet" in out
    assert "`rrtstar` in `c3d`: not compared, as this run lacks it" in out
    code, out, _ = bench("check", now, "--baseline", baseline, "--update")
    assert code == 0
    assert "`eitstar` in `c3d`: none → 0 of 20 solved" in out
    assert ", time_limit_s=5.0 → none" not in out
    assert [line.rsplit(" → ", 1)[-1] for line in out.splitlines() if "`rrtstar`" in line] == [
        "none"
    ]
    assert [line.split(",")[2] for line in baseline.read_text().splitlines()] == [
        *("planner", "eitstar", "fmm")
    ], "sorted, and all of the run"


def test_what_could_not_fail_does_not_pass(bench: Cli, tmp_path: Path) -> None:
    """As the first attempts of an interrupted run, or a baseline of too few."""
    file, run = tmp_path / "b.csv", stored(tmp_path / "run", {"fmm": 2}, n=2)
    assert bench("check", run, "--baseline", file, "--update")[0] == 0
    code, out, _ = bench("check", stored(tmp_path / "now", {"fmm": 0}, n=2), "--baseline", file)
    assert code == 3
    assert out.startswith("## Cannot tell: no outcome would have been a regression\n")


def test_a_run_that_is_not_whole_does_not_pass(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    now = stored(tmp_path / "now", absent=("prmstar",))
    code, out, _ = bench("check", now, "--baseline", baseline)
    assert code == 3
    assert out.startswith(
        "## Cannot tell yet. Incomplete: 40 of 60 attempts were made, none by prmstar in c3d; "
    )
    worse = stored(tmp_path / "worse", {**SOLVED, "fmm": 5}, absent=("prmstar",))
    code, out, _ = bench("check", worse, "--baseline", baseline)
    assert code == 1, "what is worse already stays so"
    assert out.startswith("## Regression: 1 of 2 tests\n")
    assert "Incomplete: 40 of 60" in out
    assert "Incomplete: 40 of 60" in bench("check", now, "--baseline", baseline, "--update")[2]


def test_too_few_problems_are_called_so(bench: Cli, tmp_path: Path, baseline: Path) -> None:
    text = baseline.read_text().replace(",20,20,", ",2,2,").splitlines()
    columns = slice(0, 8)
    short = "\n".join(",".join(line.split(",")[columns]) for line in text)
    baseline.write_text(short + "\n")
    code, out, _ = bench("check", stored(tmp_path / "now"), "--baseline", baseline)
    assert code == 0
    assert out.count("| cannot tell") == 2
    assert "take more problems, or a larger --alpha" in out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--alpha", "0"], "--alpha 0"),
        (["--alpha", "1"], "--alpha 1"),
        (["--alpha", "nan"], "--alpha nan"),
        (["--tolerance", "-1"], "--tolerance -1"),
        (["--tolerance", "inf"], "--tolerance inf"),
        (["--ratios", "lenght", "--reference", "fmm"], "did you mean 'length'?"),
        (["--ratios", "", "--reference", "fmm"], "--ratios: unknown ''"),
        (["--ratios", "time"], "name with --reference"),
        (["--reference", "fmm"], "name with --ratios"),
        (["--ratios", "time", "--reference", "fmn"], "has no 'fmn'; did you mean 'fmm'?"),
        (["--ratios", "time", "--reference", "lazyprmstar"], "did you mean 'prmstar'"),
        (["--updat"], "did you mean '--update'"),
        (["--out", "no/comment.md"], "cannot write"),
    ],
)
def test_bad_options(
    options: list[str], said: str, refused: Refused, tmp_path: Path, baseline: Path
) -> None:
    assert said in refused("check", stored(tmp_path / "now"), "--baseline", baseline, *options)


def test_a_baseline_without_what_is_wanted(bench: Cli, refused: Refused, tmp_path: Path) -> None:
    """As older programs wrote it."""
    run, file = stored(tmp_path / "now"), tmp_path / "b.csv"
    assert bench("check", run, "--baseline", file, "--update")[0] == 0
    lines = [line.split(",") for line in file.read_text().splitlines()]
    kept = [i for i, name in enumerate(lines[0]) if name not in ("outcomes", "margin", "time")]
    file.write_text("".join(",".join(cells[i] for i in kept) + "\n" for cells in lines))
    said = refused("check", run, "--baseline", file, *RATIOS)
    assert "holds no margin, time; write it with --update --ratios length,margin,time" in said


def test_a_reference_that_the_baseline_lacks(bench: Cli, refused: Refused, tmp_path: Path) -> None:
    run, file = stored(tmp_path / "now", {"rrtstar": N, "prmstar": N}), tmp_path / "b.csv"
    assert bench("check", run, "--baseline", file, "--update", "--ratios", "length")[0] == 0
    later = stored(tmp_path / "later")
    said = refused("check", later, "--baseline", file, "--ratios", "length", "--reference", "fmm")
    assert f"--reference: {file} has no 'fmm'" in said


def test_no_baseline_and_no_run(refused: Refused, bench: Cli, tmp_path: Path) -> None:
    run = stored(tmp_path / "now")
    said = refused("check", run, "--baseline", tmp_path / "none.csv")
    assert "there is no" in said
    assert "--update writes it" in said
    code, _, err = bench("check", tmp_path / "nowhere", "--baseline", tmp_path / "none.csv")
    assert code == 2
    assert "holds no run.sqlite" in err


def test_an_update_spares_what_is_not_a_baseline(refused: Refused, tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    file.write_text("name,value\nimportant,1\n")
    said = refused("check", stored(tmp_path / "now"), "--baseline", file, "--update")
    assert "is not a baseline" in said
    assert file.read_text() == "name,value\nimportant,1\n"


def test_reading_a_baseline_leaves_the_limit_of_other_files(tmp_path: Path) -> None:
    before, file = csv.field_size_limit(), tmp_path / "baseline.csv"
    file.write_text("x" * (before + 10))
    with pytest.raises(InputError):
        regression.read(file)
    assert csv.field_size_limit() == before
