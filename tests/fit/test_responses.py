"""`ffrobot fit --frf`: parameters from FRFs that closed forms and an assembly in NumPy have made."""

import copy
import tomllib

import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, tube
from rigid_chain import ARM, TOOL, receptance, scene
from scipy.io import savemat
from scipy.linalg import eigh
from scipy.optimize import brentq
from tables_3d import joint, pin, planar

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.fit.frf import fit_receptances, unstacked
from ffrobot.fit.frf_measured import Direction, MeasuredPose, ResponseTest, read_tests

LINES = np.linspace(2.0, 60.0, 200)  # Hz
CHAIN = np.array([4e4, 3e4, 2e4, 8.0, 6.0, 4.0, 1.0])  # springs (N/m), dampers (N·s/m) from the wall on, last mass
CHAIN_KEYS = ["k1", "k2", "k3", "c1", "c2", "c3", "m3"]


def chain(values):
    """Three masses in a row."""
    of = [np.array([[a + b, -b, 0], [-b, b + c, -c], [0, -c, c]]) for a, b, c in (values[:3], values[3:6])]
    return np.vstack([np.diag([2.0, 1.5, values[6]]), *of, np.eye(3)])


def continued(values, w):
    """Receptances of all masses by a force on the first one, by continued fractions: Z_k = z_k + b_k − b²/Z_(k+1)."""
    b = values[:3, None] + 1j * w * values[3:6, None]
    third = b[2] - w**2 * values[6]
    second = b[1] + b[2] - w**2 * 1.5 - b[2] ** 2 / third
    first = 1.0 / (b[0] + b[1] - w**2 * 2.0 - b[1] ** 2 / second)
    return np.stack([first, first * b[1] / second, first * b[1] * b[2] / (second * third)], axis=1)


def measured(H, lines=LINES, coherence=np.nan, **keys):
    """FRFs (F, p) from the first point to all."""
    places = [Direction(f"m{k}.p", (1.0, 0.0, 0.0)) for k in range(H.shape[1])]
    test = ResponseTest.model_construct(name="chain", validation=False, averages=None, pose={}).model_copy(update=keys)
    return MeasuredPose(test, lines, places[:1] * H.shape[1], places, H, np.full(H.shape, coherence))


@pytest.mark.parametrize("averages", [None, 50])
def test_three_masses_with_noise_are_within_three_deviations(averages):
    """95 of 100 draws at least. With the coherence of this noise, σ² = (1 − γ²)/(2 n γ²), deviations are known."""
    rng, exact = np.random.default_rng(63), continued(CHAIN, 2 * np.pi * LINES)
    start = CHAIN * np.exp([0.2, -0.2, 0.15, 0.4, -0.4, 0.3, 0.2])
    sigma = 0.02 / np.sqrt(2.0)  # of the real part and of the imaginary part
    coherence = np.nan if averages is None else 1.0 / (1.0 + 2.0 * averages * sigma**2)
    draws, off = (100 if averages is None else 20), []
    for _ in range(draws):
        noise = sigma * (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape))
        pose = measured(exact * (1.0 + noise), coherence=coherence, averages=averages)
        fit = fit_receptances(lambda x: [chain(x)], CHAIN_KEYS, start, [pose])
        off.append((fit.value - CHAIN) / fit.deviation)
    off = np.array(off)
    assert np.count_nonzero(np.abs(off).max(axis=1) < 3.0) >= 0.95 * draws
    assert 0.85 < np.sqrt(np.mean(off**2)) < 1.15


def loaded(values):
    """A mass on two modes, the second stiff, in coordinates that it uncouples."""
    mass, damper = values
    squares, V = eigh(np.diag([1e4, 1e9]), np.eye(2) + mass)
    return np.vstack([np.eye(2), np.diag(squares), damper * V.T @ V, V[:1] + V[1:]])


def test_deviations_do_not_depend_on_the_start():
    M, K, D, J = unstacked(loaded(np.array([1.0, 3.0])))
    w, noise = 2 * np.pi * LINES[:, None, None], np.random.default_rng(5).standard_normal((2, len(LINES), 1))
    H = (J @ np.linalg.inv(K + 1j * w * D - w**2 * M) @ J.T)[:, :, 0] * (1.0 + 0.02 * (noise[0] + 1j * noise[1]))
    starts = np.array([[0.9, 2.0], [0.2, 9.0]])
    fits = [fit_receptances(lambda x: [loaded(x)], ["m", "c"], start, [measured(H)]) for start in starts]
    for name in ("value", "relative_deviation"):
        np.testing.assert_allclose(*(getattr(fit, name) for fit in fits), rtol=1e-4)


