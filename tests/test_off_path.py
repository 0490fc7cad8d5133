"""What the verdict says of replays: how far they leave the path."""

import re

import numpy as np
import pytest
from beam_links import beam_link, tube
from tables_3d import pin, planar

import ffrobot

AGAIN = {"name": "again", "kind": "forward", "actuation": "inverse", "apply": "joints"}


@pytest.mark.parametrize("replay", ["forward", "joints_only"])
def test_replays_are_told_by_their_distance_from_the_path(two_link, replay):
    """The inverse analysis is on the path, so that the distance is the one from its tip."""
    results = ffrobot.Results(two_link.folder / "scene.results.h5")
    tips = (results[f"{name}/points/link2.tip/position"] for name in (replay, "inverse"))
    off = 1e3 * np.linalg.norm(np.subtract(*tips), axis=1)
    text = r"link2\.tip off its path by (?:< )?(\S+) (mm|nm) at most, (?:< )?(\S+) (mm|nm) RMS"
    said = re.fullmatch(text, results.verdict[replay].answer)
    told = [float(value) * {"mm": 1.0, "nm": 1e-6}[unit] for value, unit in (said.group(1, 2), said.group(3, 4))]
    rms = np.sqrt(np.trapz(off**2, dx=1.0 / (len(off) - 1)))  # noqa: NPY201
    np.testing.assert_allclose(told, [off.max(), rms], rtol=1e-3, atol=1e-6)
    assert f"{replay}: {said.group()}" in re.sub(r"\s+", " ", two_link.stdout)


def test_distances_from_the_path_do_not_depend_on_outputs():
    """An arm that vibrates under the computed torques: 4 outputs, against the tip at 5 000 of them."""
    modes = {"count": 3, "family": "in-plane-bending"}
    link = beam_link(0.6, tube(0.02, 0.016), 10, modes=modes, damping={"ratio": 0.01})

    def swing(step):
        return ffrobot.solve(ffrobot.make_scene(**planar(
            [{"name": "arm", "link": link}], [pin("O", "ground", "arm.root")],
            {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": step}, AGAIN,
            payload=[{"point": "arm.tip", "mass": 0.5}], initial={"state": "static"},
            trajectory=[{"name": "up", "point": "arm.tip", "y": "0.5*sin(0.6*(10*t**3 - 15*t**4 + 6*t**5))"}],
        )))  # fmt: skip

    with pytest.warns(ffrobot.FfrobotWarning):
        coarse, fine = map(swing, (0.25, 2e-4))
    off = fine["again/points/arm.tip/position"][:, 1] - fine["inverse/trajectories/up/target"][:, 0]
    said = coarse.attributes("again/off_path/up")
    assert f"at most, {1e3 * said['distance_rms']:.4g} mm RMS" in coarse.verdict["again"].answer
    assert said["distance"] == pytest.approx(np.abs(off).max(), rel=1e-2)
    assert said["distance_rms"] == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-2)


@pytest.mark.parametrize(("motor", "count"), [(None, 1), (False, 0)])
def test_moments_that_were_not_computed_are_not_replayed(motor, count):
    """Of planar scenes with other motors than the mechanism needs; the rest of the file is right."""
    points = {"root": [0.0, 0.0], "tip": [1.0, 0.0]}
    bar = {"mass": 1.0, "inertia": 0.1, "center": [0.5, 0.0], "points": points}
    tables = planar(
        [{"name": name, "rigid": bar} for name in ("upper", "fore")],
        [pin("O", "ground", "upper.root", motor=False), pin("A", "upper.tip", "fore.root", motor=motor)],
        {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}, AGAIN,
        initial={"angles": {"upper": 0.0, "fore": 1.0}},
        trajectory=[{"name": "tip", "point": "fore.tip", "x": "1 + cos(1)", "y": "sin(1) + 0.1*t**2"}],
    )  # fmt: skip
    message = rf"motors that fit the mechanism \(2 of them\) for \"joints\", found {count}"
    with pytest.raises(ffrobot.InputError, match=message):
        ffrobot.solve(ffrobot.make_scene(**tables))
