"""Bodies cut free at an instant: every force on each as an arrow, by the letter that the equations have for it."""
