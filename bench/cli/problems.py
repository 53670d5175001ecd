"""`bench problems`: which problems can be solved as they are posed, by the judge."""

from __future__ import annotations

import json
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from tqdm.auto import tqdm

import envs
from bench.cli.terminal import note, tell, tell_tables
from bench.execution.problem_choice import ProblemChoice
from bench.judging.problem_facts import BLOCKED, ProblemFacts, problem_facts
from bench.report import markdown
from bench.storage import problem_file
from envs import InputError

Census = Mapping[str, ProblemFacts]
"""By the ids of environments."""


def problems(chosen: SimpleNamespace) -> int:
    """`bench problems`."""
    choice = ProblemChoice.checked(chosen.problems, chosen.seed, chosen.problem_file)
    entries = envs.REGISTRY.entries(chosen.env)
    if chosen.out is not None and len(entries) > 1:
        raise InputError("--out is for the problems of one environment; name one")
    census = {}
    for entry in tqdm(entries, unit="set", disable=None, leave=False):
        env = entry.make()
        asked = choice.of(env)
        if chosen.out is not None:
            problem_file.write(asked, chosen.out)
            note(str(chosen.out))
        census[entry.id] = problem_facts(env, asked)
    if chosen.json:
        tell(json.dumps([_data(id, facts) for id, facts in census.items()], indent=2))
    else:
        tell_tables(_text(census), wide=chosen.wide)
    return 0


def _data(id: str, facts: ProblemFacts) -> dict[str, Any]:
    count, invalid = len(facts.straight_lines), len(facts.invalid)
    return {
        "env": id,
        "problems": count,
        "valid": count - invalid,
        "invalid": [end.data() for end in facts.invalid_ends],
    }


def _text(census: Census) -> str:
    """A table of how many are valid, and a line for each end that is not."""
    rows = [
        {
            "env": id,
            "problems": str(len(facts.straight_lines)),
            "valid": str(len(facts.straight_lines) - len(facts.invalid)),
            "blocked straight lines": str(facts.straight_lines.count(BLOCKED)),
        }
        for id, facts in census.items()
    ]
    parts = [markdown.table(rows), *(_reasons(id, facts) for id, facts in census.items())]
    return "\n\n".join(filter(None, parts))


def _reasons(id: str, facts: ProblemFacts) -> str:
    lines = [f"- {end.index} {end}" for end in facts.invalid_ends]
    return "\n".join([f"Invalid as posed in {id}:", "", *lines]) if lines else ""
