"""Statistics of attempts: intervals, paired comparisons, curves over time.

Nothing here draws from a global random state, and no failure is dropped or counted as zero.
"""

from bench.analysis.statistics.curves import (
    Improvement,
    SolvedByTime,
    censored_median,
    improvement,
    solved_by_time,
)
from bench.analysis.statistics.effects import (
    DIFFERENCE,
    RATIO,
    Effect,
    discordant_share,
    hodges_lehmann,
    paired_effect,
    shift_interval,
)
from bench.analysis.statistics.hypotheses import (
    McNemar,
    SignedRank,
    changed_outcomes,
    holm,
    mcnemar,
    paired_drop,
    signed_rank,
    success_drop,
)
from bench.analysis.statistics.intervals import (
    clopper_pearson_interval,
    clustered_wilson_interval,
    difference_interval,
    median_ranks,
    wilson_band,
    wilson_interval,
)

__all__ = [
    "DIFFERENCE",
    "RATIO",
    "Effect",
    "Improvement",
    "McNemar",
    "SignedRank",
    "SolvedByTime",
    "censored_median",
    "changed_outcomes",
    "clopper_pearson_interval",
    "clustered_wilson_interval",
    "difference_interval",
    "discordant_share",
    "hodges_lehmann",
    "holm",
    "improvement",
    "mcnemar",
    "median_ranks",
    "paired_drop",
    "paired_effect",
    "shift_interval",
    "signed_rank",
    "solved_by_time",
    "success_drop",
    "wilson_band",
    "wilson_interval",
]
