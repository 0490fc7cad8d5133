"""`ffrobot optimise`: optima in closed form, prices of limits, catalogues, failing designs, going on, Pareto fronts."""

import tomllib
from copy import deepcopy

import numpy as np
import pytest
import small_robots
from small_robots import BEAM, CANTILEVER, FORCE, FREE, RHO, E, L, rows

import ffrobot as library
from ffrobot import optimise, trade_off, uncertainty

J = 0.05 + 2.0 * 0.3**2  # of the arm about its joint
(SHOULDER,) = small_robots.ARM["joint"]
ARM = small_robots.ARM | {
    "gravity": [0.0, 0.0],
    "joint": [SHOULDER | {"gear_ratio": 50.0, "rotor_inertia": 2e-5}],
    "payload": [],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": 0.1}],
}
MOTOR = "peak joints.shoulder.motor_moment"
RATIO = "joint.shoulder.gear_ratio"

DEFLECTION = 1e-3
HEIGHT, WIDTH = (f"links.beam.geometry.section.{key}" for key in ("height", "width"))
TIP = "peak points.beam.tip.deflection"
W = BEAM["geometry"]["section"]["width"]


def deflection(height, width=W):
    return 4.0 * FORCE * L**3 / (E * width * height**3)


CATALOG = """name, rated_torque, peak_torque, max_speed, rotor_inertia, gear_ratio, mass, cost
tiny, 0.002, 0.006, 300, 1e-7, 50 100 200, 0.05, 90
weak, 0.008, 0.04, 25, 2e-6, 20 50 100, 0.1, 40
slow, 0.030, 0.08, 9, 5e-6, 10 20 50, 0.2, 20
good, 0.020, 0.06, 60, 4e-6, 20 50 100, 0.3, 60
best, 0.200, 0.60, 60, 2e-5, 20 50 100, 0.9, 30
"""
SPEED = 0.4  # rad/s at the end of ARM's motion, whose acceleration is 2 rad/s^2


def choices_by_hand(lever=0.0):
    """The largest share, motor, ratio, mass, cost: torque α ((J + m l²)/N + J_m N) at all times, speed N ω at the end.

    The motor's mass m is carried by the joint on a lever l, m.
    """
    for line in CATALOG.splitlines()[1:]:
        name, rated, _, fastest, rotor, ratios, mass, cost = (cell.strip() for cell in line.split(","))
        for N in map(float, ratios.split()):
            torque = 2.0 * ((J + float(mass) * lever**2) / N + float(rotor) * N)
            yield max(torque / float(rated), N * SPEED / float(fastest)), name, N, float(mass), float(cost)


@pytest.mark.parametrize(
    ("what", "column"),
    [*(pytest.param(*of, marks=pytest.mark.nightly) for of in (("mass", 3), ("cost", 4))), ("share", 0)],
)
def test_a_motor_from_a_catalog(write, tmp_path, what, column):
    """The lightest, cheapest or least used motor of those that are strong and fast enough."""
    (tmp_path / "motors.csv").write_text(CATALOG)
    scene = deepcopy(ARM)
    scene["analysis"][0]["output_step"] = 0.02
    found = optimise(write(scene), [f"motor shoulder in {tmp_path / 'motors.csv'}"], minimise=f"motors {what}")
    fitting = [one for one in choices_by_hand() if one[0] <= 1.0]
    assert {one[1] for one in fitting} == {"slow", "good", "best"}
    best = min(fitting, key=lambda one: one[column])
    assert found.feasible
    assert found.value == pytest.approx(best[column], rel=1e-6)
    same = [one for one in fitting if one[column] == best[column]]
    motor = next(line for line in found.remarks() if line.startswith("motor"))
    assert any(motor == f"motor      shoulder: {one[1]}, 1:{one[2]:g}" for one in same)
    assert found.limits[0] == pytest.approx(next(one[0] for one in same if motor.endswith(f":{one[2]:g}")), rel=1e-6)
    joint = tomllib.loads(found.best_scene.read_text())["joint"][0] if found.best_scene else None
    assert joint is None or joint["speed_limit"] >= SPEED


