"""What there is to see of a mechanism, from its declarations alone: shapes, symbols, strands, as data in metres."""
