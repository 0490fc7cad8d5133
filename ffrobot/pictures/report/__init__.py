"""A self-contained HTML page about one results file, or several side by side: `ffrobot report`."""

from .page import write_report

__all__ = ["write_report"]
