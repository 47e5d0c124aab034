"""Files: model files in YAML, read with the place of every mistake and written back; tables of results."""
