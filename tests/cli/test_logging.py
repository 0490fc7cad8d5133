"""`--verbose` and `--log-file`: stages, analyses and errors, and all that the summary leaves out."""

import re


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
