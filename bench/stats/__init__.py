"""Statistics of attempts: intervals, paired comparisons, curves over time.

Nothing here draws from a global random state, and no failure is dropped or counted as zero.
"""

from bench.stats.curves import (
    Improvement,
    SolvedByTime,
    censored_median,
    improvement,
    solved_by_time,
)
from bench.stats.difference import difference_interval
from bench.stats.effects import Effect, discordant_share, ratio_of_medians
from bench.stats.hypotheses import (
    McNemar,
    SignedRank,
    holm,
    mcnemar,
    signed_rank,
    success_drop,
)
from bench.stats.intervals import (
    clopper_pearson_interval,
    median_ranks,
    wilson_band,
    wilson_interval,
)

__all__ = [
    "Effect",
    "Improvement",
    "McNemar",
    "SignedRank",
    "SolvedByTime",
    "censored_median",
    "clopper_pearson_interval",
    "difference_interval",
    "discordant_share",
    "holm",
    "improvement",
    "mcnemar",
    "median_ranks",
    "ratio_of_medians",
    "signed_rank",
    "solved_by_time",
    "success_drop",
    "wilson_band",
    "wilson_interval",
]
