"""Summaries, what is loaded to print them, `--verbose` and `--log-file`: stages, analyses and errors."""

import re
import subprocess
import sys

FORBIDDEN = ("dolfinx", "gmsh", "petsc4py", "slepc4py", "mpi4py", "matplotlib", "scipy", "numpy.typing")


def test_summary(two_link):
    """Every number a reader asks for first, in whole words."""
    out = two_link.stdout
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line.strip()}
    for name in ("forward", "joints_only"):
        assert lines[name][1] == "forward"
        assert "dop853" in lines[name][2:5]
    required = two_link.file["inverse/pzt/link1/required_voltage"].attrs["peak"].max()
    flat = " ".join(out.split())  # texts may go over two lines
    for text in (
        "steps", "tolerance", "violation", "wall (s)", "largest (V)", "required /", "condition", "accuracy",
        "time integration: 1e-07 of peaks, requested tolerance", "modes: not estimated", "wall time", "writing",
        "omitted", "damping, which is zero", "no realistic patch can supply the voltages of link1, link2",
        f"{required:.5g}", f"{required / 200:.3g}",
    ):  # fmt: skip
        assert text in flat
    for text in ("…", "\x1b", "V is sufficient"):  # a limit of 97 kV
        assert text not in flat
    assert flat.endswith("scene.results.h5")


def test_stage_2_works_where_stage_1_is_not_installed(two_link_copy, two_link, ffrobot, tmp_path):
    """A solve from modal files imports neither the finite element libraries nor what a start would wait for.

    They are in the cache since `two_link`.
    """
    folder = two_link_copy({"scene.toml": {"end = 1.0": "end = 0.01"}})
    program = f"""
import sys
for name in {FORBIDDEN!r}:
    sys.modules[name] = None  # import raises ModuleNotFoundError
sys.argv = ["ffrobot", "solve", "scene.toml", "-o", {str(tmp_path / "r.h5")!r}]
from ffrobot.cli import main
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=folder, env=ffrobot.environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "r.h5").exists()


def test_verbose_goes_to_the_error_stream(ffrobot, case_copy):
    scene = case_copy("slider_crank")
    ffrobot("solve", scene)  # stage 1
    quiet, verbose = ffrobot("solve", scene), ffrobot("solve", scene, "--verbose")
    assert quiet.stderr == ""
    assert re.search(r'analysis "inverse": completed at t = 0.2 s, \d+ steps, \d+ rejected', verbose.stderr)
    assert "wall time" in verbose.stdout
    assert "wall time" not in quiet.stdout


def test_log_file_keeps_the_runs_in_order(ffrobot, case_copy):
    scene = case_copy("slider_crank")
    log = scene.with_name("run.log")
    assert ffrobot("solve", scene, "--log-file", log).returncode == 0
    wrong = scene.with_name("wrong.toml")
    wrong.write_text(scene.read_text(encoding="utf-8").replace("kind =", "knid ="), encoding="utf-8")
    done = ffrobot("solve", wrong, "--log-file", log)
    assert done.returncode == 2
    lines = log.read_text(encoding="utf-8").splitlines()
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d", line) for line in lines if "wrong.toml:" not in line)
    assert lines.index(next(line for line in lines if "completed" in line)) < len(lines) - 2
    assert "knid" in "".join(lines[lines.index(next(line for line in lines if "ERROR" in line)) :])
    assert done.stderr.count('did you mean "kind"?') == 2  # once for each analysis


def test_a_log_that_cannot_be_written_ends_with_one_message(two_link_copy, ffrobot):
    """The command itself goes on."""
    folder = two_link_copy()
    done = ffrobot("link", "link1.toml", "--log-file", "/dev/full", cwd=folder)
    assert done.returncode == 0
    assert done.stderr == "ffrobot: /dev/full: log ends here: No space left on device\n"
    assert (folder / "link1.h5").exists()


def test_log_has_what_a_reader_met_in_a_file(ffrobot, two_link_copy):
    """Damage or a fault of the program: the message is the same, the traceback tells."""
    folder = two_link_copy()
    (folder / "link1.h5").write_text("no HDF5", encoding="ascii")
    scene = (folder / "scene.toml").read_text(encoding="utf-8").replace('link = "link1.toml"', 'modal = "link1.h5"')
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    done = ffrobot("solve", "scene.toml", "--log-file", "log", cwd=folder)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert re.search(r" ERROR .*link1\.h5.*\nTraceback(.*\n)+OSError", (folder / "log").read_text(encoding="utf-8"))
