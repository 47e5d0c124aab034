"""How things look: one file a kind of mark."""
