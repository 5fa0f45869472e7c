"""The command line of unlift: `python -m unlift`, and the program `unlift` that pip installs."""

import sys

from . import _unlift


def main() -> int:
    """Run the command line and return the exit code."""
    return _unlift.command_line(_unlift.__file__, ["unlift", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
