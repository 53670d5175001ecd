"""The planners of OMPL behind our contract."""
