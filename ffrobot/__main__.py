"""Where `ffrobot` and `python -m ffrobot` begin: signals are answered before anything else is loaded."""

import signal
import sys

from .common.interrupts import SIGNALS, EndOfCommand, end_process


def main() -> None:
    """Run the command line."""
    for number in SIGNALS:
        signal.signal(number, EndOfCommand())
    from .cli import main as command_line

    command_line()
    if "mpi4py.MPI" not in sys.modules:  # which ends with the interpreter
        end_process(0)


if __name__ == "__main__":
    main()
