"""The program `tongue-fit`, as the wheel installs it: `python -m tongue_fit` is the same."""

import signal
import sys

from ._tongue_fit import run_program


def main() -> int:
    """Runs the program with the words of the command line, and returns its exit status."""
    # The program handles signals itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_program(["tongue-fit", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
