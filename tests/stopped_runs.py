"""Runs that are stopped, go on from their results file, and are compared with whole ones."""

import numpy as np
import pytest

import ffrobot
from ffrobot.run.watcher import Watcher

SAME = 1e-13
"""Of the largest value: states are the same to the last bit, NumPy's sums depend on where arrays stand in memory."""


class Stops(Watcher):
    """Stops the run of one analysis at its time t, once time has passed from 0 so many times.

    In space an earlier analysis is made again before a forward run.
    """

    def __init__(self, analysis="none", t=1.0, passes=0):
        self.analysis, self.t, self.passes, self.stages, self.asked = analysis, t, passes, [], []

    def stage(self, title):
        self.stages.append(title)

    def advance(self, t, end):
        self.asked.append((self.stages[-1], t))
        return self.analysis not in self.stages[-1] or t < self.t or self.passed(self.analysis) < self.passes

    def passed(self, analysis):
        """How many times it has begun."""
        return sum(analysis in stage and t == 0.0 for stage, t in self.asked)


def stop(scene, analysis, t, passes=0):
    """What is told of a run that is stopped."""
    with pytest.raises(ffrobot.SolveError, match="interrupted") as error:
        ffrobot.solve(scene, scene.with_suffix(".h5"), Stops(analysis, t, passes))
    return str(error.value)


def go_on(scene, watcher=None):
    return ffrobot.solve(scene, scene.with_suffix(".h5"), watcher, resume=True)


def edit(scene, replacements):
    """Texts of a scene file replaced, each of which is there."""
    text = scene.read_text(encoding="utf-8")
    for old, new in replacements.items():
        assert old in text, old
        text = text.replace(old, new)
    scene.write_text(text, encoding="utf-8")


def differences(results, expected):
    """Of all histories of both, largest difference over largest value.

    Violations of constraint equations are differences of positions, of which 1 m is the measure: they are round-off.
    """
    assert results.analyses == expected.analyses
    for analysis in expected.analyses:
        found, wanted = results.columns(analysis), expected.columns(analysis)
        assert found.keys() == wanted.keys()
        for name, values in wanted.items():
            assert found[name].shape == values.shape
            scale = 1.0 if name.startswith("constraint_violation") else np.abs(values).max() or 1.0
            yield name, np.abs(found[name] - values).max() / scale


def attributes(results):
    """All of the analyses, their groups and datasets, by place, peaks among them; but what a run took.

    To go on an integrator evaluates once more where it has stopped.
    """
    found, work = {}, ("wall_seconds", "evaluations")

    def add(name, item):
        found.update({(name, key): value for key, value in item.attrs.items() if key not in work})

    for analysis in results.analyses:
        add(analysis, results._file[analysis])
        results._file[analysis].visititems(lambda name, item, analysis=analysis: add(f"{analysis}/{name}", item))
    return found


def check_attributes(results, expected):
    """That all are the same but for `SAME`."""
    found, wanted = attributes(results), attributes(expected)
    assert found.keys() == wanted.keys()
    for place, value in wanted.items():
        if np.asarray(value).dtype.kind == "f":
            np.testing.assert_allclose(found[place], value, rtol=SAME, atol=1e-12, err_msg=str(place))
        else:
            np.testing.assert_array_equal(found[place], value, err_msg=str(place))
