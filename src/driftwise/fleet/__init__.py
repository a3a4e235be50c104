"""Ten thousand plants: one row of numbers for each, found by its key."""
