"""The command line of unlift: `python -m unlift`, and the program `unlift` that pip installs."""

import signal
import sys

from . import _unlift


def main() -> int:
    """Run the command line and return the exit code."""
    # Ctrl-C ends the program at once; Python would wait for its end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _unlift.command_line(["unlift", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
