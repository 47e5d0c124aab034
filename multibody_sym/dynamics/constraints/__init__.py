"""Whether rows hold, depend on each other, or contradict each other."""
