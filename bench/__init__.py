"""How planners are measured: isolated runs, an independent judge, a store, reports."""
