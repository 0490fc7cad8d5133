"""What MPI leaves behind of a process that runs alone."""

import os
import subprocess
import sys

KILLED = """
import os
from ffrobot.common.parallel import without_daemon
without_daemon()
from mpi4py import MPI
print(MPI.COMM_WORLD.size)
os._exit(0)
"""


def test_a_process_that_is_killed_leaves_no_folder_of_open_mpi(tmp_path):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("OMPI_")}
    done = subprocess.run(
        [sys.executable, "-c", KILLED], env=environment | {"TMPDIR": str(tmp_path)}, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, "1\n")
    assert not list(tmp_path.iterdir())
