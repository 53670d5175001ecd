"""Baselines as files: what was written is read, and nothing else is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from records import recorded, row

from bench.analysis.regression import Baseline, read, write
from envs import InputError

HEADER = "version,env,planner,fingerprint,seed,settings,problems,solved,time"
GOOD = "1,c3d,fmm,f,0,jobs=1,3,2,0.1 - 0.25"


def made() -> Baseline:
    rows = [
        row("rrtstar:range=2,goal_bias=0.1", 0, "VALID", solve_s=1 / 3, length=1e6 / 7),
        row("rrtstar:range=2,goal_bias=0.1", 1, "TIMEOUT"),
        row("rrtstar:range=2,goal_bias=0.1", 2, "VALID", solve_s=2e-7, length=float("inf")),
        row("fmm", 0, "COLLISION", solve_s=1.0, length=1.0),
    ]
    return Baseline.of(recorded(rows))


def test_it_is_read_as_it_was_written(tmp_path: Path) -> None:
    file = tmp_path / "made" / "b.csv"
    write(made(), file)
    again = read(file)
    assert again.measures == ("length", "margin", "time"), "in their own order"
    assert list(again.rows) == [("c3d", "fmm"), ("c3d", "rrtstar:range=2,goal_bias=0.1")]
    for key, old in made().rows.items():
        new = again.rows[key]
        for name in again.measures:
            np.testing.assert_array_equal(new.values[name], old.values[name])
        assert {**vars(new), "values": 0} == {**vars(old), "values": 0}
    text = file.read_text()
    write(again, file)
    assert file.read_text() == text
    assert text.count("\n") == 3
    assert "142900 - -" in text, "four digits, and none of what is endless"


def test_many_problems_are_read_as_well(tmp_path: Path) -> None:
    count = 30_000
    file = tmp_path / "b.csv"
    file.write_text(f"{HEADER}\n1,c3d,fmm,f,0,s,{count},{count},{'0.12345 ' * count}\n")
    [row] = read(file).rows.values()
    assert row.values["time"].shape == (count,)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is not a baseline"),
        ("env,planner\nc3d,fmm\n", "is not a baseline"),
        (HEADER + "\n", "has no rows"),
        (f"{HEADER}\n{GOOD.replace('1,', '2,', 1)}", "line 2: version '2', this program reads 1"),
        (f"{HEADER.replace('solved', 'solvd')}\n{GOOD}", "'solvd'; did you mean 'solved'?"),
        (f"{HEADER},extra\n{GOOD},1", "unknown column 'extra'"),
        (f"{HEADER.replace(',seed', '')}\n{GOOD.replace(',0,', ',')}", "baseline without seed"),
        (f"{HEADER},time\n{GOOD},0.1", "with a column twice"),
        (f"{HEADER}\n{GOOD},1", "line 2: 10 cells in 9 columns"),
        (f"{HEADER}\n{GOOD[:-13]}", "line 2: 7 cells in 9 columns"),
        (f"{HEADER}\n{GOOD}\n{GOOD}", "line 3: a second row of 'fmm' in 'c3d'"),
        (f"{HEADER}\n{GOOD.replace('3,2', '3,4')}", "line 2: 4 solved of 3 problems"),
        (f"{HEADER}\n{GOOD.replace('3,2', '0,0')}", "line 2: 0 solved of 0 problems"),
        (f"{HEADER}\n{GOOD.replace('3,2', '3,-2')}", "solved is '-2', not a count"),
        (f"{HEADER}\n{GOOD.replace('3,2', '3,2.0')}", "solved is '2.0', not a count"),
        (f"{HEADER}\n{GOOD.replace('3,2', '3,1')}", "time has 2 values for 3 problems"),
        (f"{HEADER}\n{GOOD.replace('3,2', '4,2')}", "of 4 were solved"),
        (f"{HEADER}\n{GOOD.replace('0.25', 'nan')}", "time has 'nan'"),
        (f"{HEADER}\n{GOOD.replace('0.25', 'inf')}", "time has 'inf'"),
        (f"{HEADER}\n{GOOD.replace('0.25', '-1')}", "time has '-1'"),
        (f"{HEADER}\n{GOOD.replace('0.25', 'fast')}", "time has 'fast'"),
        (f"{HEADER}\n{GOOD.replace('fmm', ' ')}", "line 2: no planner"),
        (f'{HEADER}\n"{GOOD}', "cannot read"),
    ],
)
def test_what_makes_no_sense_is_refused(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "b.csv"
    file.write_text(text)
    with pytest.raises(InputError) as refusal:
        read(file)
    assert said in str(refusal.value)
    assert str(file) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_files_that_are_no_text_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "b.csv"
    file.write_bytes(b"version\xff\xfe\n")
    with pytest.raises(InputError, match="cannot read"):
        read(file)
    with pytest.raises(InputError, match="cannot read"):
        read(tmp_path)


def test_an_attempt_is_a_letter(tmp_path: Path) -> None:
    """Solved by a path with bends, by the straight line, not solved, not attempted."""
    bent = np.array([[0.0, 0], [1, 1], [2, 0]])
    straight = np.array([[0.0, 0], [1, 0], [2, 0]])
    rows = [
        row("p", 0, "VALID", length=8**0.5, path=bent),
        row("p", 1, "VALID", length=2.0, path=straight),
        row("p", 2, "COLLISION", length=2.0, path=straight),
        row("p", 4, "VALID", length=3.0),
    ]
    found = Baseline.of(recorded(rows)).rows["c3d", "p"]
    assert (found.outcomes, found.problems, found.solved) == ("SLF.S", 4, 3)
    write(Baseline.of(recorded(rows)), tmp_path / "b.csv")
    assert read(tmp_path / "b.csv").rows["c3d", "p"].outcomes == "SLF.S"


@pytest.mark.parametrize(
    ("letters", "said"),
    [
        ("SSX", "outcomes has 'X', which is none of S L F ."),
        ("SSS", "outcomes says 3 solved of 3, not 2 of 3"),
        ("SL", "outcomes says 2 solved of 2, not 2 of 3"),
        ("SL.", "outcomes says 2 solved of 2"),
    ],
)
def test_outcomes_that_do_not_fit_are_refused(letters: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "b.csv"
    file.write_text(f"{HEADER},outcomes\n{GOOD},{letters}\n")
    with pytest.raises(InputError) as refusal:
        read(file)
    assert f"line 2: {said}" in str(refusal.value)
    file.write_text(f"{HEADER},outcomes\n{GOOD},SLF\n")
    assert read(file).rows["c3d", "fmm"].outcomes == "SLF"


@pytest.mark.slow
@settings(max_examples=500, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(
        st.text(),
        st.lists(
            st.lists(st.sampled_from([*HEADER.split(","), *GOOD.split(","), '"', "\0", "9" * 20]))
        ).map(lambda rows: "\n".join([HEADER, *(",".join(cells) for cells in rows)])),
    )
)
def test_any_text_is_a_baseline_or_refused_in_one_line(tmp_path: Path, text: str) -> None:
    file = tmp_path / "b.csv"
    file.write_bytes(text.encode("utf-8", "replace"))
    try:
        found = read(file)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert all(row.solved <= row.problems for row in found.rows.values())


def test_a_write_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    file = tmp_path / "folder" / "b.csv"
    file.mkdir(parents=True)
    with pytest.raises(InputError, match="cannot write"):
        write(made(), file)
    assert [f.name for f in file.parent.iterdir()] == ["b.csv"]