def test_the_mass_of_a_motor_loads_the_joint_before_it(write, tmp_path):
    """A motor at the tip that its own shoulder swings: J + m L²; its torque is what is needed for that."""
    (tmp_path / "motors.csv").write_text(CATALOG)
    scene = deepcopy(ARM) | {"payload": [{"point": "arm.tip", "mass": 0.5}]}
    scene["analysis"][0]["output_step"] = 0.02
    vary = [f"motor shoulder, payload.0.mass in {tmp_path / 'motors.csv'}"]
    found = optimise(write(scene), vary, minimise="motors share")
    assert found.value == pytest.approx(min(share for share, *_ in choices_by_hand(lever=0.6)), rel=1e-6)


@pytest.mark.parametrize("method", ["slsqp", "trust-constr"])
def test_gear_ratio_of_matched_inertias(write, method):
    """Of a motor with inertia J_m behind a gear, α (J/N + J_m N) is least at N = √(J/J_m): 2 α √(J J_m)."""
    found = optimise(write(ARM), [f"{RATIO}=20:500:log"], minimise=MOTOR, method=method)
    assert found.values[0] == pytest.approx(np.sqrt(J / 2e-5), rel=1e-4)
    assert found.value == pytest.approx(2.0 * 2.0 * np.sqrt(J * 2e-5), rel=1e-8)
    assert found.converged
    assert found.start.values[0] == pytest.approx(2.0 * (J / 50.0 + 2e-5 * 50.0), rel=1e-9)
    assert not np.isfinite(found.bound_prices).any()


@pytest.mark.parametrize("method", ["slsqp", "enumeration"])
def test_limits_below_zero(write, method):
    """The lightest mass whose weight is behind a moment of −M: m = M/(9.81 · 0.3), ∂m/∂bound = −1/(9.81 · 0.3).

    The scene's own moment, −5.886 N m, is beyond the limit; more mass is within it.
    """
    scene = ARM | {"gravity": [0.0, -9.81]}
    scene["trajectory"] = [{"name": "swing", "joint": "shoulder", "value": "pi"}]  # the arm points to −x
    found = optimise(
        write(scene),
        ["body.arm.rigid.mass=1:4" if method == "slsqp" else "body.arm.rigid.mass in {1.5, 2.5, 2.8, 3.5}"],
        minimise="mass",
        subject_to=["at 0.1 joints.shoulder.moment <= -8", "at 0.1 joints.shoulder.moment >= -12"],
    )
    least = 8.0 / (9.81 * 0.3)
    assert found.feasible
    if method == "slsqp":
        assert found.value == pytest.approx(least, rel=2e-6)
        assert found.prices[0] == pytest.approx(-1.0 / (9.81 * 0.3), rel=1e-4)
    else:
        assert found.value == 2.8


def test_a_search_that_ends_at_a_design_that_fails_keeps_its_best(write, tmp_path):
    """A controller that fails on short ways: trust-constr ends there, after designs that are better than the start."""
    (tmp_path / "short.py").write_text(
        """import numpy as np

def controller(setup):
    if setup.reference[-1, 0] < 0.4:
        raise ValueError("too short")
    return lambda k, y: np.zeros(len(setup.inputs))
"""
    )
    loop = {
        "name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.05,
        "controller": [{"kind": "python", "python": "short.py:controller"}], "sensor": [{"joint": "shoulder"}],
    }  # fmt: skip
    path = {"name": "swing", "joint": "shoulder", "via": [0.0, 0.5], "duration": 0.2}
    scene = ARM | {"gravity": [0.0, 0.0], "trajectory": [path], "analysis": [*ARM["analysis"], loop]}
    found = optimise(
        write(scene), ["trajectory.swing.via.1=0.3:0.6"], minimise="peak inverse.joints.shoulder.moment",
        subject_to=["peak loop.joints.shoulder.coordinate <= 9"], method="trust-constr",
    )  # fmt: skip
    assert "ended at a design that fails" in found.message
    least = min(one.readings[0].value for one in found.tried if one.completed)
    assert found.value == least < 0.98 * found.start.readings[0].value


