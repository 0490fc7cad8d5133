"""The user's cache: folders for this user alone. What others may write, or have written, is never used.

Others could put code there that runs (compiled forms), or numbers that count (modal bodies, meshes).
"""

import atexit
import os
import shutil
import stat
import tempfile
import warnings
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

from .errors import FfrobotWarning

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def cache_folder(*names: str) -> Path:
    """Return the folder `names` of the user's cache, made where it is missing, or a folder for this process alone.

    The latter where the cache cannot be written, or where others own it or may write to it (`FfrobotWarning`).
    """
    root = user_cache_path("ffrobot")
    places = [root.joinpath(*names[:k]) for k in range(len(names) + 1)]
    try:
        root.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        for place in places:
            place.mkdir(mode=0o700, exist_ok=True)
            if problem := _of_others(place) or (_open_above(place) if place == root else ""):
                _warn(place, problem)
                return own_folder(*names)
            if stat.S_IMODE(place.stat().st_mode) != 0o700:
                place.chmod(0o700)
    except OSError:
        return own_folder(*names)
    return places[-1] if os.access(places[-1], os.W_OK) else own_folder(*names)


@cache
def _warn(place: Path, problem: str) -> None:
    warnings.warn(
        f"{place}: not used as cache, since {problem}: remove it, or set XDG_CACHE_HOME to a folder of your own;"
        " nothing is kept until then",
        FfrobotWarning,
        stacklevel=3,
    )


@cache
def own_folder(*names: str) -> Path:
    """Return this process's temporary folder for `names`, deleted when the process ends."""
    own = tempfile.mkdtemp(prefix=f"ffrobot-{'-'.join(names[:1])}-")
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return Path(own)


def is_own(file: Path) -> bool:
    """Whether `file` exists and belongs to this user, and nobody else may write to it."""
    try:
        return not _of_others(file)
    except OSError:
        return False


def _of_others(path: Path) -> str:
    """Why others can change what is at `path`, links looked at themselves; "" where they cannot. Raises `OSError`."""
    if not hasattr(os, "geteuid"):  # no POSIX system
        return ""
    about = path.stat()
    if {about.st_uid, path.lstat().st_uid} != {os.geteuid()}:
        return "it belongs to another user"
    return "others may write to it" if about.st_mode & OTHERS_WRITE else ""


def _open_above(root: Path) -> str:
    """Why others can put something else in the place of `root`; "" where they cannot."""
    mode = root.parent.stat().st_mode
    is_open = mode & OTHERS_WRITE and not mode & stat.S_ISVTX
    return f"others may write to {root.parent}" if is_open and hasattr(os, "geteuid") else ""
