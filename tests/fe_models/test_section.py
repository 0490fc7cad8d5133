"""Section properties against table values."""

from math import pi

import pytest

from ffrobot.fe_models.link_records.section import rectangle, tube


@pytest.mark.parametrize(
    ("ratio", "k1"),
    # Timoshenko & Goodier, Theory of Elasticity, §109, table: J = k1 · long · short³
    [(1.0, 0.1406), (1.2, 0.166), (1.5, 0.196), (2.0, 0.229), (2.5, 0.249), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)],
)
def test_torsion_of_a_rectangle(ratio, k1):
    for section in (rectangle(ratio * 0.01, 0.01, 0.3), rectangle(0.01, ratio * 0.01, 0.3)):
        assert section.torsion == pytest.approx(k1 * ratio * 1e-8, rel=3e-3)


def test_thin_rectangle_tends_to_a_third():
    assert rectangle(1.0, 1e-5, 0.3).torsion == pytest.approx(1e-15 / 3, rel=1e-5)


def test_rectangle():
    section = rectangle(0.015, 0.025, 0.3)
    assert section.area == pytest.approx(0.015 * 0.025)
    assert section.I_yy == pytest.approx(0.025 * 0.015**3 / 12)
    assert section.I_zz == pytest.approx(0.015 * 0.025**3 / 12)
    assert section.height == 0.015
    assert section.shear == pytest.approx(0.8497, abs=5e-5)  # Cowper 1966, ν = 0.3


def test_circle_is_a_tube_without_hole():
    section = tube(0.02, 0.0, 0.3)
    assert section.area == pytest.approx(pi * 1e-4)
    assert section.I_yy == section.I_zz == pytest.approx(pi * 0.02**4 / 64)
    assert section.torsion == section.I_p == pytest.approx(pi * 0.02**4 / 32)
    assert section.shear == pytest.approx(0.886, abs=5e-4)  # Cowper 1966, ν = 0.3


def test_thin_tube():
    section = tube(0.02, 0.0199, 0.3)
    assert section.area == pytest.approx(pi * 0.01995 * 0.00005, rel=1e-6)
    assert section.torsion == pytest.approx(2 * pi * 0.009975**3 * 0.00005, rel=1e-4)
    assert section.shear == pytest.approx(2 * 1.3 / (4 + 3 * 0.3), rel=1e-4)  # Cowper 1966, thin tube
