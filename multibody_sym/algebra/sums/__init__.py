"""How sums of products are written: terms that share a factor together, complete squares, sums inside sums."""
