"""Numbers that others have published: beams that bend far, twist and spin, a bimorph, a four-bar."""

from itertools import pairwise

import numpy as np
import pytest
from beam_links import beam_link, circle, modal_body, rectangle
from four_bar import BAUCHAU, bauchau
from patches_on_links import bent, on_link, planar_body
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from tables_3d import joint, pin, planar, rigid, scene

import ffrobot
from ffrobot.actuation.patches.composite import PlacedLayout, patched_body

ALL = ["in-plane-bending", "out-of-plane-bending", "torsion", "axial"]
AT_REST, UPRIGHT = [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]


def on_a_wall(beam, *others, analysis="static", joints=(), **keys):
    """Results of a beam that is clamped at its root, without gravity."""
    joints = [joint("wall", "weld", "ground", "beam.root"), *joints]
    tables = scene([{"name": "beam"} | beam, *others], joints, {"name": "rest", "kind": analysis}, gravity=AT_REST)
    return ffrobot.solve(ffrobot.make_scene(**tables | keys))


@pytest.mark.parametrize(
    ("angle", "y", "z"),
    [
        (0, 1.071417630e-2, 0.0),
        (15, 1.061328706e-2, 4.208232124e-2),
        (45, 8.837226265e-3, 0.108987937),
        (75, 3.538889001e-3, 0.142194370),
        (90, 0.0, 0.146245978),
    ],
)
def test_princeton_beam(angle, y, z):
    """Tip of a strip under 8.896 N at an angle to its stiff side, in four pieces, against ANSYS' beams.

    Published by Obrezkov, Matikainen and Mikkola, Nonlinear Dynamics 109 (2022), after Dowell and Traybar (1975).
    """
    section = rectangle(12.3777e-3, 3.2024e-3)
    link = beam_link(0.508, section, 16, E=71.7e9, nu=0.31, modes={"count": 8, "family": ALL})
    turn = np.deg2rad(angle)
    force = {"y": repr(float(-8.896 * np.cos(turn))), "z": repr(float(8.896 * np.sin(turn)))}
    with on_a_wall({"link": link, "pieces": 4}, load=[{"point": "beam.tip"} | force]) as results:
        tip = results["rest/points/beam.tip/position"][0]
    np.testing.assert_allclose(-tip[1], y, rtol=0.01, atol=1e-9)
    np.testing.assert_allclose(tip[2], z, rtol=1e-3, atol=1e-9)


def test_nafems_fv4():
    """Cantilever with masses beside its tip: bending and twist together, two frequencies that nearly coincide.

    NAFEMS, The Standard NAFEMS Benchmarks, TNSB rev. 3 (1990).
    """
    link = beam_link(10.0, circle(0.5), 20, E=200e9, nu=0.3, rho=8000.0, modes={"count": 24, "family": ALL})
    point = np.diag([1e-6, 1e-6, 1e-6]).tolist()
    masses = [rigid("left", 1e4, point, [0.0, 2.0, 0.0]), rigid("right", 1e3, point, [0.0, -2.0, 0.0])]
    welds = [joint(f"to {mass['name']}", "weld", "beam.tip", f"{mass['name']}.root") for mass in masses]
    with on_a_wall({"link": link}, *masses, analysis="linear", joints=welds) as results:
        frequency = results["rest/linear/frequency"][0, :6]
    np.testing.assert_allclose(frequency, [1.723, 1.727, 7.413, 9.972, 18.155, 26.957], rtol=2e-3)


def test_polymer_bimorph():
    """Two layers of PVDF of one thickness, 1 V: the patch is as thick as its link, and shifts the neutral axis.

    Tip 3 e31 V L²/(2 E t²) = 3.45e-7 m of Tzou's bimorph (Piezoelectric Shells, 1993).
    """
    L, width, half, E, e31 = 0.1, 5e-3, 0.5e-3, 2e9, 0.046
    link = beam_link(L, rectangle(half, width), 20, E=E, nu=0.0, rho=1780.0, modes={"count": 20})
    body = modal_body(link)
    keys = {"width": width, "thickness": half, "modulus": E, "d31": e31 / E, "length": L, "structural": ("stiffness",)}
    bare, layer = planar_body(body), on_link(body, centers=(L / 2,), **keys)
    layered = patched_body(bare, body, [PlacedLayout(layer.arrays["link"].layout, layer.arrays["link"].edges)])
    tip = layered.points["tip"].translation[1] @ bent(layered, on_link(body, layered, centers=(L / 2,), **keys), [1.0])
    assert tip == pytest.approx(3 * e31 * L**2 / (2 * E * (2 * half) ** 2), rel=1e-3)
    assert tip == pytest.approx(3.45e-7, rel=1e-3)


def test_extension_of_a_spinning_beam():
    """Steady extension ρA ω² L³/(3 EA) = 5.14e-4 m after the spin-up of Simo and Vu-Quoc (J. Appl. Mech. 53, 1986)."""
    height, width = np.sqrt(12 * 5e-4), 0.02
    EA, line_mass, area = 2.8e7, 1.2, height * width
    modes = {"count": 6, "family": ["in-plane-bending", "axial"], "attachment_modes": True}
    section = rectangle(float(height), width)
    link = beam_link(10.0, section, 20, E=EA / area, nu=0.3, rho=line_mass / area, modes=modes, damping={"ratio": 0.02})
    spin = "where(t < 15, 6/15*(t**2/2 + (15/(2*pi))**2*(cos(2*pi*t/15) - 1)), 6*(t - 7.5))"
    turn = {"name": "turn", "kind": "pcid", "end": 30.0, "output_step": 0.01}
    keys = {"geometric_stiffening": "auto", "trajectory": [{"name": "spin", "joint": "hub", "value": spin}]}
    tables = planar([{"name": "beam", "link": link}], [pin("hub", "ground", "beam.root")], turn, gravity=[0, 0], **keys)
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        extension = results["turn/points/beam.tip/deflection"][results["turn/time"] > 25.0, 0].mean()
    assert extension == pytest.approx(line_mass * 6.0**2 * 10.0**3 / (3 * EA), rel=1e-3)


