"""Patches on links of planar scenes: the bodies, layouts and arrays that a solve makes of them."""

from pathlib import Path

import numpy as np

from ffrobot.actuation.patches.composite import patched_body
from ffrobot.actuation.patches.link_patches import link_patches, placed_patches
from ffrobot.actuation.patches.records import PztLayout
from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.model.projection import projected

SCENE = Path("scene.toml")
CERAMIC = {"length": 0.05, "width": 0.025, "thickness": 0.75e-3, "modulus": 63e9, "d31": 110e-12}


def planar_body(body, name="link"):
    """The modes of a link that move in the plane."""
    return projected(from_modal_body(name, body, is_planar=True))


def patched(body, *layouts, bare=None):
    """The link, in 3D unless `bare` is given, with mass and stiffness of its patches."""
    bare = from_modal_body("link", body) if bare is None else bare
    return patched_body(bare, body, placed_patches(layouts, body))


def layout(body="link", **keys):
    places = {} if keys.keys() & {"count", "centers"} else {"count": 10}
    return PztLayout(body=body, **({"structural": False} | CERAMIC | places | keys))


def on_link(body, planar=None, **keys):
    """All patches of one layout on the link, `planar` with payloads or with fewer modes."""
    return link_patches([layout(**keys)], body, planar_body(body) if planar is None else planar)


def patches(body, planar=None, **keys):
    """The same, on the modes that they reach."""
    return on_link(body, planar, **keys).arrays["link"]


def bent(planar, of_link, voltage):
    """Modal coordinates under voltages (k,), statically."""
    return planar.modal_transform.T @ of_link.Phi_V @ voltage / planar.stiffness


def modes_in_the_plane(body):
    """Numbers of the modes of a modal body that move in the plane."""
    return np.flatnonzero(planar_body(body).modal_transform.any(axis=1))
