"""Motion in coordinates and momenta: Hamilton's equations as compiled functions that any integrator takes."""
