"""The modal body by itself: immutable, checked, interpolated; no finite element library is involved."""

import copy
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from beam_links import moved

from ffrobot.common.errors import InputError
from ffrobot.fe_models.modal_body import Interface, ModalBody, PictureMesh, Stations


def cubic(x, coefficients):
    """Value and slope of polynomials with `coefficients` (4, n), lowest first, at x (k,): two arrays (k, n)."""
    powers = np.stack([x**p for p in range(4)], axis=1)
    slopes = np.stack([np.zeros_like(x), np.ones_like(x), 2 * x, 3 * x**2], axis=1)
    return powers @ coefficients, slopes @ coefficients


def fields_at(x, coefficients):
    """(k, 3, n) translation and rotation of a thin beam; `coefficients` (4 fields, 4, n): u, v, w, twist."""
    (u, _), (v, dv), (w, dw), (twist, _) = (cubic(x, field) for field in coefficients)
    return np.stack([u, v, w], axis=1), np.stack([twist, -dw, dv], axis=1)


@pytest.fixture
def coefficients():
    return np.random.default_rng(1).normal(size=(4, 4, 2))


@pytest.fixture
def body(coefficients):
    x = np.array([0.0, 0.2, 0.5, 0.6, 0.9, 1.0, 1.4])
    position = np.stack([x, 0 * x, 0 * x], axis=1)
    translation, rotation = fields_at(x, coefficients)
    frequency = np.array([1.0, 2.5])
    S_bar_kl = np.zeros((3, 3, 2, 2))
    S_bar_kl[1, 1] = np.eye(2)
    return ModalBody(
        name="made manually",
        kind="beam",
        reference_condition="cantilever",
        length=1.4,
        mass=2.0,
        first_moment=np.array([1.4, 0, 0]),
        second_moment=np.diag([1.3, 0, 0]),
        frequency=frequency,
        stiffness=np.diag((2 * np.pi * frequency) ** 2),
        modal_mass=np.eye(2),
        damping_ratio=np.zeros(2),
        family=("in-plane-bending",) * 2,
        S_bar=np.array([[0.0] * 2, [0.3] * 2, [0.0] * 2]),
        I_bar=np.zeros((3, 3, 2)),
        S_bar_kl=S_bar_kl,
        interfaces={
            "root": Interface(position[0], translation[0], rotation[0]),
            "tip": Interface(position[-1], translation[-1], rotation[-1]),
        },
        stations=Stations(position, translation, rotation, np.full(x.size, 0.01)),
        mesh=PictureMesh(position, np.array([[0, 1]]), translation),
        geometric_stiffness={"omega_zz": np.eye(2)},
    )


@pytest.mark.parametrize("element", [None, np.array([[0, 1, 2, 3], [3, 4, 5, 6]])], ids=["Hermite", "elements"])
def test_interpolation_reproduces_cubics(body, coefficients, element):
    body = replace(body, stations=replace(body.stations, element=element))
    for x in np.linspace(0, 1.4, 43):
        found = body.interpolate(float(x))
        translation, rotation = fields_at(np.array([x]), coefficients)
        np.testing.assert_allclose(found.position, [x, 0, 0], atol=1e-15)
        np.testing.assert_allclose(found.translation, translation[0], atol=1e-13)
        np.testing.assert_allclose(found.rotation, rotation[0], atol=1e-12)


def test_links_begin_at_their_first_station(body):
    """Also where the origin is elsewhere, as in bodies of other programs, or the root is a face beside the end."""
    here, away = body.interpolate(0.7), moved(body, lambda x: x + 2.0 * np.eye(3)[0])
    there = away.interpolate(away.begin + 0.7)
    np.testing.assert_allclose(there.position, np.array([2.7, 0.0, 0.0]), atol=1e-15)
    np.testing.assert_allclose(there.translation, here.translation, rtol=1e-12)
    root = replace(body.interfaces["root"], position=np.array([0.7, -0.01, 0.0]))
    assert replace(body, interfaces={**body.interfaces, "root": root}).begin == 0.0


