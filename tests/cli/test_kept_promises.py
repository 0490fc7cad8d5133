"""What the program once broke in silence, by its command alone: FFROBOT_COMMAND shows that an older one fails here."""

import h5py
import numpy as np

TWO_LINKS = """
name = "tolerance"
gravity = [0.0, -9.81]
payload = [{ point = "b2.tip", mass = 0.373 }]
joint = [
    { name = "O", type = "revolute", between = ["ground", "b1.root"] },
    { name = "A", type = "revolute", between = ["b1.tip", "b2.root"] },
]
initial = { angles = { b1 = -0.85, b2 = -1.87 } }
analysis = [
    { name = "found", kind = "pcid", end = 0.3, output_step = 1.5e-4, tolerance = 1e-6 },
    { name = "exact", kind = "pcid", end = 0.3, output_step = 1.5e-4, tolerance = 1e-10, integrator = "dop853" },
]

[[trajectory]]
name = "tip"
point = "b2.tip"
x = "0.309+0.087*(10*(t/0.3)**3-15*(t/0.3)**4+6*(t/0.3)**5)"
y = "-1.392+0.082*(10*(t/0.3)**3-15*(t/0.3)**4+6*(t/0.3)**5)"
"""
LINK = """
[[body]]
name = "{name}"
[body.link]
material = {{ youngs_modulus = 2.1e11, density = 7850.0 }}
geometry = {{ kind = "beam", length = {length}, section = {section} }}
mesh = {{ elements = 14 }}
reference = {{ condition = "simply-supported" }}
modes = {{ count = {modes}, family = "in-plane-bending" }}
damping = {{ ratio = {damping} }}
"""
LINKS = LINK.format(
    name="b1", length=0.829, section='{ shape = "tube", outer = 0.02325, inner = 0.019 }', modes=1, damping=0.0
) + LINK.format(
    name="b2", length=0.804, section='{ shape = "rectangle", height = 0.0157, width = 0.0314 }', modes=6, damping=0.0147
)
STOPPED = """
name = "stopped"
gravity = [0.0, -9.81]
body = [{ name = "arm", rigid = { mass = 1.0, inertia = 0.1, center = [0.5, 0.0], points = { root = [0.0, 0.0] } } }]
joint = [{ name = "shoulder", type = "revolute", between = ["ground", "arm.root"] }]
load = [{ joint = "shoulder", moment = "3*cos(20*t)" }]
analysis = [{ name = "fall", kind = "forward", end = 1.0, output_step = 0.01, tolerance = 1e-9, max_steps = 4 }]
"""


def test_forces_keep_the_tolerance(tmp_path, ffrobot):
    """At every output, between the ends of steps too; reactions and moments were off by 4 to 6 tolerances."""
    (tmp_path / "scene.toml").write_text(TWO_LINKS + LINKS, encoding="utf-8")
    ffrobot.ok("solve", "scene.toml", cwd=tmp_path)
    with h5py.File(tmp_path / "scene.results.h5") as file:
        for joint in ("O", "A"):
            for name in ("reaction", "moment"):
                found, exact = (file[f"{run}/joints/{joint}/{name}"][()] for run in ("found", "exact"))
                assert np.abs(found - exact).max() < 1e-6 * np.abs(exact).max(), (joint, name)


def test_a_checkpoint_without_its_last_number_is_refused(tmp_path, ffrobot):
    """The run went on with what stood behind it in memory, exit code 0."""
    (tmp_path / "scene.toml").write_text(STOPPED, encoding="utf-8")
    assert ffrobot("solve", "scene.toml", cwd=tmp_path).returncode == 1
    with h5py.File(tmp_path / "scene.results.h5", "r+") as file:
        group = file["fall/resume/checkpoint"]
        state = group["state"][()]
        del group["state"]
        group["state"] = state[:-1]
    done = ffrobot("solve", "scene.toml", "--resume", cwd=tmp_path)
    assert done.returncode == 2
    (message,) = done.stderr.splitlines()
    assert "scene.results.h5" in message
