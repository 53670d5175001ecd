"""What the planners of OMPL's two bindings share, which cannot live in one interpreter: checks,
progress, the order of numbers, and how text is read. Nothing here imports OMPL.
"""
