"""Keys of link files of beams and solids, as tests of all parts write them, and their modal bodies."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ffrobot.fe_models.link import cached_modal_body
from ffrobot.fe_models.link_source import LinkTable


def rectangle(height, width):
    return {"shape": "rectangle", "height": height, "width": width}


def tube(outer, inner):
    return {"shape": "tube", "outer": outer, "inner": inner}


def circle(diameter):
    return {"shape": "circle", "diameter": diameter}


def beam_link(length, section, elements, **keys):
    """Of so many elements; the rest as for `link_keys`."""
    return link_keys("beam", length, section, {"elements": elements}, **keys)


def solid_link(length, section, mesh, *, hole=None, **keys):
    """Of a mesh table, with holes or without; the rest as for `link_keys`."""
    found = link_keys("solid", length, section, mesh, **keys)
    return found if hole is None else found | {"geometry": found["geometry"] | {"hole": hole}}


def link_keys(kind, length, section, mesh, *, E=70e9, nu=0.33, rho=2700.0, condition="cantilever", **keys):
    """Of aluminum unless said otherwise; `nu`, `condition`: None leaves the key out; `keys` are those of the file."""
    material = {"youngs_modulus": E, "density": rho} | ({} if nu is None else {"poissons_ratio": nu})
    found = {"material": material, "geometry": {"kind": kind, "length": length, "section": section}, "mesh": mesh}
    if condition is not None:
        found["reference"] = {"condition": condition}
    return found | keys


def paper_link(condition="cantilever", count=10, family="in-plane-bending", *, attachment_modes=False, **keys):
    """A steel link of the paper's manipulator, 1 m long."""
    modes = {"count": count, "family": family, "attachment_modes": attachment_modes}
    section = rectangle(0.015, 0.025)
    return beam_link(1.0, section, 20, E=2.068427e11, nu=0.3, rho=7850.0, condition=condition, modes=modes) | keys


def modal_body(keys):
    """By stage 1, of the keys of a link file."""
    return cached_modal_body(LinkTable({"name": "link"} | keys, Path("link.toml"))).body


def flexibility(body, name, other=None):
    """(6, 6) displacement and rotation of an interface under unit force and moment at another one, or there."""
    at, load = body.interfaces[name], body.interfaces[other or name]
    return at.motion / np.diag(body.stiffness) @ load.motion.T


def moved(body, place):
    """The modal body with its points, but not its integrals, at `place(x)` in place of x (…, 3), m."""
    parts = {"stations": body.stations} | body.interfaces
    at = {name: replace(part, position=place(part.position)) for name, part in parts.items()}
    return replace(body, stations=at.pop("stations"), interfaces=at)
