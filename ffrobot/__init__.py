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

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .api import (
        load_scene,
        make_link,
        plot_results,
        read_modal_body,
        solve,
        view_file,
        write_movie,
        write_report,
        write_study,
    )
    from .common.errors import FfrobotError, FfrobotWarning, InputError, SolveError
    from .design.front import trade_off
    from .design.optimise import optimise
    from .design.screening import screening
    from .design.sensitivity import sensitivity
    from .design.uncertainty import uncertainty
    from .fe_models.modal_body import ModalBody
    from .fit.fitting import fit_measured
    from .results.file import Results
    from .run.watcher import Watcher
    from .scene.load import make_scene
    from .scene.scene import Scene

    __version__: str

_HOME = {
    "fit_measured": ".fit.fitting",
    "load_scene": ".api",
    "make_link": ".api",
    "optimise": ".design.optimise",
    "plot_results": ".api",
    "read_modal_body": ".api",
    "screening": ".design.screening",
    "sensitivity": ".design.sensitivity",
    "solve": ".api",
    "trade_off": ".design.front",
    "uncertainty": ".design.uncertainty",
    "view_file": ".api",
    "write_movie": ".api",
    "write_report": ".api",
    "write_study": ".api",
    "FfrobotError": ".common.errors",
    "FfrobotWarning": ".common.errors",
    "InputError": ".common.errors",
    "SolveError": ".common.errors",
    "ModalBody": ".fe_models.modal_body",
    "make_scene": ".scene.load",
    "Scene": ".scene.scene",
    "Results": ".results.file",
    "Watcher": ".run.watcher",
}

__all__ = [
    "FfrobotError",
    "FfrobotWarning",
    "InputError",
    "ModalBody",
    "Results",
    "Scene",
    "SolveError",
    "Watcher",
    "fit_measured",
    "load_scene",
    "make_link",
    "make_scene",
    "optimise",
    "plot_results",
    "read_modal_body",
    "screening",
    "sensitivity",
    "solve",
    "trade_off",
    "uncertainty",
    "view_file",
    "write_movie",
    "write_report",
    "write_study",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from .common.version import program_version

        value: object = program_version()
    elif name in _HOME:
        value = getattr(import_module(_HOME[name], __name__), name)
    else:
        raise AttributeError(f"module 'ffrobot' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, "__version__"])
