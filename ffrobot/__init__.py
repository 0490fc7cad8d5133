"""ffrobot: what motors and piezoelectric patches must do so that a flexible robot follows its path.

One way for data: mesh → fe_models → modal body → mbs → actuation → results → pictures.

From Python, everything the command line does takes a line each:

    body = ffrobot.make_link("arm.toml").body      # stage 1: ffrobot link
    results = ffrobot.solve("scene.toml")          # stage 2: ffrobot solve
    results["inverse/joints/shoulder/moment"]      # (T,) N·m
    ffrobot.plot_results("scene.results.h5", "figures")
    ffrobot.write_report(["scene.results.h5"], "report.html")

Names are loaded when they are first used: importing the package costs a few milliseconds.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .api import plot_results, solve, view_file, write_movie, write_report, write_study
    from .common.errors import FfrobotError, FfrobotWarning, InputError, SolveError
    from .design.studies import optimise, sensitivity, trade_off, uncertainty
    from .fe_models.link import make_link
    from .fe_models.modal_body import ModalBody
    from .fe_models.modal_body_file import read_modal_body
    from .fit.fitting import fit_measured
    from .fit.frf import fit_responses
    from .results.file import Results
    from .run.watcher import Watcher
    from .scene.load import load_scene, make_scene
    from .scene.scene import Scene
    from .smooth.smoothing import smooth_motion

    __version__: str

_NAMES = {
    ".api": ("plot_results", "solve", "view_file", "write_movie", "write_report", "write_study"),
    ".common.errors": ("FfrobotError", "FfrobotWarning", "InputError", "SolveError"),
    ".fe_models.link": ("make_link",),
    ".fe_models.modal_body": ("ModalBody",),
    ".fe_models.modal_body_file": ("read_modal_body",),
    ".fit.fitting": ("fit_measured",),
    ".fit.frf": ("fit_responses",),
    ".results.file": ("Results",),
    ".run.watcher": ("Watcher",),
    ".scene.load": ("load_scene", "make_scene"),
    ".scene.scene": ("Scene",),
    ".smooth.smoothing": ("smooth_motion",),
    ".design.studies": ("optimise", "sensitivity", "trade_off", "uncertainty"),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "FfrobotError", "FfrobotWarning", "InputError", "ModalBody", "Results", "Scene", "SolveError", "Watcher",
    "fit_measured", "fit_responses", "load_scene", "make_link", "make_scene", "optimise", "plot_results",
    "read_modal_body", "sensitivity", "smooth_motion", "solve", "trade_off", "uncertainty", "view_file", "write_movie",
    "write_report", "write_study",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name == "__version__":
        from .common.version import VERSION

        value: object = VERSION
    elif name in _HOME:
        value = getattr(import_module(_HOME[name], __name__), name)
    else:
        raise AttributeError(f"module 'ffrobot' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, "__version__"])
