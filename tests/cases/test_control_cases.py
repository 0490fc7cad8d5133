"""One case per capability of control, each through `ffrobot solve`; the tables of their READMEs hold."""

import numpy as np
import pytest
from checkpoints import check_table


@pytest.fixture(scope="module")
def linear(solved):
    return solved("two_link_linear")


@pytest.fixture(scope="module")
def placement(solved):
    return solved("two_link_placement")


def frequencies(group, row=0):
    """Modes 3 to 6, and the largest real part of a pole."""
    return [*group["linear/frequency"][row, 2:6], group["linear/pole"][row, :, 0].max()]


def test_frequencies_at_rest_and_along_the_path(linear):
    along = linear.file["along"]
    (early, late) = linear.rows("along", [0.4, 1.0])
    check_table(
        "two_link_linear",
        "about",
        {
            "rest": frequencies(linear.file["at_rest"]),
            "path, 0.4 s": frequencies(along, early),
            "path, 1 s": frequencies(along, late),
        },
    )


def zeros_of(case, analysis):
    """{"inputs → outputs": (k, 2)} at the first time."""
    found = {}
    for dataset in case.file[f"{analysis}/linear/zeros"].values():
        names = [", ".join(dataset.attrs[key]) for key in ("inputs", "outputs")]
        found[" → ".join(names)] = dataset[0]
    return found


def test_zeros_at_rest(linear):
    zeros = zeros_of(linear, "at_rest")
    slowest = {}
    for pair in ("joint/O → joint/O", "joint/A → joint/A", "joint/A → point/link2.tip/y"):
        slowest[pair] = zeros[pair]
    slowest["joint/O, joint/A → point/link2.tip/x, point/link2.tip/y"] = zeros[list(zeros)[-1]]
    right = {pair: values[values[:, 0] > 0.1] for pair, values in slowest.items()}
    right = {pair: values[np.linalg.norm(values, axis=1).argmin()] for pair, values in right.items()}
    check_table("two_link_linear", "from → to", right)
    held = np.abs(zeros["joint/O, joint/A → joint/O, joint/A"][:, 1])
    assert held.min() / (2 * np.pi) == pytest.approx(3.582, abs=1e-3)


def test_tip_zeros_are_those_of_a_hinged_beam(linear):
    """2 x² √(EI/ρA)/L², x = 2.36502037 the first root of tan x = −tanh x; EI/ρA from cases/two_link/link1.toml."""
    rate = np.sqrt(2.068427e11 * 0.015**2 / 12 / 7850.0)
    zeros = zeros_of(linear, "at_rest")["joint/O, joint/A → point/link2.tip/x, point/link2.tip/y"]
    assert zeros[:, 0].max(where=zeros[:, 0] < 249.0, initial=0.0) == pytest.approx(2 * 2.36502037**2 * rate, rel=2e-3)


def test_every_mode_is_reached_and_seen(linear):
    for kind in ("controllability", "observability"):
        assert list(linear.file[f"at_rest/linear/{kind}"].attrs["lost"]) == []
    assert "non-minimum phase" in linear.stdout
    assert "joint/O, joint/A → joint/O, joint/A: minimum phase" in linear.stdout


def test_patches_found_beat_even_spacing(placement):
    measured = {}
    for name in ("reach_link1", "reach_link2", "path_link1", "path_link2", "eight_link2"):
        group = placement.file[f"{name}/placement"]
        pair = (
            group["largest_voltage"][()]
            if name.startswith("path")
            else [group[f"{k}/value"][()] for k in ("best", "even")]
        )
        measured[f"`{name}`"] = [*pair, group.attrs["sets"]]
        assert np.diff(group["best/centers"][()]).min() > 0.05 - 1e-9
    check_table("two_link_placement", "analysis", measured)
