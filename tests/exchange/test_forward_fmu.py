"""Forward motions as co-simulation FMUs, run by FMPy, against `solve` under the same held inputs."""

import tomllib
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.validation import validate_fmu
from running_fmus import running
from tables_3d import Y, pin, revolute

from ffrobot import InputError, Results
from ffrobot.exchange.export import export_file

STEP, END = 0.01, 0.3
CHANGES = (0.1, 0.2)  # s, at which inputs change


def link(name, modes, *, width=0.003, height=0.02, **keys):
    return beam_link(
        0.4, rectangle(height, width), 12, name=name, modes={"count": modes}, damping={"ratio": 0.02},
        stress={"points": {"gauge": [0.05, 0.2 * height, 0.001]}}
    ) | keys  # fmt: skip


def box(**points):
    return {"mass": 0.4, "center": [0.1, 0.0, 0.01], "inertia": [2e-4, 1e-3, 1e-3], "points": points}


def flat_box(**points):
    return {"mass": 0.4, "center": [0.1, 0.02], "inertia": 2e-3, "points": points}


FLAT = {"width": 0.02, "height": 0.003}
ROOT, TIP = [0.0, 0.0, 0.02], [0.3, 0.01, 0.0]
PLANE = {"space": "planar", "gravity": [0.0, -9.81]}
PLANAR = {
    # fewer modes than the link has, an outer first side, a rotor behind a stiff gear, friction, patches with mass and
    # stiffness, a payload with inertia, a weld and a way that are turned, a trajectory that nothing follows, rates
    "flat arm": PLANE | {
        "body": [{"name": "upper", "link": link("upper", 4, **FLAT), "modes": 2},
                 {"name": "fore", "rigid": flat_box(root=[0.0, 0.0], tip=[0.3, 0.01])},
                 {"name": "hand", "link": link("hand", 1, **FLAT)}, {"name": "tool", "rigid": flat_box(a=[0.0, 0.1])}],
        "joint": [
            pin("shoulder", "ground", "upper.root", at=[0.1, 0.2], viscous_friction=0.05),
            pin("elbow", "fore.root", "upper.tip", rotor_inertia=2e-5, gear_ratio=50.0),
            {"name": "wrist", "type": "weld", "between": ["fore.tip", "hand.root"], "motor": False},
            {"name": "way", "type": "prismatic", "between": ["tool.a", "hand.tip"], "axis": [1.0, 2.0]},
        ],
        "pzt": [
            {"body": "upper", "centers": [0.06, 0.2, 0.34], "length": 0.06, "width": 0.01, "thickness": 0.5e-3,
             "modulus": 63e9, "d31": -1.9e-10, "density": 7600.0, "limit": 200.0, "structural": True,
             "allocation": "least-squares"}
        ],
        "payload": [{"point": "upper.tip", "mass": 0.1, "inertia": 1e-4}, {"point": "fore.tip", "mass": 0.2}],
        "trajectory": [{"name": "path", "angle": "hand.tip", "value": "0.2 + t"}],
        "initial": {"angles": {"upper": -0.4, "fore": 0.3, "hand": 0.9, "tool": 0.2}, "rates": {"upper": 0.5},
                    "joints": {"way": 0.05}, "joint_rates": {"way": 0.2}},
    },
    # two soft links welded at an angle hang from a pin in static equilibrium, with geometric stiffening; dry friction,
    # implicit steps
    "flat rest": PLANE | {
        "geometric_stiffening": True,
        "body": [{"name": name, "link": link(name, 1, **FLAT)} for name in ("upper", "fore")],
        "joint": [pin("pin", "ground", "upper.root", coulomb_friction=0.02),
                  {"name": "bend", "type": "weld", "between": ["upper.tip", "fore.root"]}],
        "initial": {"state": "static", "joints": {"pin": -1.9}, "angles": {"fore": -0.8}},
    },
    # a crank that drives a slider, from a guess of angles that does not close the loop, with friction where it is cut;
    # a body without joints, which starts turned and turns
    "flat loop": PLANE | {
        "body": [{"name": "slider", "rigid": flat_box(pin=[0.0, 0.0])},
                 {"name": "crank", "rigid": flat_box(a=[0.0, 0.0], b=[0.1, 0.0])},
                 {"name": "rod", "link": link("rod", 1, **FLAT)}, {"name": "flyer", "rigid": flat_box()}],
        "joint": [
            {"name": "guide", "type": "prismatic", "between": ["ground", "slider.pin"], "axis": [1.0, 0.2],
             "viscous_friction": 0.4},
            pin("drive", "ground", "crank.a", motor=True),
            pin("knee", "crank.b", "rod.root", viscous_friction=0.002),
            pin("out", "slider.pin", "rod.tip", viscous_friction=0.003),
        ],
        "initial": {"angles": {"crank": 1.2, "rod": -0.3, "flyer": 0.6}, "rates": {"flyer": 2.0}},
    },
}  # fmt: skip
SCENES = PLANAR | {
    # flexible links, damped as the robot shall be, an outer first side, a rotor behind a stiff gear, friction, patches,
    # three analyses to choose from
    "arm": {
        "body": [{"name": "upper", "link": link("upper", 2, damping={"ratio": 0.02, "of": "robot"})},
                 {"name": "fore", "rigid": box(root=ROOT, tip=TIP)}],
        "joint": [
            revolute("shoulder", "ground", "upper.root", [0.1, 1.0, 0.2], viscous_friction=0.05),
            revolute("elbow", "fore.root", "upper.tip", Y, rotor_inertia=2e-5, gear_ratio=50.0),
        ],
        "pzt": [
            {"body": "upper", "bends": "out-of-plane", "centers": [0.06, 0.2, 0.34], "length": 0.06, "width": 0.01,
             "thickness": 0.5e-3, "modulus": 63e9, "d31": -1.9e-10, "density": 7600.0, "limit": 200.0}
        ],
        "initial": {"joints": {"shoulder": -0.4, "elbow": 0.7}},
    },
    # compliant gears: motors turn rotors, from static equilibrium without motors' moments in the plane of the table;
    # attachment modes, whose masses are raised
    "gears": {
        "gravity": [0.0, 0.0, 0.0],
        "body": [{"name": "upper", "link": link("upper", 2, reference={"condition": "craig-bampton"})},
                 {"name": "fore", "rigid": box(root=ROOT, tip=TIP)}],
        "joint": [
            revolute("shoulder", "ground", "upper.root", stiffness=50.0, damping=0.05, rotor_inertia=1e-5,
                     gear_ratio=60.0),
            revolute("elbow", "upper.tip", "fore.root", stiffness=30.0, rotor_inertia=1e-5, gear_ratio=40.0),
        ],
    },
    # a loop of four bars, one of them flexible, and joints of two and six coordinates
    "loop": {
        "body": [{"name": "crank", "rigid": box(a=[0.0, 0.0, 0.0], b=[0.1, 0.0, 0.0])},
                 {"name": "coupler", "link": link("coupler", 1, width=0.01)},
                 {"name": "rocker", "rigid": box(a=[0.0, 0.0, 0.0], b=[0.3, 0.0, 0.0])},
                 {"name": "pendulum", "rigid": box(a=[0.0, 0.0, 0.1])}, {"name": "flyer", "rigid": box()}],
        "joint": [
            revolute("drive", "ground", "crank.a", Y, motor=True), revolute("knee", "crank.b", "coupler.root", Y),
            revolute("out", "ground", "rocker.a", Y, at=[0.4, 0.0, 0.0]),
            {"name": "close", "type": "spherical", "between": ["rocker.b", "coupler.tip"]},
            {"name": "cross", "type": "universal", "between": ["rocker.b", "pendulum.a"], "axis": [0.0, 1.0, 0.0],
             "second_axis": [1.0, 0.0, 0.0]},
        ],
        "initial": {"joints": {"drive": -1.2, "knee": 0.9, "out": -1.9}},
    },
    # soft links that bend far, with geometric stiffening: points move to second order
    "soft": {
        "geometric_stiffening": True,
        "body": [{"name": "upper", "link": link("upper", 2)}, {"name": "fore", "link": link("fore", 2)},
                 {"name": "tool", "rigid": box(root=ROOT, tip=TIP)}],
        "joint": [
            revolute("shoulder", "ground", "upper.root", [0.1, 1.0, 0.2]),
            revolute("elbow", "fore.root", "upper.tip", [0.0, 0.6, 0.8]),
            {"name": "grip", "type": "weld", "between": ["fore.tip", "tool.root"]},
        ],
        "initial": {"joints": {"shoulder": -0.4, "elbow": 0.7}},
    },
}  # fmt: skip
INPUTS = {
    "arm": {"joint/shoulder/moment": (-3.0, -1.0, 2.0), "joint/elbow/moment": (0.5, -1.5, 1.0),
            "pzt/upper/2": (150.0, -200.0, 0.0)},
    "gears": {"joint/shoulder/moment": (4.0, -5.0, 1.0), "joint/elbow/moment": (-1.0, 2.0, 0.0)},
    "loop": {"joint/drive/moment": (0.3, -1.0, 1.5)},
    "soft": {"joint/shoulder/moment": (-3.0, -1.0, 2.0), "joint/elbow/moment": (0.5, -1.5, 1.0)},
    "flat arm": {"joint/shoulder/moment": (1.0, -3.0, 2.0), "joint/elbow/moment": (0.5, -1.5, 1.0),
                 "joint/way/moment": (4.0, 6.0, 3.0), "pzt/upper/2": (150.0, -200.0, 0.0)},
    "flat rest": {"joint/pin/moment": (0.0, 0.5, -0.3)},
    "flat loop": {"joint/drive/moment": (0.3, -1.0, 1.5)},
}  # fmt: skip


