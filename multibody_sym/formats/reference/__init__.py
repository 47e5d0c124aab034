"""What may stand in a model file, told from its declarations: key by key for people, as a JSON Schema for editors."""
