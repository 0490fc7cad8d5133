"""What a run of the tests took: sums of processor time (s) by folder, the files and tests that took most, memory.

python scripts/test_costs.py build/tests.xml
"""

import sys
import xml.etree.ElementTree as ET
from collections import Counter

MOST = 25


def main() -> None:
    """Read the report that `./test.sh` leaves (`pytest --junitxml`), and print the sums."""
    folders: Counter[str] = Counter()
    files: Counter[str] = Counter()
    tests: Counter[str] = Counter()
    largest = peak = (0.0, "")
    for case in ET.parse(sys.argv[1]).iter("testcase"):
        about = {found.get("name"): float(found.get("value", 0.0)) for found in case.iter("property")}
        file = case.get("classname", "").removeprefix("tests.").replace(".", "/")
        seconds = about.get("seconds", 0.0)
        folders[file.partition("/")[0] if "/" in file else "."] += seconds
        files[file] += seconds
        tests[f"{file}::{case.get('name')}"] += seconds
        largest = max(largest, (about.get("megabytes", 0.0), file))
        if (reached := about.get("peak", 0.0)) > 1.1 * peak[0]:  # by the test that reached it first
            peak = (reached, file)
    seconds, ((megabytes, at), (most, within)) = sum(folders.values()), (largest, peak)
    print(f"{len(tests)} tests, {seconds:.0f} s of processors")
    print(f"at most {megabytes:.0f} MB of a process after a test ({at}), {most:.0f} MB within one ({within})")
    for title, counted in (("folder", folders), ("file", files), ("test", tests)):
        print(f"\ns of processors by {title}")
        for name, seconds in counted.most_common(MOST):
            print(f"{seconds:8.1f}  {name}")


if __name__ == "__main__":
    main()
