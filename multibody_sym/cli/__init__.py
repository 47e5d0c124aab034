"""The command line: `multibody-sym COMMAND ...`, one file a command."""