def scene_text(name, loads=()):
    analysis = {"name": "swing", "kind": "forward", "end": END, "output_step": STEP, "tolerance": 1e-8}
    if name == "flat rest":
        analysis |= {"tolerance": 1e-7, "integrator": "radau"}
    keys = {"name": f"{name} as an FMU", "space": "spatial", "gravity": [0.0, 0.0, -9.81], **SCENES[name]}
    return tomli_w.dumps(keys | {"load": list(loads), "analysis": [analysis]})


def loads_of(name):
    """The inputs as loads of a scene: steps of time."""
    found = []
    for key, (a, b, c) in INPUTS[name].items():
        size = f"where(t < {CHANGES[0]}, {a}, where(t < {CHANGES[1]}, {b}, {c}))"
        kind, of, last = key.split("/")
        if kind == "joint":
            found.append({"joint": of, "moment": size})
        else:
            found.append({"pzt": of, "voltage": [size if k == int(last) else "0" for k in (1, 2, 3)]})
    return found


def held_inputs(name):
    t = np.arange(round(END / STEP) + 1) * STEP
    table = np.zeros(len(t), dtype=[("time", float), *((key, float) for key in INPUTS[name])])
    table["time"] = t
    for key, values in INPUTS[name].items():
        table[key] = np.select([t < c - STEP / 2 for c in CHANGES], values[:2], values[2])
    return table


