"""Running planners: what is asked for, worker processes, the clock, and training before a run."""
