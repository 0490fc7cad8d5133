"""ffrobot: what motors and piezoelectric patches must do so that a flexible robot follows its path.

One way for data: mesh → fe_models → modal body → mbs → actuation → results → pictures.
"""

from importlib.metadata import version

__version__ = version("ffrobot")
