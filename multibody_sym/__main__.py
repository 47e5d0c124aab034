"""`python -m multibody_sym`: the command line, with the working folder taken off the module search path first."""

import sys

if not sys.flags.safe_path:
    del sys.path[0]

from multibody_sym.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
