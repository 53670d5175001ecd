"""Other programs' planners, each in an interpreter of its own if its packages do not fit ours.

They are given plain data, and nothing here imports more of ours than NumPy can follow. What they
check is theirs, and so is what they take for valid; the judge decides.
"""
