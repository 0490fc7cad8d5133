"""`ffrobot export --format fmu`: what fmpy says of it, responses against scipy's exact ones, matrices, refusals."""

import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.validation import validate_fmu
from running_fmus import instance, running
from scipy.linalg import expm
from scipy.signal import lsim

from ffrobot import Results
from ffrobot.actuation.control.linear_model import LinearModel
from ffrobot.exchange.fmu.linear_fmu import make_unit

LINK = beam_link(
    0.6, rectangle(0.004, 0.02), 20, nu=None, name="arm", damping={"ratio": 0.005},
    modes={"count": 4, "family": "in-plane-bending"},
)  # fmt: skip
SCENE = """
name = "one arm"
gravity = [0.0, 0.0]
body = [{ name = "arm", link = "arm.toml" }]
joint = [{ name = "hub", type = "revolute", between = ["ground", "arm.root"], gear_ratio = 50.0, rotor_inertia = 2e-5 }]
payload = [{ point = "arm.tip", mass = 0.05 }]
trajectory = [{ name = "swing", joint = "hub", value = "sin(t)**2" }]
analysis = [
  { name = "at_rest", kind = "linear", sensor = [
    { joint = "hub", measure = "rate" }, { pzt = "arm" },
    { point = "arm.tip", measure = "accelerometer" }, { point = "arm.tip", measure = "gyro" },
  ] },
  { name = "inverse", kind = "pcid", end = 0.1, output_step = 0.01 },
  { name = "along", kind = "linear", about = "inverse", times = [0.0, 0.05] },
  { name = "loop", kind = "closed-loop", actuation = "inverse", sample_time = 1e-3, controller = [
    { kind = "joint-pid", proportional = { hub = 13.0 }, derivative = { hub = 2.0 }, integral = { hub = 5.0 } },
  ], disturbance = [{ point = "arm.tip", y = "0.1" }] },
]

[[pzt]]
body = "arm"
count = 2
allocation = "least-squares"
length = 0.06
width = 0.02
thickness = 0.5e-3
modulus = 63e9
d31 = 110e-12
"""
MOTOR, PATCH, FORCE, TIP = "joint/hub/moment", "pzt/arm/1", "force/arm.tip/y", "point/arm.tip/y"
SENSORS = {"joint/hub/rate": "rad/s", f"{TIP}/accelerometer": "m/s2", "point/arm.tip/z/gyro": "rad/s"}
STEP, COUNT = 1e-3, 400
EXACT = 1e-11  # of the largest value: rounding of COUNT steps


class Robot:
    """An exported FMU, unpacked, and the model that it is to be."""

    def __init__(self, folder, path):
        self.folder, self.path = folder, path
        self.model = Results(folder / "scene.results.h5").linear("at_rest")[0]
        self.description = read_model_description(str(path))
        self.unpacked = extract(str(path), str(folder / "unpacked"))
        self.reference = {each.name: each.valueReference for each in self.description.modelVariables}
        self.inputs = [f"{name}/moment" if name.startswith("joint/") else name for name in self.model.input_names]
        self.outputs = [f"measured {of}" if of.startswith("pzt/") else of for of in self.model.output_names]
        names = [each.name for each in self.description.modelVariables]
        f = len(self.model.A)
        self.states, self.derivatives = names[:f], names[f : 2 * f]

    def references(self, names):
        return [self.reference[name] for name in names]

    def running(self, kind=FMU2Slave):
        return running(self.description, self.unpacked, kind)

    def simulate(self, signals):
        """Outputs of co-simulation at steps, of inputs by name."""
        time = STEP * np.arange(len(next(iter(signals.values()))))
        table = np.zeros(len(time), dtype=[("time", float)] + [(name, float) for name in signals])
        table["time"] = time
        for name, values in signals.items():
            table[name] = values
        found = simulate_fmu(
            str(self.path), fmi_type="CoSimulation", start_time=0.0, stop_time=time[-1], output_interval=STEP,
            input=table, output=self.outputs,
        )  # fmt: skip
        return np.array([found[name] for name in self.outputs]).T

    def response(self, signals, *, linear):
        """What the model does with inputs on straight lines, or held until the instant of each output (scipy)."""
        model = self.model
        u = np.zeros((len(next(iter(signals.values()))), len(self.inputs)))
        for name, values in signals.items():
            u[:, self.inputs.index(name)] = values
        time = STEP * np.arange(len(u))
        felt = np.zeros_like(u) if linear else np.vstack([u[:1], u[:-1]]) - u
        return lsim((model.A, model.B, model.C, model.D), u, time, interp=linear)[1] + felt @ model.D.T


