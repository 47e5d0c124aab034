"""What a run leaves: samples, integrals, remarks, plots."""
