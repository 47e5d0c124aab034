"""Many runs: plan, rows, workers, tables."""