@pytest.mark.nightly
def test_catalogue_beside_a_number(write):
    """Of each rotor the best gear has 4 √(J J_m): the lightest rotor, with the gear between bounds found to 1e-4."""
    vary = ["joint.shoulder.rotor_inertia in {5e-5, 1e-5, 3e-5}", f"{RATIO}=20:500:log"]
    found = optimise(write(ARM), vary, minimise=MOTOR, seed=3)
    assert found.method == "differential-evolution"
    assert found.values[0] == 1e-5
    assert found.values[1] == pytest.approx(np.sqrt(J / 1e-5), rel=1e-4)


def test_places_of_patches(write, tmp_path):
    """Two patches where the largest voltage over a path is least: as `kind = "placement"` says of all pairs.

    Pairs whose first patch is in the right place are compared.
    """
    section = {"shape": "rectangle", "height": 0.004, "width": 0.03}
    link = BEAM | {"modes": FREE, "mesh": {"elements": 10}, "geometry": BEAM["geometry"] | {"section": section}}
    patches = {
        "body": "beam", "centers": [0.1, 0.4], "length": 0.1, "width": 0.025, "thickness": 0.75e-3, "modulus": 63e9,
        "d31": 110e-12, "structural": False,
    }  # fmt: skip
    placed = {"kind": "placement", "about": "inverse", "placement": {"body": "beam", "criterion": "voltage"}}
    scene = ARM | {
        "body": [{"name": "beam", "link": link}],
        "joint": [SHOULDER | {"between": ["ground", "beam.root"]}],
        "trajectory": [{"name": "tip", "point": "beam.tip", "y": "0.1*sin(2*pi*t)"}],
        "pzt": [patches],
        "analysis": [ARM["analysis"][0] | {"end": 0.5, "output_step": 0.01}, {"name": "placed", **placed}],
    }
    path = write(scene)
    with library.solve(path) as results:
        best, places = results["placed/placement/best/centers"], results["placed/placement/candidates"]
        voltage = results["placed/placement/best/value"]
    pairs = ", ".join(f"{a}:{b}" for a in places for b in places if b - a > 0.0999 and a == best[0])
    found = optimise(
        path, [f"pzt.beam.centers.0,pzt.beam.centers.1 in {{{pairs}}}"],
        minimise="peak pzt.beam.required_voltage",
    )  # fmt: skip
    assert found.values == pytest.approx(best)
    assert found.value == pytest.approx(-float(voltage), rel=1e-3)  # the criterion, to be largest, is that of outputs


def test_starts(write):
    """The moment J x s̈ + m g c cos(x s) at a time of the path to x has minima near x s = π and, lower, 3π.

    From the scene the first one is found, from a Latin hypercube the second: sin(x s) = J s̈/(m g c s).
    """
    scene = deepcopy(ARM) | {"gravity": [0.0, -9.81]}
    scene["joint"][0]["rotor_inertia"] = 0.0
    del scene["trajectory"][0]["value"]
    scene["trajectory"][0] |= {"via": [0.0, 2.5], "duration": 2.0, "smoothness": 2}
    scene["analysis"][0] |= {"end": 2.0, "output_step": 0.2}
    response, vary = "at 1.6 joints.shoulder.moment", ["trajectory.swing.via.1=1:12"]
    s, acceleration, weight = 0.94208, -1.44, 2.0 * 9.81 * 0.3
    tilt = np.arcsin(-J * acceleration / (weight * s))
    found = optimise(write(scene), vary, minimise=response, starts=2, seed=2)
    assert found.space.point(found.searches[0].best.place)[0] == pytest.approx((np.pi + tilt) / s, rel=1e-4)
    x = (3.0 * np.pi + tilt) / s
    assert found.values[0] == pytest.approx(x, rel=1e-4)
    assert found.value == pytest.approx(J * acceleration * x + weight * np.cos(x * s), rel=1e-8)
    assert len(found.searches) == 2


