"""Independent codes for rigid robots."""

from functools import partial

import pytest
from other_codes import pinocchio_moments, python_with_pinocchio


@pytest.fixture(scope="session")
def pinocchio(pytestconfig, tmp_path_factory):
    """Motor moments by Pinocchio of (urdf, names, motion); kept in pytest's cache if there is one."""
    cache = getattr(pytestconfig, "cache", None)
    folder = tmp_path_factory.mktemp("pinocchio") if cache is None else cache.mkdir("pinocchio")
    return partial(pinocchio_moments, python_with_pinocchio(folder))
