"""What is asked under `ask`: values now and later, extremes, for which value something happens."""
