"""The commands, one file each: HELP, `add_options` and `run`, which turns parsed options into an Answer."""
