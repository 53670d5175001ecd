"""Whether a path is valid, by the judge, and how good it is, by the metrics."""

METRIC_GROUP = "bench.metrics"
"""Of entry points under which packages announce metrics; each loads to a `Metric`."""
