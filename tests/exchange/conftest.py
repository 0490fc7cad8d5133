"""Independent codes for rigid robots."""

from functools import partial

import pytest
from other_codes import pinocchio_moments, python_with_pinocchio


@pytest.fixture(scope="session")
def pinocchio(pytestconfig):
    """Motor moments by Pinocchio: (urdf, names, motion); its environment is kept in pytest's cache."""
    return partial(pinocchio_moments, python_with_pinocchio(pytestconfig.cache.mkdir("pinocchio")))
