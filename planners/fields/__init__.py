"""Neural solvers of the Eikonal equation between any two configurations."""