def test_the_lightest_cantilever_is_found_at_the_second_go(ffrobot, write):
    """w h³ ≥ a = 4 F L³/(E δ): h as high as it may be, and w = a/h³: m = ρ L a/h², ∂m/∂δ = −m/δ, ∂m/∂h = −2 m/h.

    What was stopped is taken up: no run is made twice. The best design is a scene of its own.
    """
    scene = write(CANTILEVER)
    vary = [f"{HEIGHT}=0.01:0.04", f"{WIDTH}=0.002:0.05"]
    limits = [f"{TIP} <= {DEFLECTION}", "frequency 1 beam >= 10"]
    options = [word for one in vary for word in ("--vary", one)]
    options += [word for one in limits for word in ("--subject-to", one)]
    folder = scene.with_suffix(".optimum")
    stopped = ffrobot("optimise", scene, "--minimise", "mass", *options, "--runs", 8)
    assert "ended after" in stopped.stdout
    done = {path: path.stat().st_mtime_ns for path in folder.glob("runs/*/row.json")}
    assert len(done) <= 8
    found = optimise(scene, vary, folder, minimise="mass", subject_to=limits)
    assert {path: path.stat().st_mtime_ns for path in done} == done
    a, h = 4.0 * FORCE * L**3 / (E * DEFLECTION), 0.04
    mass = RHO * L * a / h**2
    np.testing.assert_allclose(found.values, [h, a / h**3], rtol=1e-6)
    assert found.value == pytest.approx(mass, rel=1e-6)
    assert found.limits[0] <= DEFLECTION * (1.0 + 1e-6)
    assert found.feasible
    assert found.converged
    assert found.prices[0] == pytest.approx(-mass / DEFLECTION, rel=1e-4)
    assert np.isnan(found.prices[1])
    assert found.bound_prices[0] == pytest.approx(-2.0 * mass / h, rel=1e-4)
    text = str(found)
    assert f"{TIP}: 0.00101 m instead of 0.001 saves {0.01 * mass:.4g} kg (1 %)" in text
    assert f"{HEIGHT}: 0.0404 instead of 0.04 saves {0.02 * mass:.4g} kg (2 %)" in text
    assert "inverse" not in text
    assert "still: completed" in text
    designs = rows(folder / "designs.csv")
    assert {row["status"] for row in designs} == {"completed"}
    best = min((row for row in designs if float(row["violation"]) <= 1e-6), key=lambda row: float(row["mass"]))
    link = tomllib.loads((folder / "best" / "scene.toml").read_text(encoding="utf-8"))["body"][0]["link"]
    assert link["geometry"]["section"]["width"] == pytest.approx(float(best[WIDTH]), rel=1e-6)
    assert ffrobot("solve", folder / "best" / "scene.toml").returncode == 0


def test_no_design_keeps_the_limits(ffrobot, write):
    scene = write(CANTILEVER)
    arguments = "optimise", scene, "--minimise", "mass", "--subject-to", f"{TIP} <= 1e-5"
    search = ffrobot(*arguments, "--vary", f"{WIDTH}=0.01:0.03", "--output", scene.parent / "search")
    assert search.returncode == 1
    assert "; the best of the designs that were tried" in search.stdout
    done = ffrobot(*arguments, "--vary", f"{WIDTH} in {{0.01, 0.03}}")
    assert done.returncode == 1
    assert "no design found that keeps all limits" in done.stderr
    assert f"exceeded by {100 * (deflection(0.02, 0.03) / 1e-5 - 1):.3g} %" in done.stdout


def test_evolution_keeps_limits_and_tells_the_best_of_all_designs_when_runs_end(write):
    """The lightest rotor whose gear keeps the moment below the limit; the search that follows is cut short."""
    vary = ["joint.shoulder.rotor_inertia in {5e-5, 1e-5, 3e-5}", f"{RATIO}=20:500:log"]
    bound = 1.2 * 4.0 * np.sqrt(J * 1e-5)
    found = optimise(
        write(ARM), vary, minimise="value joint.shoulder.gear_ratio", subject_to=[f"{MOTOR} <= {bound}"],
        method="differential-evolution", runs=40, seed=3,
    )  # fmt: skip
    assert found.runs <= 40
    kept = [one for one in found.tried if one.completed and found.problem.violation(one.readings) <= 1e-6]
    assert 0 < len(kept) < len(found.tried)
    assert found.value == min(one.values[0] for one in kept)
    none = optimise(write(ARM), vary, minimise="mass", subject_to=[f"{MOTOR} <= 1e-9"], runs=17)
    assert (none.method, none.feasible) == ("differential-evolution", False)  # in no generation


