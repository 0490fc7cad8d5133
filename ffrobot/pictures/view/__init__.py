"""Three-dimensional output for ParaView and PyVista: `ffrobot view`."""

from .movie import view_movie
from .view import Options, Viewed, view_file

__all__ = ["Options", "Viewed", "view_file", "view_movie"]
