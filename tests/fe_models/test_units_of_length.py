"""Links drawn at random, in m, mm, µm and km, in kg and kt, in s and h: every number scales with its dimension."""

import copy
import random
import re

import h5py
import numpy as np
import pytest
from beam_links import circle, link_keys, rectangle, solid_link, tube
from datasets import datasets

import ffrobot

# Of a metre, a kilogram, a second in the other unit.
SYSTEMS = {
    "mm": (1e3, 1.0, 1.0),
    "mm, t, s": (1e3, 1e-3, 1.0),
    "µm, mg, ms": (1e6, 1e6, 1e3),
    "km": (1e-3, 1.0, 1.0),
}
# Powers of length, mass and time of each dataset.
DIMENSIONS = {
    r"length|stations/(height|width|middle|outline)|.*position|mesh/points": (1, 0, 0),
    r"mass": (0, 1, 0),
    r"first_moment": (1, 1, 0),
    r"second_moment|invariants/J_spin": (2, 1, 0),
    r"modes/frequency": (0, 0, -1),
    r"modes/stiffness": (0, 0, -2),
    r"modes/(mass|damping_ratio|residual)|invariants/(S_bar_kl|S_spin)": (0, 0, 0),
    r"(stations|mesh)/(element|cells|edges)": (0, 0, 0),
    r"invariants/S_bar": (0, 0.5, 0),
    r"invariants/(I_bar|h_spin)": (1, 0.5, 0),
    r".*translation|mesh/mode_shapes": (0, -0.5, 0),
    r".*rotation": (-1, -0.5, 0),
    r"stations/(EI|out_of_plane_rigidity|torsional_rigidity)": (3, 1, -2),
    r"stations/EA": (1, 1, -2),
    r"geometric_stiffness/t_.": (-1, 0, 0),
    r"geometric_stiffness/(r_|omega_).*": (0, 0, 0),
    r"geometric_stiffness/force/.*": (-1, -1, 0),
    r"geometric_stiffness/moment/.*": (-2, -1, 0),
    r"stress/points/.*/strain": (-1, -0.5, 0),
    r"stress/points/.*/stress": (-2, 0.5, -2),
}
LENGTHS = {"length", "height", "width", "wall", "diameter", "outer", "inner", "until", "position", "size"}


def in_other_units(keys, L, M, T):
    """The tables of a link file in SI units, in units of which L are a metre, M a kilogram, T a second."""
    factors = dict.fromkeys(LENGTHS, L) | {
        "youngs_modulus": M / L / T**2,
        "density": M / L**3,
        "mass": M,
        "inertia": M * L**2,
    }

    def scaled(value, factor):
        return [factor * item for item in value] if isinstance(value, list) else factor * value

    def of_tables(tables):
        for key, value in tables.items():
            if isinstance(value, dict):
                of_tables(value)
            elif key in factors:
                tables[key] = scaled(value, factors[key])
            elif isinstance(value, list) and value and isinstance(value[0], dict):
                for table in value:
                    of_tables(table)
        return tables

    found = of_tables(copy.deepcopy(keys))
    if "rayleigh" in keys.get("damping", {}):
        a, b = keys["damping"]["rayleigh"]
        found["damping"]["rayleigh"] = [a / T, b * T]
    for name, point in keys.get("stress", {}).get("points", {}).items():
        found["stress"]["points"][name] = scaled(point, L)
    return found


def numbers(keys):
    """All datasets of the body that a link file makes, and the families of its modes."""
    with h5py.File(ffrobot.make_link(keys).path) as file:
        items = {name: np.asarray(item[()]) for name, item in datasets(file).items()}
    # Written for other programs from the rest; loads of stresses follow from the modes.
    others = {name for name in items if name.startswith("craig_bampton") or name.endswith("/static")}
    found = {name: item for name, item in items.items() if item.dtype.kind in "fi" and name not in others}
    found["stations/EA"], found["stations/EI"] = found.pop("stations/rigidity").T
    return found, [name.decode() for name in items["modes/family"]]


def unit_of(name, L, M, T):
    powers = next(powers for pattern, powers in DIMENSIONS.items() if re.fullmatch(pattern, name))
    return L ** powers[0] * M ** powers[1] * T ** powers[2]


