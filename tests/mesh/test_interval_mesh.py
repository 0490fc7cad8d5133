"""Where the nodes of a beam lie."""

import numpy as np

from ffrobot.mesh.structured import graded_nodes, with_points


def test_steps_are_nodes_and_a_uniform_mesh_that_meets_them_is_kept():
    nodes = graded_nodes([0.0, 0.3, 0.4, 1.0], 20)
    np.testing.assert_allclose(nodes, np.linspace(0, 1, 21), atol=1e-15)
    assert {0.0, 0.3, 0.4, 1.0} <= set(nodes)


def test_the_longest_element_is_as_short_as_possible():
    nodes = graded_nodes([0.0, 0.1, 1.0], 4)
    np.testing.assert_allclose(nodes, [0.0, 0.1, 0.4, 0.7, 1.0])


def test_points_are_added_once():
    nodes = with_points(np.array([0.0, 0.5, 1.0]), [0.5, 0.5 + 1e-12, 0.25, 1.0])
    np.testing.assert_array_equal(nodes, [0.0, 0.25, 0.5, 1.0])
