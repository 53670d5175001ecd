"""Records to tables and pictures; never writes records."""
