"""How wrong small deformations are, as the program says it, against a pendulum of rods and the elastica."""

import warnings

import ffcx  # noqa: F401, once loaded it sends warnings to the log, past those who were recording them
import h5py
import numpy as np
import pytest
from beam_links import beam_link, rectangle
from exact_rod import tip_of
from rod_chain import falling_tip
from tables_3d import joint, pin, planar

import ffrobot as library

TIMES = np.linspace(0.0, 1.0, 101)


def link(name, E, condition, modes=8):
    return beam_link(
        1.0, rectangle(0.01, 0.02), 20, E=E, nu=None, condition=condition, name=name,
        modes={"count": modes, "family": "in-plane-bending", "attachment_modes": False}, damping={"ratio": 0.0}
    )  # fmt: skip


def pendulum(E, condition):
    bodies = [{"name": name, "link": link(name, E, condition)} for name in ("link1", "link2")]
    joints = [pin("O", "ground", "link1.root"), pin("A", "link1.tip", "link2.root")]
    fall = {"name": "fall", "kind": "forward", "end": 1.0, "output_step": 0.01, "tolerance": 1e-5}
    return library.make_scene(**planar(bodies, joints, fall))


def solved(scene, path):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        results = library.solve(scene, path)
    return results, [str(one.message) for one in told if one.category is library.FfrobotWarning]


def test_estimated_error_of_a_falling_pendulum(tmp_path):
    """Within 0.4 and 5 times the error, of 9e-2 of the length, which is said."""
    results, told = solved(pendulum(5e9, "simply-supported"), tmp_path / "fall.h5")
    error = np.abs(results["fall/points/link2.tip/position"] - falling_tip(5e9, 12, TIMES)).max()
    estimate = max(results.attributes(f"fall/bodies/{name}")["position_error"] for name in ("link1", "link2"))
    assert 0.4 * error < estimate < 5 * error
    assert len(told) == 1
    assert list(results.attributes("fall")["warnings"]) == [text.partition('"fall": ')[2] for text in told]


def elastica(load):
    """Tip (x, y) of a cantilever of unit length and rigidity under a transverse force at it."""
    return np.array([1.0, 0.0]) + tip_of(np.ones(3), 1.0, [0.0, load, 0.0], np.zeros(3))[0][:2]


def bent(load, modes, folder, *, stiffened=False, **body):
    """A horizontal arm held at its root, `load` = P L²/EI upwards at its tip, no gravity."""
    E = 7e9
    load = [{"point": "arm.tip", "y": f"{load * E * 0.02 * 0.01**3 / 12!r}"}]
    arm, held = {"name": "arm", "link": link("arm", E, "cantilever", modes)}, {"name": "held", "kind": "static"}
    keys = {"gravity": (0.0, 0.0), "load": load, "geometric_stiffening": stiffened}
    tables = planar([arm | body], [joint("O", "weld", "ground", "arm.root")], held, **keys)
    return solved(library.make_scene(**tables), folder / "bent.h5")


def test_a_bent_cantilever_is_too_long_by_its_foreshortening(tmp_path):
    """Loads across the link change no mode's stiffness: there deflection alone has to tell."""
    results, told = bent(0.25, 30, tmp_path)
    tip = results["held/points/arm.tip/position"][0]
    assert tip[1] == pytest.approx(0.25 / 3, rel=1e-3)
    about = results.attributes("held/bodies/arm")
    assert about["foreshortening"] == pytest.approx(tip[0] - elastica(0.25)[0], rel=0.03)
    assert about["position_error"] == pytest.approx(0.25**2 / 15, rel=1e-5)  # ½∫w'² dx of w = P (L x²/2 − x³/6)/EI
    assert len(told) == 1
    assert "foreshorten" not in told[0]  # in the reader's words
    assert "points may be off by 0.4" in told[0]


def test_a_run_that_is_wrong_never_says_completed_alone(ffrobot, tmp_path):
    """A pendulum whose error is a third of its length; --strict makes its warning an error and keeps results."""
    path, results = tmp_path / "scene.toml", tmp_path / "scene.results.h5"
    path.write_text(pendulum(3.5e9, "cantilever").text, encoding="utf-8")
    done = ffrobot("solve", path, "--verbose", "--strict")
    assert done.returncode == 1
    after_table = done.stdout.split("fall      forward")[1].splitlines()[1]
    assert after_table.startswith("warning")
    assert "results may be entirely wrong" in " ".join(done.stdout.split())
    assert 'divide the link: pieces = "auto"' in " ".join(done.stdout.split())
    assert "entirely wrong" in done.stderr
    assert "--strict" in done.stderr
    assert "completed, 1 warning" in ffrobot("info", results).stdout
    with h5py.File(results) as file:
        assert file["fall"].attrs["status"] == "completed"
        assert file["fall/bodies/link1"].attrs["largest_deflection"] > 0.02


def test_a_run_that_ends_early_tells_what_it_has(ffrobot, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(pendulum(1e9, "cantilever").text, encoding="utf-8")
    done = ffrobot("solve", path)
    assert done.returncode == 1
    assert "warning" in done.stdout
    with h5py.File(path.with_suffix(".results.h5")) as file:
        assert file["fall"].attrs["status"] == "diverged"
        assert len(file["fall"].attrs["warnings"]) == 1
        assert max(file[f"fall/bodies/{name}"].attrs["largest_deflection"] for name in ("link1", "link2")) > 0.1


def test_the_warning_says_how_many_pieces_are_enough(tmp_path):
    """A cantilever with P L²/EI = 1 bends by 30 %: with as many pieces as its warning says, it is the elastica's."""
    results, told = bent(1.0, 6, tmp_path, stiffened=True)
    assert np.linalg.norm(results["held/points/arm.tip/position"][0] - elastica(1.0)) > 0.03
    (count,) = [int(text.split("pieces = ")[1].split()[0]) for text in told]
    assert count < 12
    results, told = bent(1.0, 6, tmp_path, stiffened=True, pieces=count)
    assert told == []
    assert np.linalg.norm(results["held/points/arm.tip/position"][0] - elastica(1.0)) < 1e-3