STEEL = {"E": 207e9, "nu": 0.3, "rho": 7800.0}
TILT, START, TURN = np.deg2rad(5.0), np.pi / 2, -0.6
ABOUT = np.array([0.0, -np.sin(TILT), np.cos(TILT)])  # of the hinge between coupler and rocker


class TiltedFourBar:
    """Its equilibrium at a crank angle, of bars that bend little between n nodes which move as far as they do."""

    def __init__(self, n):
        self.n, self.roots = n, [_stiffness_root(length / n, side) for length, side in BAUCHAU.values()]

    def solved(self, angle):
        """Energy, place of the coupler's tip, and force on the crank's root."""
        unknown = np.zeros(3 + 6 * (3 * self.n - 1))
        found = least_squares(self._stored, unknown, args=(angle,), xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60)
        first = self.roots[0].T @ self._stored(found.x, angle)[:6]
        return found.cost, self._nodes(found.x, angle)[1][-1][0], -about_z(angle).apply(first[:3])

    def _nodes(self, unknown, angle):
        """Places and orientations; `unknown` are hinge angles and moves from the bars of a mechanism without tilt."""
        along, moves = about_z(angle).apply([0.12, 0.0, 0.0]), iter(unknown[3:].reshape(-1, 6))
        starts, turns = (0.0 * along, along, along + np.array([0.24, 0.0, 0.0])), (angle, 0.0, angle + np.pi)
        bars, place, turned = [], np.zeros(3), about_z(angle)
        for start, turn, (length, _) in zip(starts, turns, BAUCHAU.values(), strict=True):
            nodes = [(place, turned)]
            for x in np.linspace(0.0, length, self.n + 1)[1:]:
                if len(bars) == 2 and len(nodes) == self.n:
                    nodes.append((np.array([0.24, 0.0, 0.0]), about_z(turn + unknown[2])))
                else:
                    move = next(moves)
                    at = start + about_z(turn).apply([x, 0.0, 0.0]) + 0.01 * move[:3]
                    nodes.append((at, Rotation.from_rotvec(move[3:]) * about_z(turn)))
            bars.append(nodes)
            place, turned = nodes[-1]
            turned = turned * (
                about_z(unknown[0] - angle) if len(bars) == 1
                else Rotation.from_rotvec((angle - START + unknown[1]) * ABOUT) * about_z(-START)
            )  # fmt: skip
        return bars

    def _stored(self, unknown, angle):
        found = []
        for root, nodes, (length, _) in zip(self.roots, self._nodes(unknown, angle), BAUCHAU.values(), strict=True):
            for (place, turned), (end, tip) in pairwise(nodes):
                way = turned.inv().apply(end - place) - [length / self.n, 0.0, 0.0]
                found.append(root @ np.append(way, (turned.inv() * tip).as_rotvec()))
        return np.concatenate(found)


def about_z(angle):
    return Rotation.from_euler("z", angle)


def _stiffness_root(length, side):
    """R of RᵀR = K (6, 6), by which forces and moments at the tip of a clamped square bar follow from its motion."""
    EI, GJ = STEEL["E"] * side**4 / 12, STEEL["E"] / 2 / (1 + STEEL["nu"]) * 0.14057701 * side**4
    give = np.diag(length / np.array([STEEL["E"] * side**2, EI / length**2 * 3, EI / length**2 * 3, GJ, EI, EI]))
    give[[1, 5], [5, 1]], give[[2, 4], [4, 2]] = length**2 / 2 / EI, -(length**2) / 2 / EI
    return np.linalg.cholesky(np.linalg.inv(give)).T


def test_four_bar_with_a_tilted_hinge():
    """It moves only because its bars bend: slowly, its forces and the work of the crank are those of an equilibrium.

    With bars of four elements, which bend far, forces differ by 0.1 %.
    """
    T, modes = 0.5, {"count": 12, "family": ALL, "attachment_modes": True}
    s = f"(126*(t/{T})**5 - 420*(t/{T})**6 + 540*(t/{T})**7 - 315*(t/{T})**8 + 70*(t/{T})**9)"
    turned = {"name": "turned", "kind": "pcid", "end": T, "output_step": T, "tolerance": 1e-6}
    tables = bauchau(TILT, f"{START} + {TURN}*{s}", turned, **STEEL, modes=modes, damping={"ratio": 0.05})
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        names = ("points/coupler.tip/position", "joints/A/reaction", "trajectories/turn/force")
        place, force, (moment,) = (results[f"turned/{name}"][-1] for name in names)
    for n, close in ((1, 1e-5), (4, 2e-3)):
        bars, h = TiltedFourBar(n), 5e-3
        _, at, on_root = bars.solved(START + TURN)
        before, after = (bars.solved(START + TURN + way)[0] for way in (-h, h))
        np.testing.assert_allclose(force, on_root, atol=close * np.abs(on_root).max())
        np.testing.assert_allclose(place, at, atol=close * 0.12)
        assert moment == pytest.approx((after - before) / (2 * h), rel=max(close, 3e-4))
