"""Wrong input of `ffrobot fit`: one message, nothing written."""

import pytest
import tomli_w
from beam_links import beam_link, tube

LINK = beam_link(0.6, tube(0.02, 0.016), 10, nu=None, name="arm", modes={"count": 4, "family": "in-plane-bending"})


@pytest.mark.parametrize(
    ("measured", "key", "options", "message"),
    [
        ("nowhere.csv", "material.density", (), "nowhere.csv: table of measured"),
        ("modes.csv", "material.dnsity", (), "arm.toml: --vary: expected a number above 0 at material.dnsity, found"),
        ("modes.csv", "name", (), "a number above 0 at name, found 'arm'"),
        ("modes.csv", "material.density", ("--motors", "locked"), "--motors: expected a scene file"),
        ("many.csv", "material.density", (), "line 2: expected modes that the model has (4 of them), found mode 9"),
        ("modes.csv", "material.density", ("-o", "arm.toml"), "output: expected another file than the input"),
        ("modes.csv", "material.density", ("-o", "sub/a.toml"), "output: expected a file next to arm.toml"),
        ("half.csv", "material.density", (), "uncertainty: expected it of all frequencies or of none, found 1"),
    ],
)
def test_wrong_input_is_refused(tmp_path, refused, measured, key, options, message):
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(LINK))
    (tmp_path / "modes.csv").write_text("mode,frequency\n1,49\n2,307\n")
    (tmp_path / "many.csv").write_text("mode,frequency\n9,1e4\n")
    (tmp_path / "half.csv").write_text("mode,frequency,uncertainty\n1,49,0.1\n2,307,\n")
    assert message in refused(tmp_path, "fit", "arm.toml", "--measured", measured, "--vary", key, *options)
