"""Where `ffrobot` and `python -m ffrobot` begin: signals are answered before anything else is loaded."""

import gc
import os
import signal

from .common.interrupts import SIGNALS, EndOfCommand

OBJECTS_BETWEEN_COLLECTIONS = 500_000
"""More than a start makes, all of which stay: looking for cycles among them took an eighth of its time."""


def main() -> None:
    """Run the command line."""
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it looks into every installed package for them
    for number in SIGNALS:
        signal.signal(number, EndOfCommand())
    from .cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
