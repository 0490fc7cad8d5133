"""Results of planar scenes that version 0.2 wrote, when it had a program of its own for the plane.

`of_0.2` holds an arm of a rigid and a flexible link: its modal body, its results, and those of the same scene
stopped after 100 steps, all as commit fb4bd6aa wrote them.
"""

import gzip
from pathlib import Path

import h5py
import numpy as np
import pytest

import ffrobot as library
from ffrobot.results.file import Results

OLD = Path(__file__).with_name("of_0.2")


@pytest.fixture
def old(tmp_path):
    """A folder with the files, and the scene that they hold."""
    for file in OLD.glob("*.gz"):
        (tmp_path / file.stem).write_bytes(gzip.decompress(file.read_bytes()))
    with h5py.File(tmp_path / "complete.h5") as file:
        (tmp_path / "scene.toml").write_text(file.attrs["scene"], encoding="utf-8")
    return tmp_path


def test_they_are_read_as_new_ones(old):
    """Every history, the verdict, skipped lines and warnings, against a new solve of the same scene.

    Steps of both end alike but for round-off: they differ by far less than both are off a solve in finer steps.
    """
    new = library.solve(old / "scene.toml")
    text = (old / "scene.toml").read_text(encoding="utf-8")
    (old / "finer.toml").write_text(text.replace("tolerance = 1e-6", "tolerance = 1e-10"), encoding="utf-8")
    finer = library.solve(old / "finer.toml")
    with Results(old / "complete.h5") as results:
        assert results.analyses == new.analyses == ["inverse", "forward"]
        assert results.skipped == new.skipped
        assert results.warnings == new.warnings
        assert list(results.verdict["inverse"].lines()) == list(new.verdict["inverse"].lines())
        for analysis in results.analyses:
            assert set(results.histories(analysis)) <= set(new.histories(analysis))
            for name, values in results.columns(analysis).items():
                if name.startswith("constraint_violation"):
                    continue  # rounding
                found = new.data(f"{analysis}/{name}")[:, 0]
                error = np.abs(finer.data(f"{analysis}/{name}")[:, 0] - values).max()
                atol = max(1e-6 * np.abs(values).max(), 0.05 * error)
                np.testing.assert_allclose(found, values, rtol=0, atol=atol, err_msg=name)
        np.testing.assert_allclose(results.modal("inverse", "arm"), new.modal("inverse", "arm"), atol=1e-9)
        assert results.modal_body("arm").mode_count == 2


@pytest.mark.parametrize(
    "command",
    [
        ("info", "complete.h5"),
        ("feasibility", "complete.h5"),
        ("export", "complete.h5", "--format", "csv"),
        ("plot", "complete.h5", "-o", "figures", "--format", "png"),
        ("plot", "complete.h5", "--movie", "motion.gif", "--seconds", "0.2"),
        ("view", "complete.h5", "-o", "grids"),
        ("report", "complete.h5", "stopped.h5", "-o", "page.html"),
    ],
)
def test_every_reader_opens_them(old, ffrobot, command):
    ffrobot.ok(*command, cwd=old)


def test_they_are_neither_resumed_nor_solved_again(old):
    """Coordinates of stopped ones are those of the plane: what a run in space needs is missing. The files stay."""
    before = {path: path.read_bytes() for path in old.glob("*.h5")}
    with pytest.raises(library.InputError, match=r"resume/multipliers\", found none|found that ffrobot 0\.2\.0"):
        library.solve(old / "scene.toml", old / "stopped.h5", resume=True)
    results = library.solve(old / "scene.toml", old / "complete.h5", resume=True)
    assert results.ffrobot_version == "0.2.0"
    assert {path: path.read_bytes() for path in old.glob("*.h5")} == before