@pytest.fixture(scope="module")
def robot(tmp_path_factory, ffrobot):
    """The FMU of a scene by its name, and results of `solve` under the inputs."""

    @cache
    def make(name):
        folder = tmp_path_factory.mktemp(name)
        scene, loaded = folder / "scene.toml", folder / "loaded.toml"
        scene.write_text(scene_text(name))
        loaded.write_text(scene_text(name, loads_of(name)))
        for command in (("export", scene, "--analysis", "swing", "--format", "fmu"), ("solve", loaded)):
            ffrobot.ok(*command)
        return folder / "scene.swing.fmu", Results(folder / "loaded.results.h5")

    return make


def modal(results, body):
    """In the modes of the file."""
    found = results[f"swing/bodies/{body}/modal"]
    if "modal_transform" not in results.names(f"swing/bodies/{body}"):
        return found
    return found @ results[f"swing/bodies/{body}/modal_transform"].T


def expected(results, variable):
    """Of `solve`, by the name that the FMU has."""
    kind, name, *last = variable.split("/")
    if kind == "point":
        return results[f"swing/points/{name}/position"][:, "xyz".index(last[0])]
    if kind == "modal":
        return modal(results, name)[:, int(last[0]) - 1]
    if kind == "strain":
        body, _, point = name.partition(".")
        strain = results.modal_body(body).stress[point].strain[("xx", "yy", "zz", "yz", "xz", "xy").index(last[0])]
        return modal(results, body) @ strain
    joint, _, number = name.partition(" ")
    side = "motor_" if kind == "motor" else ""
    found = results[f"swing/joints/{joint}/{side}{'rate' if last else 'coordinate'}"]
    return found[:, int(number) - 1] if number else found


