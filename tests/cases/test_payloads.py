"""Payloads without inertia about some axis turn with their section, like rigid bodies welded to it."""

import numpy as np
import pytest
from checkpoint_scene_files import solved, write_scene

MASS, CENTER = 0.3, [0.03, -0.02, 0.05]
SLIGHT = 1e-12  # kg·m²: rigid bodies have to have some; it is 1e-9 of that of the payload about the point
MOMENTS = {"point masses next to the section": [0.0, 0.0, 0.0], "rods": [0.0, 2e-4, 2e-4]}
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
WELDED = """
[[body]]
name = "load"
rigid = {{ mass = {mass}, center = {center}, inertia = {inertia}, points = {{ root = [0, 0, 0] }} }}

[[joint]]
name = "grip"
type = "weld"
between = ["fore.tip", "load.root"]
"""


@pytest.mark.parametrize("moments", MOMENTS.values(), ids=MOMENTS)
def test_payloads_are_bodies_welded_to_their_link(moments, ffrobot, tmp_path):
    payload = f'\n[[payload]]\npoint = "fore.tip"\nmass = {MASS}\ncenter = {CENTER}\ninertia = {moments}\n'
    welded = WELDED.format(mass=MASS, center=CENTER, inertia=[x + SLIGHT for x in moments])
    folders = [tmp_path / "payload", tmp_path / "welded"]
    for folder in folders:
        folder.mkdir()
    files = [
        solved(ffrobot, write_scene("arm3_line_undeformed", folder, SHORT, more=more + ANALYSES))
        for folder, more in zip(folders, (payload, welded), strict=True)
    ]
    with files[0] as found, files[1] as expected:
        for analysis in ("inverse", "fall", "implicit"):
            for key in KEYS + (MOMENTS_OF_MOTORS if analysis == "inverse" else ()):
                wanted = expected[f"{analysis}/{key}"][()]
                np.testing.assert_allclose(
                    found[f"{analysis}/{key}"],
                    wanted,
                    rtol=0,
                    atol=1e-7 * np.abs(wanted).max(),
                    err_msg=f"{analysis} {key}",
                )
