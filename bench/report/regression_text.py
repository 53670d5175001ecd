"""A check as Markdown that reads well below a change, and what an update changed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.analysis.regression.baseline import Baseline, Row, gated_metrics
from bench.analysis.regression.check import (
    FALL,
    SUCCESS,
    Check,
    RegressionFinding,
    RegressionVerdict,
)
from bench.analysis.regression.significance import TESTS
from bench.report import markdown
from envs import InputError

_UNNOTICEABLE = 5e-4  # changes that print as none


def text(check: Check, folder: Path, file: Path) -> str:
    """A heading with the result, a line for each regression, the table of all tests, what it
    means, and notes on what was not compared."""
    parts = [_heading(check), f"`{folder}` against the baseline `{file}`."]
    reference = check.wanted.reference
    if check.regressions and check.incomplete:
        parts.append(check.incomplete)
    if check.regressions:
        parts.append("\n".join(_line(finding, reference) for finding in check.regressions))
    if check.findings:
        rows = [
            _cells(finding, reference) | {"would notice": _noticed(finding, check.noticed(finding))}
            for finding in check.findings
        ]
        parts += [markdown.table(rows), _meaning(check)]
    if check.notes:
        parts.append("\n".join(f"- {note}." for note in check.notes))
    return "\n\n".join(parts) + "\n"


def changes(before: Baseline | None, now: Baseline, file: Path) -> str:
    """What writing `now` to a file, in place of `before`, changes: a line a row."""
    old = before.rows if before else {}
    lines = []
    for key in sorted({*old, *now.rows}):
        was, is_ = (_summed_up(rows.get(key)) for rows in (old, now.rows))
        told = f"{was} → {is_}" if was != is_ else f"the same, {is_}"
        lines.append(f"- `{key[1]}` in `{key[0]}`: {told}")
    return "\n\n".join([f"## Baseline `{file}` written", "\n".join(lines)]) + "\n"


def write_text(text: str, file: Path) -> None:
    """Writes a text.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {file}: {error}") from error


def _heading(check: Check) -> str:
    if not check.findings:
        return "## Nothing comparable was measured"
    count = len(check.regressions)
    if not count and check.incomplete:
        return f"## Cannot tell yet. {check.incomplete}"
    if check.is_blind:
        return "## Cannot tell: no outcome would have been a regression"
    if not count:
        return "## Pass: no regression"
    return f"## Regression: {count} of {len(check.findings)} tests"


def _line(finding: RegressionFinding, reference: str | None) -> str:
    before, now = _value(finding, finding.before), _value(finding, finding.now)
    return (
        f"- regression: `{finding.planner}` in `{finding.env}`: "
        f"{_what(finding, reference)} from {before} to {now} (p {finding.p_holm:.2g})"
    )


def _what(finding: RegressionFinding, reference: str | None) -> str:
    if finding.what == SUCCESS or reference is None:
        return finding.what
    return f"{finding.what} / {reference}'s"


def _cells(finding: RegressionFinding, reference: str | None) -> dict[str, str]:
    earlier, later = finding.problems
    regression = finding.verdict is RegressionVerdict.REGRESSION
    return {
        "env": f"`{finding.env}`",
        "planner": f"`{finding.planner}`",
        "what": _what(finding, reference),
        "problems": f"{later}" if earlier == later else f"{earlier}, {later}",
        "baseline": _value(finding, finding.before),
        "now": _value(finding, finding.now),
        "change": _change(finding),
        "p": f"{finding.p_holm:.2g}",
        "verdict": f"**{finding.verdict.value}**" if regression else finding.verdict.value,
    }


def _noticed(finding: RegressionFinding, least: float | None) -> str:
    """The least change for the worse that would be a regression; see `Check.noticed`."""
    if least is None:
        return "nothing"
    if finding.test is None:
        return f"{100 * (least - 1):.0f} % worse"
    solved, problems = finding.test.before
    return f"a fall to {solved - round(least)} of {problems} ({finding.test.name})"


def _value(finding: RegressionFinding, value: float) -> str:
    return f"{100 * value:.1f} %" if finding.what == SUCCESS else f"{value:.3g}"


def _change(finding: RegressionFinding) -> str:
    step = finding.now - finding.before
    step = step if finding.what == SUCCESS else step / finding.before
    if abs(step) < _UNNOTICEABLE:
        return "="
    unit = "points" if finding.what == SUCCESS else "%"
    return f"{'↑' if step > 0 else '↓'} {100 * abs(step):.1f} {unit}"


def _meaning(check: Check) -> str:
    wanted = check.wanted
    told = [
        f"A regression is a p, corrected by Holm for all tests here, of at most {wanted.alpha:g}: "
        "noise raises any false alarm with at most this probability.",
        *_tests(check),
    ]
    if wanted.measures:
        worse = ", ".join(
            f"{'less' if gated_metrics()[name].higher_is_better else 'more'} {name}"
            for name in wanted.measures
        )
        told.append(
            f"{_of_measures(wanted.reference)}; worse is {worse}, by more than "
            f"{100 * wanted.tolerance:g} %, by Wilcoxon's signed-rank test of each problem's "
            "change."
        )
    if any(finding.verdict is RegressionVerdict.BLIND for finding in check.findings):
        told.append(
            f"“{RegressionVerdict.BLIND.value}”: with so few problems, or so few solved in the "
            "baseline, no "
            "outcome would have been a regression; take more problems, or a larger --alpha."
        )
    return " ".join(told)


def _tests(check: Check) -> list[str]:
    """How success was tested, and how likely a fall is to be noticed."""
    tested = [finding for finding in check.findings if finding.test is not None]
    told = []
    for name, meaning in TESTS.items():
        powers = [check.power(f) for f in tested if f.test is not None and f.test.name == name]
        if powers:
            least, most = f"{min(powers):.2f}", f"{max(powers):.2f}"
            chance = least if least == most else f"{least} to {most}"
            told.append(
                f"{name}: {meaning}; that {100 * FALL:g} % of what was solved is lost is noticed "
                f"with probability {chance}."
            )
    return told


def _of_measures(reference: str | None) -> str:
    if reference is None:
        return "A measure is the geometric mean of the problems that were solved both times"
    return (
        f"A ratio to `{reference}`'s is the geometric mean of the problems that both solved both "
        "times"
    )


def _summed_up(row: Row | None) -> str:
    """A row as a person would tell it from another."""
    if row is None:
        return "none"
    told = {name: values[np.isfinite(values)] for name, values in row.values.items()}
    medians = [f"{name} {np.median(values):.4g}" for name, values in told.items() if len(values)]
    where = f"fingerprint {row.fingerprint}, seed {row.seed}, {row.settings}"
    return ", ".join([f"{row.solved} of {row.problems} solved", *medians, where])
