"""The command line: `multibody-sym COMMAND ...`, one file a command."""

from multibody_sym.cli.main import main as main