def signals(count=COUNT):
    time = STEP * np.arange(count)
    return {MOTOR: np.sin(7 * time), PATCH: 50 * np.cos(30 * time), FORCE: 0.3 * time}


def difference(found, expected):
    """The largest, each column over its largest value; columns of zeros are left out."""
    assert found.shape == expected.shape
    scale = np.abs(expected).max(axis=0)
    return float((np.abs(found - expected).max(axis=0)[scale > 0] / scale[scale > 0]).max())


@pytest.fixture(scope="module")
def folder(ffrobot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmu")
    (folder / "arm.toml").write_text(tomli_w.dumps(LINK))
    (folder / "scene.toml").write_text(SCENE)
    ffrobot.ok("solve", "scene.toml", cwd=folder)
    return folder


@pytest.fixture(scope="module")
def robot(ffrobot, folder):
    done = ffrobot.ok("export", "scene.results.h5", "--format", "fmu", cwd=folder)
    assert "written    scene.results.at_rest.fmu: at_rest, 14 states, 5 inputs, 15 outputs" in done.stdout
    assert "sources only" not in done.stdout
    return Robot(folder, folder / "scene.results.at_rest.fmu")


def test_fmpy_finds_no_fault(robot):
    assert validate_fmu(str(robot.path)) == []
    units = {each.name: each.unit for each in robot.description.modelVariables}
    assert [units[name] for name in (MOTOR, PATCH, FORCE, "joint/hub", TIP)] == ["N.m", "V", "N", "rad", "m"]
    assert {name: units[name] for name in SENSORS} == SENSORS
    assert units["der(rate of joint/hub)"] == "rad/s2"


def test_a_controller_commands_what_it_did_in_its_loop(ffrobot, folder):
    """Of samples: only co-simulation, with steps of the sample time."""
    done = ffrobot.ok("export", "scene.results.h5", "--format", "fmu", "--analysis", "loop", cwd=folder)
    assert "written    scene.results.loop.fmu: loop, 1 states, 2 inputs, 3 outputs" in done.stdout
    path = folder / "scene.results.loop.fmu"
    assert validate_fmu(str(path)) == []
    description = read_model_description(str(path))
    assert description.modelExchange is None
    reference = {each.name: each.valueReference for each in description.modelVariables}
    results = Results(folder / "scene.results.h5")
    names = [reference[name] for name in results.attributes("loop/control")["outputs"]]
    readings = results["loop/control/readings"][()] - results["loop/control/reference"][()]
    controller = results.controller("loop")
    x, found, expected = np.zeros(len(controller.A)), [], []
    with running(description, extract(str(path), str(folder / "loop"))) as fmu:
        for k, y in enumerate(readings):
            fmu.setReal(names, list(y))
            found += fmu.getReal([reference[MOTOR]])
            expected += [(controller.C @ x + controller.D @ y)[controller.outputs("joint/hub")[0]]]
            fmu.doStep(currentCommunicationPoint=1e-3 * k, communicationStepSize=1e-3)
            x = controller.A @ x + controller.B @ y
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert np.ptp(found) > 1e-3  # N·m


def test_co_simulation_holds_inputs(robot):
    found = robot.simulate(signals())
    assert difference(found, robot.response(signals(), linear=False)) < EXACT


def test_co_simulation_follows_slopes_of_inputs(robot):
    """Straight lines between steps, which need the integral of the integral of exp(A s)."""
    given = signals()
    inputs, outputs = robot.references(given), robot.references(robot.outputs)
    table = np.array(list(given.values())).T
    found = np.zeros((COUNT, len(outputs)))
    with robot.running() as fmu:
        for k in range(COUNT):
            fmu.setReal(inputs, table[k])
            found[k] = fmu.getReal(outputs)
            if k < COUNT - 1:
                fmu.setRealInputDerivatives(inputs, [1] * len(inputs), (table[k + 1] - table[k]) / STEP)
                fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
    assert difference(found, robot.response(given, linear=True)) < EXACT


@pytest.mark.parametrize("step", [1e-6, 1e-3, 0.1, 3.0])
def test_a_step_of_any_length_is_exact(step, robot):
    """From a state with everything in it: exp(A h) x, whatever follows the first step by rounding."""
    A = robot.model.A
    start = np.random.default_rng(3).standard_normal(len(A)) / np.maximum(1.0, np.abs(A).max(axis=0) ** 0.5)
    states = robot.references(robot.states)
    with robot.running() as fmu:
        fmu.setReal(states, start)
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=step)
        found = np.array(fmu.getReal(states))
        fmu.doStep(currentCommunicationPoint=step, communicationStepSize=step * (1 + 1e-11))
        later = np.array(fmu.getReal(states))
    f = len(A) // 2
    for state, time in ((found, step), (later, 2 * step * (1 + 0.5e-11))):
        expected = expm(A * time) @ start
        for half in (slice(f), slice(f, None)):  # coordinates, rates
            error = np.abs(state[half] - expected[half]).max()
            assert error < 1e-9 * np.abs(expected[half]).max()  # scipy's own exponential is no better at long steps


