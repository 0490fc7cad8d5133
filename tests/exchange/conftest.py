"""Independent codes for rigid robots."""

from functools import partial

import pytest
from other_codes import pinocchio_dynamics as dynamics
from other_codes import pinocchio_stiffness as stiffness
from other_codes import python_with_pinocchio


@pytest.fixture(scope="session")
def python_of_pinocchio(pytestconfig, tmp_path_factory):
    """Its interpreter; the environment is kept in pytest's cache if there is one."""
    cache = getattr(pytestconfig, "cache", None)
    return python_with_pinocchio(tmp_path_factory.mktemp("pinocchio") if cache is None else cache.mkdir("pinocchio"))


@pytest.fixture(scope="session")
def pinocchio_dynamics(python_of_pinocchio):
    """Accelerations, moments and mass matrices by Pinocchio of (urdf, names, motion)."""
    return partial(dynamics, python_of_pinocchio)


@pytest.fixture(scope="session")
def pinocchio_stiffness(python_of_pinocchio):
    """A rigid tree on springs at rest by Pinocchio of (urdf, request)."""
    return partial(stiffness, python_of_pinocchio)
