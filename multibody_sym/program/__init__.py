"""Programs: straight-line calculations as data, with their verifier, interpreter, derivatives and measures."""