def test_derivatives_are_the_matrices(robot):
    """Of model exchange: x' and y are A x + B u and C x + D u; directional derivatives are columns of them."""
    model, rng = robot.model, np.random.default_rng(0)
    x, u = rng.standard_normal(len(model.A)), rng.standard_normal(len(robot.inputs))
    unknown = robot.references([*robot.derivatives, *robot.outputs])
    known = robot.references([*robot.states, *robot.inputs])
    matrix = np.block([[model.A, model.B], [model.C, model.D]])
    with robot.running(FMU2Model) as fmu:
        fmu.setReal(known, np.concatenate([x, u]))
        np.testing.assert_allclose(fmu.getReal(unknown), matrix @ np.concatenate([x, u]), rtol=1e-12)
        columns = [fmu.getDirectionalDerivative(unknown, [one], [1.0]) for one in known]
    np.testing.assert_array_equal(np.array(columns).T, matrix)


def test_model_structure_names_what_depends_on_what(robot):
    """Dependencies are the entries that are not zero."""
    model = robot.model
    matrix = np.block([[model.A, model.B], [model.C, model.D]])
    known = [*robot.states, *robot.inputs]
    unknowns = [*robot.description.derivatives, *robot.description.outputs]
    assert [each.variable.name for each in unknowns] == [*robot.derivatives, *robot.outputs]
    for row, each in zip(matrix, unknowns, strict=True):
        assert [on.name for on in each.dependencies] == [known[k] for k in np.flatnonzero(row)]


def test_an_instance_goes_back(robot):
    states = robot.references(robot.states)
    with robot.running() as fmu:
        fmu.setReal(robot.references([MOTOR]), [1.0])
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=STEP)
        kept, first = fmu.getFMUstate(), fmu.getReal(states)
        fmu.doStep(currentCommunicationPoint=STEP, communicationStepSize=STEP)
        second = fmu.getReal(states)
        assert second != first
        fmu.setFMUstate(kept)
        assert fmu.getReal(states) == first
        fmu.doStep(currentCommunicationPoint=STEP, communicationStepSize=STEP)
        assert fmu.getReal(states) == second
        fmu.freeFMUstate(kept)