@pytest.mark.parametrize("keys", [{"coherence": 0.9}, {"coherence": 0.9, "averages": 5}])
def test_deviations_of_some_tests_alone_are_refused(keys):
    """Others would count as if their FRFs were known to a factor of e."""
    tests = measured(np.ones((len(LINES), 1)), **keys), measured(np.ones((len(LINES), 1)))
    with pytest.raises(InputError, match="expected coherence, and averages, of all"):
        fit_receptances(lambda x: [loaded(x)] * 2, ["m", "c"], np.ones(2), tests)


def block(k, d, m, J):
    return np.vstack([np.diag(m), np.diag(k), np.diag(d), np.array(J)])


TOGETHER = r"k1 times c\S*, k2 times"
NOT_SEEN = {
    "a mass that no force moves": (lambda x: block(x, [1.0, 1.0], [1.0, 1.0], [[1.0, 0.0]]), (1e4, 2e4), r"found k2:"),
    "springs in parallel": (lambda x: block([x[0] + x[1]], [1.0], [1.0], [[1.0]]), (1e4, 3e4), TOGETHER),
    "springs in series": (
        lambda x: block([1.0 / (1.0 / x[0] + 1.0 / x[1])], [1.0], [1.0], [[1.0]]), (2e4, 3e4), TOGETHER,
    ),
    "masses on one body": (lambda x: block([1e4], [1.0], [x[0] + x[1]], [[1.0]]), (1.0, 0.5), TOGETHER),
    "a damper and a spring where no line has motion": (
        lambda x: block([1e4, x[0]], [1.0, x[1]], [1.0, 1.0], [[1.0, 0.0]]), (2e4, 3.0), r"found k1:",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", NOT_SEEN)
def test_parameters_that_tests_do_not_see_are_named(case):
    equations, truth, expected = NOT_SEEN[case]
    M, K, D, J = unstacked(equations(np.array(truth)))
    w = 2 * np.pi * LINES[:, None, None]
    H = J @ np.linalg.inv(K + 1j * w * D - w**2 * M) @ J.T
    with pytest.raises(InputError, match=f"measured FRFs .*{expected}"):
        fit_receptances(lambda x: [equations(x)], ["k1", "k2"], 1.1 * np.array(truth), [measured(H[:, :, 0])])


def write_table(path, lines, columns):
    """The CSV table of FRFs (F,) by the texts of their ends."""
    rows = ["frequency,force,response,real,imaginary"]
    for (force, response), H in columns.items():
        pairs = zip(lines.tolist(), H.tolist(), strict=True)
        rows += [f"{f!r},{force},{response},{h.real!r},{h.imag!r}" for f, h in pairs]
    path.write_text("\n".join(rows))


POSES = [[0.0, 0.0, 0.2, -0.4, 0.9, 0.3, 0.5, 0.1], [0.0, 0.0, -0.5, 0.1, 0.3, -0.4, 0.8, 0.2]]


def robot_tests(folder, start, lines=60):
    """Files of the arm in `POSES`, the last for validation, and of a scene with `start`."""
    frequency, tests = np.linspace(3.0, 100.0, lines), []
    for k, pose in enumerate(POSES):
        H = receptance(ARM, np.array(pose), np.array(TOOL), frequency) * -((2 * np.pi * frequency[:, None, None]) ** 2)
        ends = {(f"tool/{'xyz'[j]}", f"tool/{'xyz'[i]}"): H[:, i, j] for i, j in np.ndindex(3, 3)}
        write_table(folder / f"pose{k}.csv", frequency, ends)
        joints = {joint.name: float(q) for joint, q in zip(ARM, pose, strict=True)}
        tests.append({
            "name": f"pose {k}", "file": f"pose{k}.csv", "unit": "m/s²/N", "points": {"tool": "body7.end"},
            "pose": {"joints": joints}, "validation": k == len(POSES) - 1,
        })  # fmt: skip
    (folder / "hammer.toml").write_text(tomli_w.dumps({"test": tests}))
    (folder / "arm.toml").write_text(tomli_w.dumps(scene(start, TOOL, POSES[0])))
    return folder / "arm.toml", folder / "hammer.toml"


def test_arm_assembled_in_numpy_is_found_again(tmp_path):
    """Springs and dampers of joints and of the plate below, to 1e-6; a pose that was not fitted has FRAC 1."""
    start, keys = copy.deepcopy(ARM), []
    for of, k, d in zip(start, (1.2, 0.85, 1.15, 0.9, 1.25, 0.8, 1.3, 0.75), (0.7, 1.3) * 4, strict=True):
        if of.name in ("tilt_x", "waist", "elbow", "pitch"):
            of.k, of.d = k * of.k, d * of.d
            keys += [f"joint.{of.name}.stiffness", f"joint.{of.name}.damping"]
    fit = ffrobot.fit_responses(*robot_tests(tmp_path, start), keys)
    truth = [value for joint in ARM if f"joint.{joint.name}.damping" in keys for value in (joint.k, joint.d)]
    np.testing.assert_allclose(fit.value, truth, rtol=1e-6)
    assert fit.poses[1].pose.test.validation
    assert fit.poses[1].frac.min() > 1.0 - 1e-9
    assert len(fit.poses[1].frequency_error) > 1
    assert np.abs(fit.poses[1].frequency_error).max() < 1e-6
    joints = {joint["name"]: joint for joint in tomllib.loads((tmp_path / "arm.fitted.toml").read_text())["joint"]}
    assert joints["elbow"]["stiffness"] == pytest.approx(ARM[4].k, rel=1e-6)


def test_modulus_and_damping_of_a_link_from_the_modes_of_a_clamped_beam(tmp_path):
    """4/(ρAL) Σ 1/(ω_k² − ω² + 2iζω_kω) at the tip, with 1 + cos λ cosh λ = 0; a robot without motors."""
    E, rho, L, zeta = 70e9, 2700.0, 0.6, 0.006
    area, inertia = np.pi * (0.02**2 - 0.016**2) / 4, np.pi * (0.02**4 - 0.016**4) / 64
    guess = (np.arange(40) + 0.5) * np.pi
    roots = np.array([brentq(lambda x: 1 / np.cosh(x) + np.cos(x), x - 0.6, x + 0.6) for x in guess])
    modes = roots**2 * np.sqrt(E * inertia / (rho * area * L**4))
    lines = np.linspace(20.0, 900.0, 300)
    w = 2 * np.pi * lines[:, None]
    H = (4 / (rho * area * L) / (modes**2 - w**2 + 2j * zeta * modes * w)).sum(axis=1)
    write_table(tmp_path / "tip.csv", lines, {("arm.tip/y", "arm.tip/y"): H})
    (tmp_path / "tests.toml").write_text(tomli_w.dumps({"test": [{"name": "tip", "file": "tip.csv", "unit": "m/N"}]}))
    link = beam_link(L, tube(0.02, 0.016), 20, nu=None, name="arm", modes={"count": 6, "family": "in-plane-bending"})
    link["material"] = {"youngs_modulus": 60e9, "density": rho}
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(link | {"damping": {"ratio": 0.004}}))
    clamp, rest = joint("clamp", "weld", "ground", "arm.root"), {"name": "rest", "kind": "static"}
    beam = planar([{"name": "arm", "link": "arm.toml"}], [clamp], rest, gravity=(0.0, 0.0))
    (tmp_path / "beam.toml").write_text(tomli_w.dumps(beam))
    keys = ["links.arm.material.youngs_modulus", "links.arm.damping.ratio"]
    fit = ffrobot.fit_responses(tmp_path / "beam.toml", tmp_path / "tests.toml", keys)
    np.testing.assert_allclose(fit.value, [E, zeta], rtol=1e-4)  # elements and modes leave 1e-5


def arm_in_gravity(folder, stiffness, damping):
    """A scene, and FRFs of J²/(k − m g c sin q − I ω² + iωd) with k (q − q₀) = −m g c cos q, k = 300 and d = 2."""
    mass, center, inertia, length, lines = 8.0, 0.4, 0.3 + 8.0 * 0.4**2, 0.7, np.linspace(0.8, 8.0, 60)
    torque, w, tests = mass * 9.81 * center, 2 * np.pi * lines, []
    for k, start in enumerate((-1.1, 0.9)):
        q = brentq(lambda q, start=start: 300.0 * (q - start) + torque * np.cos(q), start - 1.0, start + 0.1)
        H = (length * np.cos(q)) ** 2 / (300.0 - torque * np.sin(q) - inertia * w**2 + 2j * w)
        write_table(folder / f"{k}.csv", lines, {("arm.tip/y", "arm.tip/-y"): -H})
        tests.append({"name": f"{k}", "file": f"{k}.csv", "unit": "m/N", "pose": {"joints": {"a": start}}})
    (folder / "tests.toml").write_text(tomli_w.dumps({"test": tests}))
    points = {"root": [0.0, 0.0], "tip": [length, 0.0]}
    rigid = {"mass": mass, "center": [center, 0.0], "inertia": 0.3, "points": points}
    hinge = pin("a", "ground", "arm.root", rotor_inertia=1e-3, stiffness=stiffness, damping=damping)
    arm = planar([{"name": "arm", "rigid": rigid}], [hinge], {"name": "rest", "kind": "static"})
    (folder / "arm.toml").write_text(tomli_w.dumps(arm))
    return folder / "arm.toml", folder / "tests.toml"


@pytest.mark.parametrize("start", [(1e6, 1.0), (1e3, 1e-3), (1e3, 1e4)])
def test_arm_in_gravity_from_far_starts(tmp_path, start):
    """Small damping has hardly an effect at the start, and the whole effect at the peaks that are fitted."""
    fit = ffrobot.fit_responses(*arm_in_gravity(tmp_path, *start), ["joint.a.stiffness", "joint.a.damping"])
    np.testing.assert_allclose(fit.value, [300.0, 2.0], rtol=1e-6)


def test_payload_from_a_mobility(tmp_path):
    """iω l²/(k − (I + m l²) ω² + iωd) with m = 2.5 kg, in mm/s/N."""
    files, w = arm_in_gravity(tmp_path, 400.0, 3.0), 2 * np.pi * np.linspace(0.5, 8.0, 60)
    scene = tomllib.loads(files[0].read_text())
    payload = [{"point": "arm.tip", "mass": 1.0}]
    files[0].write_text(tomli_w.dumps(scene | {"gravity": [0.0, 0.0], "payload": payload}))
    H = 1e3j * w * 0.7**2 / (300.0 - (0.3 + 8.0 * 0.4**2 + 2.5 * 0.7**2) * w**2 + 2j * w)
    write_table(tmp_path / "0.csv", w / (2 * np.pi), {("arm.tip/y", "arm.tip/y"): H})
    files[1].write_text(tomli_w.dumps({"test": [{"name": "one", "file": "0.csv", "unit": "mm/s/N"}]}))
    fit = ffrobot.fit_responses(*files, ["joint.a.stiffness", "joint.a.damping", "payload.0.mass"])
    np.testing.assert_allclose(fit.value, [300.0, 2.0, 2.5], rtol=1e-6)


def test_frfs_without_motion_and_keys_that_are_there_twice(tmp_path):
    files = arm_in_gravity(tmp_path, 1e3, 1.0)
    with pytest.raises(InputError, match=r"every key once, found joint\.a\.stiffness several"):
        ffrobot.fit_responses(*files, ["joint.a.stiffness", "joint.a.damping=joint.a.stiffness"])
    with pytest.raises(InputError, match="at least one key, found none"):
        ffrobot.fit_responses(*files, [])
    with pytest.raises(InputError, match='motors: expected "free" or "locked", found "loose"'):
        ffrobot.fit_responses(*files, ["joint.a.stiffness"], motors="loose")
    table = tmp_path / "0.csv"
    table.write_text(table.read_text().replace("/y", "/z"))
    with pytest.raises(InputError, match=r'test "0": arm.tip z → arm.tip -y: expected an FRF of directions'):
        ffrobot.fit_responses(*files, ["joint.a.stiffness"])


def universal(path, H, lines, ends, kind=12, **keys):
    pyuff = pytest.importorskip("pyuff")
    data = {
        "type": 58, "func_type": 4, "load_case_id": 0, "abscissa_spec_data_type": 18, "ordinate_spec_data_type": kind,
        "orddenom_spec_data_type": 13, "binary": 0, "abscissa_axis_lab": "Frequency", "id1": "hammer",
    }  # fmt: skip
    sets, half = [], keys.pop("coherence", 0)
    for (force, response), h in zip(ends, H.T, strict=True):
        nodes = {"ref_node": force[0], "ref_dir": force[1], "rsp_node": response[0], "rsp_dir": response[1]}
        sets.append(data | nodes | {"x": lines, "data": h} | keys)
    if half:
        sets.append(sets[-1] | {"func_type": 6, "x": lines[:half], "data": np.full(half, 0.9)})
    if length := keys.get("length"):
        sets.insert(0, {"type": 164, "units_code": 9, "length": length, "force": 1.0, "temp": 1.0, "temp_offset": 0.0})
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def table(**keys):
    return tomli_w.dumps({"test": [{"name": "one", "points": {"1": "a.p", "2": "b.p"}} | keys]})


def test_files_of_three_kinds_have_the_same_frfs(tmp_path):
    lines = np.linspace(1.0, 20.0, 39)
    H = continued(CHAIN, 2 * np.pi * lines)[:, :2] * -((2 * np.pi * lines[:, None]) ** 2)
    universal(tmp_path / "a.uff", H, lines, [((1, 3), (1, 3)), ((1, 3), (2, -1))])
    ends = {"force": ["1/z", "1/z"], "response": ["1/z", "2/-x"]}
    padded = {name: np.array(texts) for name, texts in ends.items()}  # with blanks, as char arrays have them
    savemat(tmp_path / "b.mat", {"frequency": lines, "H": H / 9.80665} | padded)
    write_table(tmp_path / "c.csv", lines, {("1/z", to): of for to, of in zip(("1/z", "2/-x"), H.T, strict=True)})
    for name, unit in (("a.uff", {}), ("b.mat", {"unit": "g/N"}), ("c.csv", {"unit": "m/s²/N"})):
        (tmp_path / "tests.toml").write_text(table(file=name, band=[2.0, 15.0], **unit))
        (pose,) = read_tests(tmp_path / "tests.toml")
        inside = (lines >= 2.0) & (lines <= 15.0)
        np.testing.assert_allclose(pose.frequency, lines[inside])
        np.testing.assert_allclose(pose.receptance, continued(CHAIN, 2 * np.pi * lines[inside])[:, :2], rtol=1e-6)
        assert pose.labels == ["a.p z → a.p z", "a.p z → b.p -x"]


HEADER = "frequency,force,response,real,imaginary,coherence\n"
BAD = {
    "UFF of time histories": ({"func_type": 1}, {}, "expected frequency response functions"),
    "UFF of strains": ({"kind": 3}, {}, r"data types 8, 11, 12\) per force \(13\), found types 3 and 13"),
    "UFF of rotations": ({"axis": 4}, {}, "expected translations .*, found 4"),
    "UFF in g": ({"ordinate_axis_units_lab": "g"}, {}, "expected the key unit of the test"),
    "UFF per lbf": ({"orddenom_axis_units_lab": "lbf"}, {}, "expected the key unit of the test"),
    "half a coherence": ({"coherence": 10}, {}, "expected the frequencies of the other functions"),
    "UFF in mm": ({"length": 1000.0}, {}, "expected the key unit of the test"),
    "another quantity": ({}, {"unit": "m/N"}, 'unit: expected that of the file, "m/s²/N", .* or "g/N", found "m/N"'),
    "an unknown unit": ({}, {"unit": "ft/s²/lbf"}, 'unit: expected "m/N"'),
    "frequency 0": ({"first": 0.0}, {}, "expected frequencies above 0 Hz, found 0: the key band"),
    "no frequency": ({}, {"band": [900.0, 950.0]}, "band: expected frequencies of the file within it"),
    "a node without a point": ({"node": 1000007}, {}, 'points: expected the point of the robot for "1000007"'),
    "averages alone": ({}, {"averages": 5}, "averages: expected them with a coherence"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_refused(tmp_path, case):
    of_file, of_test, expected = BAD[case]
    of_file = dict(of_file)
    lines = of_file.pop("first", 1.0) + np.arange(20.0)
    data = continued(CHAIN, 2 * np.pi * (lines + 1.0))[:, :1]
    if of_file.get("func_type") == 1:
        data = data.real
    ends = [((of_file.pop("node", 1), of_file.pop("axis", 3)), (1, 3))]
    universal(tmp_path / "a.uff", data, lines, ends, **of_file)
    (tmp_path / "tests.toml").write_text(table(file="a.uff", **of_test))
    with pytest.raises(InputError, match=expected):
        read_tests(tmp_path / "tests.toml")


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ("5.0,1/x,1/x,1e-3,0.0,-0.1\n", "coherence: expected values from 0 to 1, found -0.1"),
        ("5.0,1/x,1/x,0.0,0.0,0.9\n", "finite values that are not 0"),
        ("5.0,1/q,1/x,1e-3,0.0,0.9\n", 'expected POINT/x, POINT/-z, …, found "1/q"'),
        ("5.0,1/x,1/x,one,0.0,0.9\n", 'line 2: expected a number, found "one"'),
        ("", "expected a line for each frequency of each function below line 1, found none"),
        ("5.0,1/x,1/x,1e-3\n", "line 2: expected 6 cells .*, as the header has, found 4"),
        ("5.0,1/x,1/x,1e-3,0.0,0.9\n6.0,1/x,1/x,2e-3,0.0,0.9\n", "expected complex values, found positive real ones"),
        ("5.0,1/x,1/x,1e-3,0.0,0.9\n" * 2, "expected each frequency once, in rising order"),
    ],
)
def test_bad_tables_are_refused(tmp_path, rows, expected):
    (tmp_path / "a.csv").write_text(HEADER + rows)
    (tmp_path / "tests.toml").write_text(table(file="a.csv", unit="g/N"))
    with pytest.raises(InputError, match=expected):
        read_tests(tmp_path / "tests.toml")


def test_files_of_other_kinds(tmp_path):
    """Each with one sentence of ours, without what a library says."""
    savemat(tmp_path / "none.mat", {"x": 1.0})
    three = {"frequency": np.arange(1.0, 4.0), "H": np.ones((3, 2)), "force": ["1/x", "1/x"]}
    savemat(tmp_path / "shape.mat", {**three, "response": ["1/x"]})
    savemat(tmp_path / "text.mat", {**three, "response": ["1/x", "1/x"], "frequency": "fast"})
    (tmp_path / "lacks.csv").write_text("frequency,force,response,real\n5.0,1/x,1/x,1e-3\n")
    (tmp_path / "twice.csv").write_text(HEADER.replace("imaginary", "real") + "5.0,1/x,1/x,1e-3,2e-3,0.9\n")
    for name in ("empty.csv", "empty.mat", "empty.uff"):
        (tmp_path / name).write_bytes(b"")
    for name in ("other.mat", "other.uff"):
        (tmp_path / name).write_bytes(b"of something else\n" * 30)
    for name, expected in {
        "lacks.csv": 'line 1: expected the columns .* found no "imaginary"',
        "twice.csv": "line 1: expected each column once, found 'frequency,force,response,real,real",
        "empty.csv": 'line 1: expected the columns .* found no "frequency", "force", "response", "real", "imaginary"',
        "empty.mat": r"expected a \.mat file of version 7 or older .*, found another file$",
        "other.mat": r"expected a \.mat file of version 7 or older .*, found another file$",
        "none.mat": 'found no "frequency", "H", "force", "response"$',
        "shape.mat": "found H of shape .3, 2. for 3 frequencies, 2 forces and 1 responses$",
        "text.mat": "expected numbers in frequency, H and coherence, and names in force and response, found others$",
        "empty.uff": "type 4 of dataset 58., found none$",
        "other.uff": "type 4 of dataset 58., found none$",
    }.items():
        if name.endswith("uff"):
            pytest.importorskip("pyuff")
        (tmp_path / "tests.toml").write_text(table(file=name, unit="g/N"))
        with pytest.raises(InputError, match=f"{name}: .*{expected}"):
            read_tests(tmp_path / "tests.toml")


def test_coherence_outside_the_band_does_not_count(tmp_path):
    (tmp_path / "a.csv").write_text(HEADER + "0.0,1/x,1/x,0.0,0.0,nan\n5.0,1/x,1/x,1e-3,0.0,0.9\n")
    (tmp_path / "tests.toml").write_text(table(file="a.csv", unit="m/N", band=[2.0, 9.0], averages=5))
    (pose,) = read_tests(tmp_path / "tests.toml")
    np.testing.assert_allclose(pose.deviation, [[np.sqrt(0.1 / (2 * 5 * 0.9))]])


def test_poses_and_points_that_the_robot_has_not(tmp_path):
    files = robot_tests(tmp_path, ARM, lines=3)
    text = files[1].read_text()
    without = {"test": [{key: of for key, of in one.items() if key != "pose"} for one in tomllib.loads(text)["test"]]}
    for wrong, expected in (
        (text.replace("waist", "wast"), r'hammer.toml: test "pose 0": pose:\n.*found "wast" \(did you mean "waist"'),
        (text.replace("body7.end", "body7.ned"), r'test "pose 0": expected one of .* found "body7.ned"'),
        (tomli_w.dumps(without), 'test "pose 0": pose: expected one for each of several tests'),
    ):
        files[1].write_text(wrong)
        with pytest.raises(InputError, match=expected):
            ffrobot.fit_responses(*files, ["joint.waist.stiffness"])