def natural(name, expected):
    """A size of the quantity below which it is nothing but rounding: of the body's mass, length and first frequency."""
    L, M, T = expected["length"], expected["mass"], 1.0 / expected["modes/frequency"].min()
    return unit_of(name, L, M, T)


def check(keys, systems=SYSTEMS, rounding=1e-9):
    expected, families = numbers(keys)
    for system in systems.values():
        found, found_families = numbers(in_other_units(keys, *system))
        assert found_families == families
        assert found.keys() == expected.keys()
        for name, values in expected.items():
            error = np.abs(found[name] / unit_of(name, *system) - values).max(initial=0.0)
            size = max(np.abs(values).max(initial=0.0), rounding * natural(name, expected))
            assert error <= 1e-5 * size, (name, system, error / size)
    return families


def drawn_section(draw, size):
    height = size * draw.uniform(0.7, 1.4)
    shape = draw.choice(["rectangle", "circle", "tube"])
    if shape == "rectangle":
        return rectangle(height, height * draw.choice([1.0, draw.uniform(0.2, 4.0)]))
    return circle(height) if shape == "circle" else tube(height, height * draw.uniform(0.2, 0.9))


def drawn_beam(seed):
    draw = random.Random(seed)
    length, slenderness = 10 ** draw.uniform(-3.5, 1.5), 10 ** draw.uniform(-2.3, -0.8)
    geometry = {"kind": "beam", "length": length}
    if draw.random() < 0.7:
        geometry["section"] = drawn_section(draw, length * slenderness)
    else:
        ends = draw.uniform(0.2, 0.8) * length, length
        geometry["segment"] = [{"until": end, "section": drawn_section(draw, length * slenderness)} for end in ends]
    families = ["in-plane-bending", "out-of-plane-bending", "axial", "torsion"]
    material = {"E": 10 ** draw.uniform(9, 11.5), "rho": draw.uniform(900, 8000), "nu": draw.uniform(0, 0.45)}
    keys = link_keys("beam", length, None, {"elements": draw.randint(3, 24)}, **material) | {
        "name": "link",
        "geometry": geometry,
        "model": {"theory": draw.choice(["euler-bernoulli", "timoshenko"])},
        "reference": {"condition": draw.choice(["cantilever", "simply-supported", "craig-bampton"])},
        "modes": {"family": draw.choice(["all", *families, draw.sample(families, 2)])},
        "damping": {"rayleigh": [draw.uniform(0, 1), 1e-5 * draw.random()]},
        "interface": [],
    }
    if draw.random() < 0.6:
        keys["modes"]["count"] = draw.randint(1, 6)
    for k in range(draw.choice([0, 1, 2])):
        mass = draw.uniform(0, 2000) * length**3 * slenderness**2
        inertia = [mass * (length * slenderness) ** 2 * draw.uniform(0.6, 1.0) for _ in range(3)]
        place = length * draw.choice([draw.uniform(0.05, 0.95), draw.uniform(0.001, 0.05)])
        keys["interface"].append({"name": f"place{k}", "position": place, "mass": mass, "inertia": inertia})
    return keys


@pytest.mark.parametrize("seed", range(40))
def test_beams(seed):
    check(drawn_beam(seed))


MORE = {"name": "link", "modes": {"count": 3}}
SOLIDS = {
    "box of 0.2 mm": solid_link(
        2e-3,
        rectangle(2e-4, 1.4e-4),
        {"cell": "hexahedron", "order": 2, "divisions": [6, 1, 1]},
        condition="craig-bampton",
        interface=[{"name": "cut", "position": 8e-4, "mass": 1e-7}],
        stress={"points": {"inside": [6e-4, 4e-5, 2e-5]}},
        **MORE,
    ),
    "hole in a thin bar that gmsh meshes": solid_link(
        3e-4,
        rectangle(3e-5, 2.1e-5),
        {"order": 2, "size": 2.7e-5},
        hole=[{"position": 1.4e-4, "diameter": 1.2e-5}],
        **MORE,
    ),
}


@pytest.mark.parametrize(
    "keys",
    [
        pytest.param(keys, id=name, marks=[pytest.mark.nightly] * name.startswith("hole"))
        for name, keys in SOLIDS.items()
    ],
)
def test_solids(keys):
    check(keys, {"µm, mg, ms": SYSTEMS["µm, mg, ms"]}, rounding=1e-7)
