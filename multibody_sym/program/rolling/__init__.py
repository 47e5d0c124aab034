"""Long Programs of many like parts as loops: `rolled`."""
