"""Other programs' planners, each in an interpreter of its own if its packages do not fit ours.

Those of arms are given plain data, and nothing that they import asks for more than NumPy. What they
check is theirs, and so is what they take for valid; the judge decides. OMPL 2's plan in our
environments, with our checks, so its interpreter must have what these need.
"""
