"""From records to statements: summaries, comparisons, regressions, statistics."""
