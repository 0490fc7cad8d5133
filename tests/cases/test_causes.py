"""Why 3D runs end before their end: the sentence names what was made wrong on purpose."""

SCENE = """
name = "arm"
space = "spatial"
gravity = [0.0, -9.81, 0.0]
[[body]]
name = "arm"
link = "arm.toml"
[[joint]]
name = "hinge"
type = "revolute"
between = ["ground", "arm.root"]
axis = [0.0, 0.0, 1.0]
[[trajectory]]
name = "swing"
joint = "hinge"
value = "0"
[initial]
state = "undeformed"
[[analysis]]
name = "inverse"
kind = "pcid"
end = 1.0
output_step = 0.1
tolerance = 1e-4
"""
LINK = """
name = "arm"
[material]
youngs_modulus = 2.07e11
poissons_ratio = 0.3
density = 7850.0
[geometry]
kind = "beam"
length = 1.0
section = { shape = "rectangle", height = 0.0005, width = 0.01 }
[mesh]
elements = 6
[reference]
condition = "cantilever"
[modes]
count = 2
family = "in-plane-bending"
attachment_modes = false
[damping]
ratio = 0.01
"""


def test_a_link_that_is_too_thin_is_named(ffrobot, tmp_path):
    """It falls by 2 w L⁴/8EI under its weight w = ρ A g, with I/A = h²/12: by more than its own length."""
    (tmp_path / "arm.toml").write_text(LINK)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    done = ffrobot("solve", scene)
    said = " ".join((done.stderr + done.stdout).split())
    assert done.returncode != 0
    assert "(diverged)" in said
    assert '"arm" is bent by' in said