def compiled(path):
    """The FMU of sources at `path` with a binary beside them, as importers make it."""
    parts = read_model_description(str(path)).coSimulation
    unpacked = Path(extract(str(path)))
    binary = unpacked / "binaries" / fmpy.platform / (parts.modelIdentifier + fmpy.sharedLibraryExtension)
    binary.parent.mkdir(parents=True)
    files = ElementTree.parse(unpacked / "modelDescription.xml").findall("CoSimulation/SourceFiles/File")
    sources = [unpacked / "sources" / file.attrib["name"] for file in files]
    subprocess.run(["cc", "-fPIC", "-shared", "-o", binary, *sources, "-lm"], check=True)
    return Path(shutil.make_archive(str(path.with_name("compiled")), "zip", unpacked))


def test_without_a_compiler_there_are_sources(robot, ffrobot, tmp_path, monkeypatch):
    """Told, and any C compiler makes the binary of the files that the description lists."""
    (tmp_path / "bin").mkdir()
    results = robot.folder / "scene.results.h5"
    with monkeypatch.context() as context:
        context.setenv("PATH", str(tmp_path / "bin"))
        context.delenv("CC", raising=False)
        done = ffrobot.ok("export", results, "--format", "fmu", "-o", tmp_path / "sources.fmu")
    assert "sources only, no binary: found no C compiler (cc, gcc, clang, or what CC names)" in done.stdout
    with zipfile.ZipFile(tmp_path / "sources.fmu") as file:
        assert sorted(file.namelist()) == ["modelDescription.xml", "sources/linear.c", "sources/model.h"]
    other = Robot(robot.folder, compiled(tmp_path / "sources.fmu"))
    np.testing.assert_allclose(other.simulate(signals(20)), robot.simulate(signals(20)), rtol=1e-9, atol=1e-15)


def test_a_compiler_that_fails_is_told(robot, ffrobot, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "cc -no-such-option")
    done = ffrobot.ok("export", robot.folder / "scene.results.h5", "--format", "fmu", "-o", tmp_path / "x.fmu")
    assert "sources only, no binary: cc -no-such-option failed: " in done.stdout


def test_a_binary_of_another_export_does_not_start(robot, capfd):
    fmu = instance(robot.description, robot.unpacked, guid="{other}")
    with pytest.raises(Exception, match=r"[Ii]nstantiate"):
        fmu.instantiate()
    assert "the binary is of another export" in capfd.readouterr().out


def test_names_that_are_no_identifiers(tmp_path):
    """Letters of any script and a sliding joint: an identifier of C, units of a way."""
    model = LinearModel(
        np.array([[0.0, 1.0], [-4.0, 0.0]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)),
        ("joint/Schlitten*/", "rate of joint/Schlitten*/"), ("joint/Schlitten*/",), ("joint/Schlitten*/",), 0.0,
        np.eye(1), np.eye(1),
    )  # fmt: skip
    unit = make_unit("3 Größen", "α", model, {"Schlitten*/": "m"})
    assert unit.identifier == "robot_3_Gr__en__"
    assert [each.unit for each in (*unit.inputs, *unit.outputs, *unit.states)] == ["N", "m", "m", "m/s"]
    variables = (*unit.states, *unit.inputs, *unit.outputs)
    assert len({each.name for each in variables}) == len(variables)


REFUSED = {
    "along: expected a linear model of one instant, found 2; solve with one in `times`": ("--analysis", "along"),
    'expected a linear analysis ("at_rest", "along"), found "inverse"': ("--analysis", "inverse"),
    "expected no scene or link file": ("-o", "scene.toml", "--force"),
}


def test_what_is_refused(robot, refused, tmp_path):
    shutil.copy(robot.folder / "scene.toml", tmp_path)
    for message, options in REFUSED.items():
        assert message in refused(tmp_path, "export", robot.folder / "scene.results.h5", "--format", "fmu", *options)
