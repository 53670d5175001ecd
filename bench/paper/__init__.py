"""The paper's experiments, carried out and set beside its figures.

What they are is data: `results/paper/*.toml`, with the paper's own figures in `*.csv` beside them.
"""
