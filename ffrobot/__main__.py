"""Where `ffrobot` and `python -m ffrobot` begin: signals are answered before anything else is loaded."""

import signal
import sys

from .common.interrupts import SIGNALS, EndOfCommand, end_process


def main() -> None:
    """Run the command line."""
    for number in SIGNALS:
        signal.signal(number, EndOfCommand())
    from .cli import main as command_line

    code = 0
    try:
        command_line()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    if "mpi4py.MPI" in sys.modules:  # which ends with the interpreter
        sys.exit(code)
    end_process(code)


if __name__ == "__main__":
    main()
