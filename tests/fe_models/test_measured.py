"""Measured frequencies and damping ratios in a modal body: what changes, what stays, what is refused."""

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link
from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.modal_body_file import read_modal_body
from ffrobot.fe_models.pieces import cut
from ffrobot.present.info import describe

MEASURED = '[measured]\ntable = "modes.csv"\n'
STRESS = "[stress]\npoints = { middle = [0.5, 0.004, 0.0] }\n"


@pytest.fixture
def measured_link(link_file, tmp_path):
    """Write the paper's link with a table of measured modes beside it."""

    def write(table, more=STRESS, **changes):
        (tmp_path / "modes.csv").write_text(table, encoding="utf-8")
        return link_file(more=more + MEASURED, count=3, **changes)

    return write


@pytest.fixture
def computed(link_file):
    """The modal body without measured values."""
    return make_link(link_file(name="computed", more=STRESS, count=3, replace={'"computed"': '"link1"'})).body


def test_frequencies_and_damping_are_measured_and_shapes_those_of_the_model(measured_link, computed):
    """A row of a mode that the link does not have is left out."""
    outcome = make_link(measured_link("mode,frequency,damping_ratio\n2, 131.5, 0.004\n1, 33.0,\n3,,0.01\n4,600.0,\n"))
    body = read_modal_body(outcome.path)
    np.testing.assert_array_equal(body.frequency, [33.0, 131.5, computed.frequency[2]])
    np.testing.assert_allclose(np.diag(body.stiffness), (2 * np.pi * body.frequency) ** 2, rtol=1e-14)
    np.testing.assert_array_equal(body.damping_ratio, [0.0, 0.004, 0.01])
    np.testing.assert_array_equal(body.S_bar, computed.S_bar)
    np.testing.assert_array_equal(body.stations.translation, computed.stations.translation)
    np.testing.assert_array_equal(body.measured.computed_frequency, computed.frequency)
    np.testing.assert_array_equal(body.measured.frequency, [1, 1, 0])
    np.testing.assert_array_equal(body.measured.damping_ratio, [0, 1, 1])
    text = describe(outcome.path)
    assert "measured: frequencies of modes 1, 2 and damping ratios of modes 2, 3; shapes are those of the model" in text
    assert f"{computed.frequency[1]:.6f}" in text


def test_stress_under_a_constant_load_stays(measured_link, computed):
    """A softer mode bends further, under the same section forces: φF/ω² times its stress is what it was."""
    body = make_link(measured_link("mode,frequency\n1,30.0\n3,310\n")).body
    of_load = [
        modal.stress["middle"].stress * modal.interfaces["tip"].rotation[2] / np.diag(modal.stiffness)
        for modal in (body, computed)
    ]
    np.testing.assert_allclose(of_load[0], of_load[1], rtol=1e-12)
    np.testing.assert_array_equal(body.stress["middle"].strain, computed.stress["middle"].strain)
    np.testing.assert_array_equal(body.stress["middle"].static, computed.stress["middle"].static)


def test_rayleigh_damping_is_that_of_the_measured_frequency(measured_link):
    damping = "[damping]\nrayleigh = [0.4, 1e-5]\n"
    body = make_link(measured_link("mode,frequency,damping_ratio\n1,30,\n2,130,0.02\n", more=damping)).body
    omega = 2 * np.pi * 30.0
    assert body.damping_ratio[0] == pytest.approx(0.4 / (2 * omega) + 1e-5 * omega / 2, rel=1e-14)
    assert body.damping_ratio[1] == 0.02


def test_a_new_table_needs_no_new_modes(measured_link, computed):
    path = measured_link("mode,frequency\n1,30.0\n")
    make_link(path)
    assert not make_link(path).computed
    assert not make_link(measured_link("mode, frequency\n1, 30\n")).computed  # by its content
    changed = make_link(measured_link("mode,frequency\n1,31.0\n"))
    assert (changed.computed, changed.reused, changed.body.frequency[0]) == (True, "modes", 31.0)
    path.write_text(path.read_text().replace(MEASURED, ""))
    again = make_link(path)
    assert again.reused == "modes"
    np.testing.assert_array_equal(again.body.frequency, computed.frequency)
    np.testing.assert_allclose(
        again.body.stress["middle"].stress, computed.stress["middle"].stress, rtol=1e-12, atol=1e-3
    )


TABLES = {
    "mode,frequncy\n1,30\n": 'line 1: expected columns among "mode"',
    "mode,frequency\n1,-30\n": 'line 2: frequency: expected a number above 0, in Hz, or nothing, found "-30"',
    "mode,mode\n1,1\n": "line 1: expected each column once, found 'mode,mode'",
    "mode,frequency\n0,30\n": 'line 2: mode: expected a whole number from 1 on, found "0"',
    "mode,frequency\n1,30\n1,31\n": "line 3: expected each mode once, found mode 1 again",
    "mode,frequency,damping_ratio\n1,,\n": "line 2: expected a frequency or a damping_ratio, found neither",
    "mode,frequency,damping_ratio\n1,30,-0.1\n": "line 2: damping_ratio: expected a number not below 0",
    "mode,frequency\n1\n": "line 2: expected 2 cells with commas, semicolons or tabs between them, as the header has",
    "mode,family,frequency\n1,in-plane,30\n": 'family: expected "in-plane-bending", ',
}


@pytest.mark.parametrize("table", TABLES)
def test_wrong_tables_are_refused_with_their_line(measured_link, table):
    with pytest.raises(InputError) as caught:
        read_link(measured_link(table))
    assert TABLES[table] in str(caught.value)
    assert "modes.csv: " in str(caught.value)


def test_what_cannot_be_measured_is_refused(measured_link, tmp_path):
    with pytest.raises(InputError, match="expected mode 1 within a factor of 2 of the computed 3"):
        make_link(measured_link("mode,frequency\n1,130.0\n"))
    with pytest.raises(InputError, match="expected rows of modes that the link has"):
        make_link(measured_link("mode,family,frequency\n1,torsion,130.0\n"))
    robot = '[damping]\nratio = 0.01\nof = "robot"\n'
    with pytest.raises(InputError, match=r'measured: expected no damping_ratio with damping\.of = "robot"'):
        read_link(measured_link("mode,frequency,damping_ratio\n1,30.0,0.01\n", more=robot))
    with pytest.raises(InputError, match="measured: expected none of a subdivided body"):
        cut(measured_link("mode,frequency\n1,30.0\n"), 4)
    (tmp_path / "modes.csv").unlink()
    with pytest.raises(InputError, match=r'measured.table: expected an existing file, found "modes.csv"'):
        read_link(tmp_path / "link1.toml")
