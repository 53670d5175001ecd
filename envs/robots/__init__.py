"""Moving bodies."""
