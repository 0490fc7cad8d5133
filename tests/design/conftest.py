"""Scene files of the designs."""

import pytest
import tomli_w


@pytest.fixture
def write(tmp_path):
    """Write the keys of a scene; returns the file."""

    def scene(keys):
        path = tmp_path / "scene.toml"
        path.write_text(tomli_w.dumps(keys), encoding="utf-8")
        return path

    return scene
