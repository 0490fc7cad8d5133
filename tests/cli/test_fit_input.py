"""Wrong input of `ffrobot fit`: one message, nothing written."""

import pytest
import tomli_w
from beam_links import beam_link, tube

LINK = beam_link(0.6, tube(0.02, 0.016), 10, nu=None, name="arm", modes={"count": 4, "family": "in-plane-bending"})

WRONG = {
    ("fit", "arm.toml", "--measured", "nowhere.csv", "--vary", "material.density"): "nowhere.csv: table of measured",
    ("fit", "arm.toml", "--measured", "modes.csv", "--vary", "material.dnsity"): (
        "arm.toml: --vary: expected a number above 0 at material.dnsity, found none"
    ),
    ("fit", "arm.toml", "--measured", "modes.csv", "--vary", "name"): "a number above 0 at name, found 'arm'",
    ("fit", "arm.toml", "--measured", "modes.csv", "--vary", "material.density", "--motors", "locked"): (
        "--motors: expected a scene file"
    ),
    ("fit", "arm.toml", "--measured", "many.csv", "--vary", "material.density"): (
        "line 2: expected modes that the model has (4 of them), found mode 9"
    ),
    ("fit", "arm.toml", "--measured", "modes.csv", "--vary", "material.density", "-o", "arm.toml"): (
        "output: expected another file than the input"
    ),
    ("fit", "arm.toml", "--measured", "modes.csv", "--vary", "material.density", "-o", "sub/a.toml"): (
        "output: expected a file next to arm.toml"
    ),
    ("fit", "arm.toml", "--measured", "half.csv", "--vary", "material.density"): (
        "uncertainty: expected it of all frequencies or of none, found 1"
    ),
}  # fmt: skip


@pytest.mark.parametrize("arguments", WRONG)
def test_wrong_input_is_refused(tmp_path, refused, arguments):
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(LINK))
    (tmp_path / "modes.csv").write_text("mode,frequency\n1,49\n2,307\n")
    (tmp_path / "many.csv").write_text("mode,frequency\n9,1e4\n")
    (tmp_path / "half.csv").write_text("mode,frequency,uncertainty\n1,49,0.1\n2,307,\n")
    assert WRONG[arguments] in refused(tmp_path, *arguments)
