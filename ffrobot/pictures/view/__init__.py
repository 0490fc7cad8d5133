"""Three-dimensional output for ParaView and PyVista: `ffrobot view`."""

from .view import Options, Viewed, view_file, view_movie

__all__ = ["Options", "Viewed", "view_file", "view_movie"]
