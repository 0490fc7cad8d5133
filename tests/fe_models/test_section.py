"""Section properties against table values; of shear Cowper 1966, ν = 0.3."""

from math import pi

import pytest

from ffrobot.fe_models.link_records.section import rectangle, tube


@pytest.mark.parametrize(
    ("ratio", "k1", "bound"),
    # Timoshenko & Goodier, Theory of Elasticity, §109, table: J = k1 · long · short³
    [(1.0, 0.1406, 3e-3), (1.5, 0.196, 3e-3), (2.0, 0.229, 3e-3), (3.0, 0.263, 3e-3), (10.0, 0.312, 3e-3),
     (1e5, 1 / 3, 1e-5)],
)  # fmt: skip
def test_torsion_of_a_rectangle(ratio, k1, bound):
    for section in (rectangle(ratio * 0.01, 0.01, 0.3), rectangle(0.01, ratio * 0.01, 0.3)):
        assert section.torsion == pytest.approx(k1 * ratio * 1e-8, rel=bound)


def test_rectangle():
    section = rectangle(0.015, 0.025, 0.3)
    assert section.I_yy == pytest.approx(0.025 * 0.015**3 / 12)
    assert section.I_zz == pytest.approx(0.015 * 0.025**3 / 12)
    assert section.shear == pytest.approx(0.8497, abs=5e-5)


def test_circle_and_thin_tube():
    circle = tube(0.02, 0.0, 0.3)
    assert circle.I_yy == circle.I_zz == pytest.approx(pi * 0.02**4 / 64)
    assert circle.torsion == circle.I_p == pytest.approx(pi * 0.02**4 / 32)
    assert circle.shear == pytest.approx(0.886, abs=5e-4)
    thin = tube(0.02, 0.0199, 0.3)
    assert thin.area == pytest.approx(pi * 0.01995 * 0.00005, rel=1e-6)
    assert thin.torsion == pytest.approx(2 * pi * 0.009975**3 * 0.00005, rel=1e-4)
    assert thin.shear == pytest.approx(2 * 1.3 / (4 + 3 * 0.3), rel=1e-4)