@pytest.mark.parametrize("name", SCENES)
def test_motion(robot, name):
    """Every output at every step: to 1e-6 of the largest of its kind; none across the plane of a planar scene."""
    fmu, results = robot(name)
    assert validate_fmu(str(fmu)) == []
    outputs = [each.name for each in read_model_description(str(fmu)).modelVariables if each.causality == "output"]
    axes = {output.rpartition("/")[2] for output in outputs if output.startswith("point/")}
    assert axes == (set("xy") if name in PLANAR else set("xyz"))
    found = simulate_fmu(str(fmu), stop_time=END, output_interval=STEP, input=held_inputs(name), output=outputs)
    np.testing.assert_allclose(found["time"], results["swing/time"], atol=1e-12)
    sizes = {}
    for variable in outputs:
        values = np.abs(expected(results, variable)).max()
        kind = variable.split("/")[0] + variable.endswith("rate") * " rate"
        sizes[variable] = kind, values
    largest = {kind: max(size for of, size in sizes.values() if of == kind) for kind, _ in sizes.values()}
    assert largest["joint"] > 0.3  # it moves
    assert largest["strain"] > 1e-4 or "loop" in name  # whose rod is stiff
    for variable in outputs:
        np.testing.assert_allclose(
            found[variable], expected(results, variable), rtol=0, atol=1e-6 * largest[sizes[variable][0]],
            err_msg=variable,
        )  # fmt: skip


@pytest.fixture
def slave(robot, tmp_path):
    """The folder in which the arm's FMU is unpacked, one with blanks, what it logs, what runs it, and references."""
    folder, told = tmp_path / "an FMU, unpacked", []
    extract(str(robot("arm")[0]), str(folder))
    description, callbacks = read_model_description(str(folder)), fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(lambda *values: told.append(values[-1].decode()))
    reference = {each.name: each.valueReference for each in description.modelVariables}
    return folder, told, lambda: running(description, folder, callbacks=callbacks), reference


def test_reset_and_length_of_steps(slave):
    """The same again after a reset; held inputs in one step or in fifteen, to the tolerance."""
    *_, start, reference = slave
    outputs = [reference[name] for name in ("joint/shoulder", "joint/elbow/rate", "point/fore.tip/z")]
    motor, found = [reference["joint/elbow/moment"]], []
    with start() as instance:
        for steps in (1, 1, 15):
            assert instance.getReal(motor) == [0.0]
            instance.setReal(motor, [-0.5])
            for k in range(steps):
                instance.doStep(k * 0.3 / steps, 0.3 / steps)
            found.append(instance.getReal(outputs))
            instance.reset()
    assert found[1] == found[0]
    np.testing.assert_allclose(found[2], found[0], rtol=1e-7)


def test_steps_that_are_repeated(slave):
    """Kept states bring back motion, inputs and step sizes: the same again to the last bit, also after a reset."""
    _, told, start, reference = slave
    outputs = [reference[name] for name in ("joint/shoulder/rate", "point/fore.tip/z")]
    motor, found = reference["joint/elbow/moment"], []
    with start() as instance:
        instance.setReal([motor], [-0.5])
        instance.doStep(0.0, 0.1)
        kept, then = instance.getFMUstate(), instance.getReal(outputs)
        for _ in range(2):
            instance.doStep(0.1, 0.05)
            instance.setReal([motor], [1.0])
            instance.doStep(0.15, 0.05)
            found.append(instance.getReal(outputs))
            instance.reset()
            instance.setFMUstate(kept)
            assert instance.getReal([*outputs, motor]) == [*then, -0.5]
        instance.freeFMUstate(kept)
        with pytest.raises(Exception, match="fmi2SetFMUstate failed"):
            instance.setFMUstate(None)
    assert found[0] == found[1] != then
    assert "expected a state of fmi2GetFMUstate, found none" in told[-1]


