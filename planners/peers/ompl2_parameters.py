"""The parameters of OMPL 2's planners by OMPL's names, as OMPL 1.7 has them.

The binding does not have OMPL's own list of them, and the process that first reads what a user
writes has not OMPL 2: so they are written down here, with the methods that set them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from planners.ompl_common.parameter_text import count, flag, number, refused, unknown


def _share(text: str) -> str | None:
    read = number(text)
    return read if read is not None and float(read) <= 1 else None


def _positive(text: str) -> str | None:
    read = number(text)
    return read if read is not None and float(read) > 0 else None


_Kind = tuple[Callable[[str], "str | None"], Callable[[str], Any]]
_FLAG: _Kind = (flag, lambda text: text == "1")
_COUNT: _Kind = (count, int)
_NUMBER: _Kind = (number, float)
_SHARE: _Kind = (_share, float)
_POSITIVE: _Kind = (_positive, float)

_ALL: dict[str, tuple[str, _Kind]] = {
    "cache_cc": ("setCacheCC", _FLAG),
    "delay_collision_checking": ("setDelayCC", _FLAG),
    "delay_rewiring_to_first_solution": ("setDelayRewiringUntilInitialSolution", _FLAG),
    "drop_unconnected_samples_on_prune": ("setDropSamplesOnPrune", _FLAG),
    "extended_fmt": ("setExtendedFMT", _FLAG),
    "find_approximate_solutions": ("setConsiderApproximateSolutions", _FLAG),
    "focus_search": ("setFocusSearch", _FLAG),
    "goal_bias": ("setGoalBias", _NUMBER),
    "heuristics": ("setHeuristics", _FLAG),
    "informed_sampling": ("setInformedSampling", _FLAG),
    "intermediate_states": ("setIntermediateStates", _FLAG),
    "nearest_k": ("setNearestK", _FLAG),
    "new_state_rejection": ("setNewStateRejection", _FLAG),
    "num_samples": ("setNumSamples", _COUNT),
    "number_sampling_attempts": ("setNumSamplingAttempts", _COUNT),
    "ordered_sampling": ("setOrderedSampling", _FLAG),
    "ordering_batch_size": ("setBatchSize", _COUNT),
    "prune_threshold": ("setPruneThreshold", _NUMBER),
    "prune_threshold_as_fractional_cost_change": ("setPruneThresholdFraction", _SHARE),
    "pruned_measure": ("setPrunedMeasure", _FLAG),
    "radius_multiplier": ("setRadiusMultiplier", _POSITIVE),
    "range": ("setRange", _NUMBER),
    "rewire_factor": ("setRewireFactor", _POSITIVE),
    "sample_rejection": ("setSampleRejection", _FLAG),
    "samples_per_batch": ("setSamplesPerBatch", _COUNT),
    "stop_on_each_solution_improvement": ("setStopOnSolnImprovement", _FLAG),
    "tree_pruning": ("setTreePruning", _FLAG),
    "use_admissible_heuristic": ("setAdmissibleCostToCome", _FLAG),
    "use_graph_pruning": ("setPruning", _FLAG),
    "use_just_in_time_sampling": ("setJustInTimeSampling", _FLAG),
    "use_strict_queue_ordering": ("setStrictQueueOrdering", _FLAG),
}

_OF_INFORMED = (
    "delay_collision_checking goal_bias number_sampling_attempts ordered_sampling "
    "ordering_batch_size prune_threshold range rewire_factor use_k_nearest"
)

_NAMES = {
    "RRTConnect": "intermediate_states range",
    "RRTstar": f"{_OF_INFORMED} focus_search informed_sampling new_state_rejection pruned_measure "
    "sample_rejection tree_pruning use_admissible_heuristic",
    "InformedRRTstar": _OF_INFORMED,
    "AORRTC": "range",
    "PRMstar": "",
    "BITstar": "delay_rewiring_to_first_solution drop_unconnected_samples_on_prune "
    "find_approximate_solutions prune_threshold_as_fractional_cost_change rewire_factor "
    "samples_per_batch stop_on_each_solution_improvement use_graph_pruning "
    "use_just_in_time_sampling use_k_nearest use_strict_queue_ordering",
    "FMT": "cache_cc extended_fmt heuristics num_samples radius_multiplier use_k_nearest",
    "BFMT": "cache_cc extended_fmt heuristics nearest_k num_samples radius_multiplier",
}
"""Those of each algorithm."""

_NEAREST = {"BITstar": "setUseKNearest", "FMT": "setNearestK"}
_NEAREST_OTHERS = "setKNearest"
"""What sets `use_k_nearest`, which has a name of its own in each."""


def parameters_of(algorithm: str) -> dict[str, tuple[str, _Kind]]:
    """The method that sets each parameter of an algorithm, and how its text is read."""
    nearest = _NEAREST.get(algorithm, _NEAREST_OTHERS), _FLAG
    return {
        name: nearest if name == "use_k_nearest" else _ALL[name]
        for name in sorted(_NAMES[algorithm].split())
    }


def setters(algorithm: str, chosen: Mapping[str, str], own: Sequence[str]) -> list[tuple[str, Any]]:
    """The methods of a planner that set parameters, and what each is called with: true, false, 1 or
    0 for a flag, and for others finite numbers of at least 0, whole ones where it counts something.

    Args:
        algorithm: the planner's class in `ompl.geometric`.
        own: names that are ours, for suggestions.

    Raises:
        InputError: a name is unknown, or a value is none of these.
    """
    known = parameters_of(algorithm)
    found = []
    for name, text in chosen.items():
        if name not in known:
            raise unknown(algorithm, name, [*known, *own])
        setter, (read, made) = known[name]
        value = read(text)
        if value is None:
            raise refused(algorithm, name, text)
        found.append((setter, made(value)))
    return found
