"""Whether a path is valid, by the judge, and how good it is, by the metrics."""