def test_wrong_calls_and_files(slave):
    """Each is an error with a message in the log."""
    folder, told, start, reference = slave
    with start() as instance:
        for call, message in (
            (lambda: instance.setReal([reference["joint/shoulder"]], [1.0]), "expected a finite value of an input"),
            (lambda: instance.setReal([0], [float("nan")]), "expected a finite value of an input"),
            (lambda: instance.doStep(0.0, -1.0), "expected a step of zero or more seconds"),
            (lambda: instance.getReal([10_000]), "expected a value reference of modelDescription.xml"),
        ):
            with pytest.raises(Exception, match="fmi2"):
                call()
            assert message in told[-1]
    model = folder / "resources" / "model.bin"
    data = model.read_bytes()
    for content, message in (
        (data[: len(data) // 2], "found the end of the file"),
        (data + b"x", "expected the end of the file"),
        (b"something else", "expected a model of this version of ffrobot"),
        (data[:22] + b"\xff" * 8 + data[30:], "expected a count"),
        (data.replace(b"{", b"[", 1), "of another export"),
    ):
        model.write_bytes(content)
        with pytest.raises(Exception, match="instantiate"), start():
            pass
        assert message in told[-1]
    model.unlink()
    with pytest.raises(Exception, match="instantiate"), start():
        pass
    assert "model.bin of the FMU, found none" in told[-1]


def test_results_of_a_forward_analysis(robot):
    """They do not say what robot it was: the scene does."""
    with pytest.raises(InputError, match=r'found "swing" of kind "forward": export the scene'):
        export_file(robot("arm")[0].with_name("loaded.results.h5"), "fmu", "swing", None)


def test_a_start_away_from_the_guess_is_told(tmp_path):
    """No path keeps the joints in the equilibrium that an FMU starts from."""
    scene = tmp_path / "scene.toml"
    scene.write_text(scene_text("arm") + '\n[initial]\nstate = "static"\n')
    (text,) = [text for text in export_file(scene, "fmu", None, None).remarks if "hang" in text]
    assert text.startswith('joints "shoulder", "elbow" hang, away from [initial]')


def test_the_archive_is_the_library_and_the_model(robot):
    """The binary is that of the installation: no compiler is asked for. The same scene gives the same bytes."""
    import ffrobot.mbs._core as core

    fmu, _ = robot("arm")
    with zipfile.ZipFile(fmu) as file:
        names = file.namelist()
        binary = next(name for name in names if name.startswith("binaries/"))
        assert file.read(binary) == Path(core.__file__).with_name("ffrobot_fmu.so").read_bytes()
    assert not any(name.startswith("sources/") for name in names)
    again = export_file(fmu.with_name("scene.toml"), "fmu", "swing", fmu.with_name("again.fmu"))
    assert again.path.read_bytes() == fmu.read_bytes()


def test_voltages_are_those_on_driven_patches(tmp_path):
    """Passive patches have no input; what amplifiers and hysteresis leave out is told."""
    keys = tomllib.loads(scene_text("flat arm"))
    driven = keys["pzt"][0] | {"hysteresis": {"weights": [0.7, 0.3], "thresholds": [0.0, 5.0]}}
    passive = {"name": "sense", "face": "-y", "shunt": 1e5, "centers": [0.13]}
    free = {"limit": None, "allocation": None, "structural": ["stiffness"]}
    passive = {key: value for key, value in (keys["pzt"][0] | free | passive).items() if value is not None}
    scene = tmp_path / "scene.toml"
    scene.write_text(tomli_w.dumps(keys | {"pzt": [driven, passive]}))
    done = export_file(scene, "fmu", None, None)
    assert any(text.startswith("voltages are those on the patches") for text in done.remarks)
    with zipfile.ZipFile(done.path) as file:
        described = file.read("modelDescription.xml").decode()
    assert 'name="pzt/upper/3"' in described
    assert "pzt/sense" not in described


PATH = {"name": "path", "joint": "shoulder", "value": "t**2"}
INVERSE = {"name": "inverse", "kind": "pcid", "end": 0.3, "output_step": 0.01}
AGAIN = {"name": "again", "kind": "forward", "end": 0.3, "output_step": 0.01, "actuation": "inverse", "apply": "joints"}


@pytest.mark.parametrize(
    ("keys", "analysis", "message"),
    [
        ({}, "no such", 'expected one of "swing", found "no such"'),
        ({"trajectory": [PATH], "analysis": [INVERSE]}, "inverse", 'found "inverse" of kind "pcid"'),
        ({"trajectory": [PATH], "analysis": [INVERSE, AGAIN]}, "again", 'of kind "forward" with actuation'),
        ({"trajectory": [PATH], "analysis": [INVERSE, AGAIN]}, None, "motors are the inputs of the FMU, found none"),
        ({"load": [{"joint": "shoulder", "moment": "1"}]}, None, "load: expected none of a scene for an FMU"),
        ({"motors": "frame"}, "swing", 'motors: expected "section"'),
        ({"geometric_stiffening": "auto"}, "swing", "geometric_stiffening: expected true or false of a scene for an"),
    ],
)
def test_what_cannot_be_exported(tmp_path, keys, analysis, message):
    scene = tmp_path / "scene.toml"
    scene.write_text(tomli_w.dumps(tomllib.loads(scene_text("arm")) | keys))
    with pytest.raises(InputError, match=message):
        export_file(scene, "fmu", analysis, None)