OMEGA = np.pi / 6e-4  # rad/s
JOLT = f"where(t < 0.1001, 0, where(t < 0.1007, 1e-6*sin({OMEGA}*(t - 0.1001))**4, 0))"
JOLTED = ARM | {
    "trajectory": [{"name": "swing", "joint": "shoulder", "value": JOLT}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 0.12, "output_step": 1e-3}],
}
MOST = 4e-6 * OMEGA**2  # of |α| = A ω² |12 sin² φ − 16 sin⁴ φ|, between the outputs at 0.1 and 0.101 s


def test_peaks_between_outputs_count(write):
    """The torque (J / N + J_m N) α is least at N = √(J / J_m); its power."""
    path = write(JOLTED)
    found = optimise(path, [f"{RATIO}=20:400"], minimise=MOTOR)
    assert found.value == pytest.approx(2.0 * np.sqrt(J * 2e-5) * MOST, rel=1e-3)
    (note,) = (line for line in str(found).splitlines() if MOTOR in line and line.startswith("note"))
    assert f"near outputs, {found.value:.6g} between them, which counts" in note
    power = optimise(path, [f"{RATIO} in {{50}}"], minimise="peak joints.shoulder.power")
    sine, cosine = np.sin(x := np.linspace(0.0, np.pi, 10001)), np.cos(x)
    of_power = (12 * sine**2 - 16 * sine**4) * 4 * sine**3 * cosine
    expected = (J + 2e-5 * 50.0**2) * 1e-12 * OMEGA**3 * np.abs(of_power).max()
    assert power.value == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("how", [{"by": "gradients"}, pytest.param({"samples": 8}, marks=pytest.mark.nightly)])
def test_spreads_of_peaks_between_outputs(write, how):
    """Of that torque by an uncertain rotor, in which it is linear."""
    found = uncertainty(write(JOLTED), [MOTOR], ["joint.shoulder.rotor_inertia=normal:10%"], **how)
    assert found.statistics.mean[0] == pytest.approx((J / 50 + 2e-5 * 50) * MOST, rel=5e-3)
    assert found.statistics.deviation[0] == pytest.approx(0.1 * 2e-5 * 50 * MOST, rel=0.15)
    assert "between them, which counts" in found.notes[0]


RANGE = f"{HEIGHT}=0.01:0.04:log"


def test_mass_against_deflection_is_a_power_law(write):
    """m = ρ L w (4 F L³/(E w δ))^⅓ from one bound of the height to the other, δ in equal ratios; ∂m/∂δ = −m/(3 δ)."""
    found = trade_off(write(CANTILEVER), [RANGE], minimise="mass", against=TIP, points=3)
    mass, tip = found.values.T
    np.testing.assert_allclose(tip, np.geomspace(deflection(0.01), deflection(0.04), 3), rtol=1e-6)
    np.testing.assert_allclose(mass, RHO * L * W * (4.0 * FORCE * L**3 / (E * W * tip)) ** (1 / 3), rtol=1e-6)
    for one in found.points[1:-1]:
        assert one.price == pytest.approx(-one.response / (3.0 * one.against), rel=1e-4)
    assert all(one.converged and one.feasible for one in found.points)
    assert found.units == ("kg", "m")
    curve, designs = found.study().diagrams
    np.testing.assert_allclose([curve.x, curve.y], [tip, mass], rtol=1e-14)
    axes = {axis.label: axis.values for axis in designs.axes}
    assert list(axes) == [HEIGHT, "mass (kg)", f"{TIP} (m)"]
    np.testing.assert_allclose(axes[f"{TIP} (m)"], [deflection(h) for h in axes[HEIGHT]], rtol=1e-6)
    best = [value for value, state in zip(axes["mass (kg)"], designs.states, strict=True) if state == "best"]
    np.testing.assert_allclose(sorted(best), sorted(mass), rtol=1e-14)


def test_responses_that_go_together(write):
    with pytest.raises(library.InputError, match="expected responses with different optima"):
        trade_off(write(CANTILEVER), [RANGE], minimise="mass", against="mass beam", points=3)
