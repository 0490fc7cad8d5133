"""Measurements beside the tests' own heap."""

import gc

import pytest


@pytest.fixture(autouse=True)
def without_what_other_tests_left():
    """The garbage collector looks through what is measured alone, not through a heap of other tests."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()
