"""Random robots in 3D have the same results however they are written."""

import numpy as np
import pytest
from rewritten_scenes import (
    SYSTEMS,
    TOLERANCE,
    Written,
    differences,
    random_robot,
    scaled,
    solved,
    written_otherwise,
)

SMALL = "a robot of a size of 1e-5"


@pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")
@pytest.mark.parametrize(
    ("seed", "number"), [(1, 3), *(pytest.param(*of, marks=pytest.mark.nightly) for of in ((57, 2), (1, 0)))]
)
def test_results_do_not_depend_on_how_a_robot_is_written(seed, number, tmp_path):
    kind, tables = random_robot(seed, number)
    original = solved(tables, tmp_path)
    assert len(original) > 100
    for way, other in written_otherwise(tables, np.random.default_rng([seed, number])).items():
        off = differences(tables, original, other, solved(other.tables, tmp_path))
        assert {name: size for name, size in off.items() if size > TOLERANCE} == {}, (kind, way)


@pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")
@pytest.mark.parametrize(("number", "system"), [(1, "cm, g, µs"), (3, SMALL), (42, SMALL)])
def test_results_do_not_depend_on_units(number, system, tmp_path):
    _, tables = random_robot(57, number)
    other = Written(scaled(tables, SYSTEMS[system]), units=SYSTEMS[system])
    off = differences(tables, solved(tables, tmp_path), other, solved(other.tables, tmp_path))
    assert {name: size for name, size in off.items() if size > TOLERANCE} == {}
