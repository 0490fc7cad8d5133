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
    largest, grown = (0.0, ""), Counter[str]()
    peak = 0.0
    for case in ET.parse(sys.argv[1]).iter("testcase"):
        about = {found.get("name"): float(found.get("value", 0.0)) for found in case.iter("property")}
        file = case.get("classname", "").removeprefix("tests.").replace(".", "/")
        seconds = about.get("seconds", 0.0)
        folders[file.partition("/")[0] if "/" in file else "."] += seconds
        files[file] += seconds
        tests[f"{file}::{case.get('name')}"] += seconds
        largest = max(largest, (about.get("megabytes", 0.0), file))
        peak = max(peak, about.get("peak", 0.0))
        grown[file] += about.get("grown", 0.0)
    print(f"{len(tests)} tests, {sum(folders.values()):.0f} s of processors")
    print(f"at most {largest[0]:.0f} MB of a process after a test ({largest[1]}), {peak:.0f} MB within one")
    counts = {"s of processors by folder": folders, "s of processors by file": files, "s of processors by test": tests}
    for title, counted in (counts | {"MB by which the largest size of a process grew, by file": grown}).items():
        print(f"\n{title}")
        for name, seconds in counted.most_common(MOST):
            print(f"{seconds:8.1f}  {name}")


if __name__ == "__main__":
    main()
