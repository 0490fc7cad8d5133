"""Where `ffrobot` and `python -m ffrobot` begin: signals are answered before anything else is loaded."""

import signal

from .common.interrupts import SIGNALS, EndOfCommand


def main() -> None:
    """Run the command line."""
    for number in SIGNALS:
        signal.signal(number, EndOfCommand())
    from .cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
