"""Errors that a user can mend."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.errors import InputError, input_error_of, suggestion


def test_the_systems_errors_are_told_in_words(tmp_path: Path) -> None:
    file = tmp_path / "no" / "report.md"
    with pytest.raises(InputError) as caught, input_error_of(f"cannot write {file}"):
        file.write_text("")
    assert str(caught.value) == f"cannot write {file}: No such file or directory"
    assert isinstance(caught.value.__cause__, FileNotFoundError)


def test_a_file_that_is_not_named_yet_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught, input_error_of("cannot write the report"):
        (tmp_path / "no" / "report.md").write_text("")
    expected = f"cannot write the report: No such file or directory: {tmp_path}/no/report.md"
    assert str(caught.value) == expected


def test_an_error_without_a_number_says_what_it_says() -> None:
    with pytest.raises(InputError, match=r"^cannot write x: the disk is gone$"):  # noqa: SIM117
        with input_error_of("cannot write x"):
            raise OSError("the disk is gone")


def test_other_errors_that_mean_the_same_are_named_with_their_type() -> None:
    with pytest.raises(InputError, match=r"^cannot write x: RuntimeError: file write failed$"):  # noqa: SIM117
        with input_error_of("cannot write x", RuntimeError):
            raise RuntimeError("file write\nfailed")


@pytest.mark.parametrize("error", [ValueError("no"), InputError("no"), KeyError("no")])
def test_all_else_goes_through(error: Exception) -> None:
    with pytest.raises(type(error)) as caught, input_error_of("cannot write x", RuntimeError):
        raise error
    assert caught.value is error


@given(st.sampled_from(sorted(errno.errorcode)), st.text(max_size=20))
def test_whatever_it_quotes_it_is_one_line_that_prints(number: int, name: str) -> None:
    with pytest.raises(InputError) as caught, input_error_of("cannot read it"):
        raise OSError(number, "said so", name)
    assert str(caught.value).startswith("cannot read it: said so")
    assert str(caught.value).isprintable()


def test_what_goes_well_is_not_touched() -> None:
    with input_error_of("cannot count", RuntimeError):
        count = 1 + 1
    assert count == 2


def test_a_suggestion_takes_whatever_came_from_outside() -> None:
    """A key of YAML may be a number of more digits than Python writes."""
    assert suggestion("boks", ["box", "hull"]) == "did you mean 'box'?"
    assert suggestion(16**5000, ["box", "hull"]) == "choose from: box, hull"
    assert suggestion([1], ["box", "hull"]) == "choose from: box, hull"