def test_hermite_interpolation_needs_no_smoothness_between_stations(body):
    """v and rotation are exact in each interval on its own, whatever the others do."""
    translation, rotation = body.stations.translation.copy(), body.stations.rotation.copy()
    translation[:2], rotation[:2] = 7.0, -3.0
    changed = replace(body, stations=replace(body.stations, translation=translation, rotation=rotation))
    for x in (0.55, 0.95, 1.2):
        np.testing.assert_array_equal(changed.interpolate(x).translation[1:], body.interpolate(x).translation[1:])
        np.testing.assert_array_equal(changed.interpolate(x).rotation[1:], body.interpolate(x).rotation[1:])


@pytest.mark.parametrize("x", [-0.01, 1.41, np.nan])
def test_outside_the_body(body, x):
    with pytest.raises(InputError, match=r"made manually: x: expected 0 … 1\.4 m"):
        body.interpolate(x)


@pytest.mark.parametrize("copied", [replace, copy.deepcopy, lambda body: pickle.loads(pickle.dumps(body))])
def test_bodies_and_copies_are_whole_and_immutable(copied, body):
    """As other processes get them."""
    source = np.array([1.0, 0, 0])
    other = copied(replace(body, first_moment=source))
    source[0] = 9.0
    assert other.first_moment[0] == 1.0
    assert vars(other).keys() == vars(body).keys()
    assert list(other.interfaces) == list(body.interfaces)
    np.testing.assert_array_equal(other.interfaces["tip"].rotation, body.interfaces["tip"].rotation)
    for array in (other.S_bar, other.stations.translation, other.interfaces["tip"].rotation, other.mesh.points):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    with pytest.raises(FrozenInstanceError):
        other.mass = 1.0
    with pytest.raises(TypeError):
        other.interfaces["grip"] = other.interfaces["tip"]


WRONG = {
    "kind": ("Beam", "kind: expected .*, found Beam"),
    "mass": (-1.0, "mass: expected a positive number"),
    "length": (0.0, "length: expected a positive number"),
    "another length": (1.5, "length: expected 1.4 m, from first to last station, found 1.5 m"),
    "frequency": (np.array([1.0, 0.0]), "frequency: expected positive numbers"),
    "first_moment": (np.zeros(2), r"first_moment: expected shape \(3,\), found \(2,\)"),
    "second_moment": (np.triu(np.ones((3, 3))), "second_moment: expected symmetric"),
    "stiffness": (np.eye(2), "stiffness: expected diag"),
    "modal_mass": (np.eye(2) * (1 + 1e-7), "modal_mass: expected the identity"),
    "damping_ratio": (np.array([0.0, -0.1]), "damping_ratio"),
    "residual": (np.array([1, 0]), "residual: expected 0 of each eigenmode, then 1"),
    "S_bar": (np.full((3, 2), np.nan), "S_bar: expected finite numbers"),
    "S_bar_kl": (np.zeros((3, 3, 2, 2)), "S_bar_kl: expected a sum"),
    "interfaces": ({}, "interfaces: expected one named root, found none"),
    "geometric_stiffness": ({"t_x": np.triu(np.ones((2, 2)))}, "geometric_stiffness/t_x: expected symmetric"),
    "family": (("axial",), "expected shape"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_is_refused(body, name):
    value, message = WRONG[name]
    with pytest.raises(InputError, match=message):
        replace(body, **{name.split()[-1]: value})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": lambda p: p[::-1]}, "ascending in x"),
        ({"element": lambda _: np.array([[0, 1, 2, 3]])}, "stations.element"),
        ({"height": lambda h: h[1:]}, "stations.height: expected shape"),
        ({"translation": lambda t: t * np.inf}, "stations.translation: expected finite"),
        ({"position": lambda p: p / 4}, "length: expected 0.35 m, from first to last station, found 1.4 m"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_wrong_stations_are_refused(body, changes, message):
    changed = {name: change(getattr(body.stations, name)) for name, change in changes.items()}
    with pytest.raises(InputError, match=message):
        replace(body, stations=replace(body.stations, **changed))
