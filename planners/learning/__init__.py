"""What all learned planners share: weights, data, training."""
