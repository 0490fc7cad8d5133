"""Payloads without inertia about some axis turn with their section, like rigid bodies welded to it."""

import numpy as np
from checkpoint_scene_files import solved, write_scene

MASS, CENTER = 0.3, [0.03, -0.02, 0.05]
SLIGHT = 1e-12  # kg·m²: rigid bodies have to have some; it is 1e-9 of that of the payload about the point
MOMENTS = {"upper": [0.0, 0.0, 0.0], "fore": [0.0, 2e-4, 2e-4]}  # a point mass next to the section, and a rod
SHORT = ("end = 0.6\noutput_step = 0.02\ntolerance = 1e-08", "end = 0.1\noutput_step = 0.02\ntolerance = 1e-09")
ANALYSES = """
[[analysis]]
name = "fall"
kind = "forward"
end = 0.04
output_step = 0.02
tolerance = 1e-9

[[analysis]]
name = "implicit"
kind = "forward"
end = 0.04
output_step = 0.02
tolerance = 1e-9
integrator = "radau"
"""
KEYS = (
    *(
        f"joints/{joint}/{of}"
        for joint in ("q1", "q2", "q3")
        for of in ("coordinate", "rate", "reaction", "reaction_moment")
    ),
    *("bodies/fore/modal", "bodies/upper/modal", "energy/kinetic", "energy/strain"),
    *("points/fore.tip/position", "points/fore.tip/quaternion"),
)
MOMENTS_OF_MOTORS = tuple(f"joints/{joint}/moment" for joint in ("q1", "q2", "q3"))
PAYLOAD = '\n[[payload]]\npoint = "{link}.tip"\nmass = {mass}\ncenter = {center}\ninertia = {inertia}\n'
WELDED = """
[[body]]
name = "of_{link}"
rigid = {{ mass = {mass}, center = {center}, inertia = {inertia}, points = {{ root = [0, 0, 0] }} }}

[[joint]]
name = "grip_of_{link}"
type = "weld"
between = ["{link}.tip", "of_{link}.root"]
"""


def run(ffrobot, folder, carried, slight):
    """The results of the arm that carries both, their moments of inertia larger by so much."""
    folder.mkdir()
    more = [
        carried.format(link=link, mass=MASS, center=CENTER, inertia=[x + slight for x in moments])
        for link, moments in MOMENTS.items()
    ]
    return solved(ffrobot, write_scene("arm3_line_undeformed", folder, SHORT, more="".join(more) + ANALYSES))


def test_payloads_are_bodies_welded_to_their_links(ffrobot, tmp_path):
    with (
        run(ffrobot, tmp_path / "payload", PAYLOAD, 0.0) as found,
        run(ffrobot, tmp_path / "welded", WELDED, SLIGHT) as expected,
    ):
        for analysis in ("inverse", "fall", "implicit"):
            for key in KEYS + (MOMENTS_OF_MOTORS if analysis == "inverse" else ()):
                name, wanted = f"{analysis}/{key}", expected[f"{analysis}/{key}"][()]
                size = np.abs(wanted).max()
                np.testing.assert_allclose(found[name], wanted, rtol=0, atol=1e-7 * size, err_msg=name)
