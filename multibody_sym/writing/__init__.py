"""Reports: what people read of derivations, solutions and runs."""
