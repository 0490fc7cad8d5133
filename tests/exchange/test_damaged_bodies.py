"""Damaged SID and .fem files: read, or refused in one line; numbers that no body has, in modal body files."""

import random
import re
import warnings
from collections import Counter

import h5py
import numpy as np
import pytest
from beam_links import beam_link, circle
from hostile import Damage

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.exchange.bodies.mbdyn import fem_text
from ffrobot.exchange.bodies.sid import sid_text
from ffrobot.exchange.export import import_body
from ffrobot.fe_models.modal_body_file import read_modal_body


@pytest.fixture(scope="module")
def given():
    """A file of each format and reference condition, short ones."""
    found = {}
    for condition in ("cantilever", "simply-supported", "craig-bampton"):
        modes = {"count": 1, "family": ["in-plane-bending", "torsion"]}
        body = ffrobot.make_link(beam_link(0.6, circle(0.02), 2, condition=condition, name="arm", modes=modes)).body
        found[condition, ".SID_FEM"], found[condition, ".fem"] = sid_text(body)[0], fem_text(body)[0]
    return found


def test_random_changes(given, tmp_path):
    """No warning of Python's or NumPy's either."""
    chance, ends = random.Random("suite"), Counter()
    damage = Damage(chance, b"")
    for _ in range(300):
        (condition, suffix), text = chance.choice(sorted(given.items()))
        content, how = damage.of(text.encode())
        path = tmp_path / f"a{suffix}"
        path.write_bytes(content)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                import_body(path, tmp_path / "body.h5")
            except InputError as error:
                told = str(error)
                assert told.startswith(f"{path}: "), (condition, how, told)
                assert "\n" not in told, (condition, how, told)
                assert len(told) < len(str(path)) + 500, (condition, how, told)
                ends["rejected"] += 1
            else:
                ends["read"] += 1
    assert min(ends["read"], ends["rejected"]) > 30


CHANGES = {
    "size": (".SID_FEM", r"(phi\n(?:.*\n){2}\s*ncol\s*=)\s*\d+", r"\g<1> 1", r"phi: expected a matrix of 3 × \d+"),
    "symmetry": (".SID_FEM", r"(phi\n(?:.*\n){5}\s*structure\s*=)\s*\d+", r"\g<1> 2", r"phi: expected a square matrix"),
    "interface": (".SID_FEM", r"tip=\d+", "tip=99", 'expected NAME=NUMBER of nodes in the file, found "tip=99"'),
    "node twice": (".SID_FEM", r"(new node +=) +2\b", r"\g<1> 1", "frame: expected nodes with a number each"),
    "number twice": (".fem", r"(NODE LIST\n1) 2", r"\g<1> 1", r"record 2: expected \d+ different numbers of nodes"),
    "end": (".SID_FEM", " end part", "", "expected `end part`"),
    "object": (".SID_FEM", r"(?s)\n +Oe\n.*?end Oe", "", "expected the object Oe in modal, found none"),
    "no stiffness": (".SID_FEM", r"(?s)Ke\n(.*?)m0\(.*?end Ke", r"Ke\n\1end Ke", "a positive stiffness"),
    "cut": (".fem", r"(?s)\*\* RECORD GROUP 14.*", "", "which couple modes with rigid motion"),
    "not symmetric": (".fem", r"(MODAL STIFFNESS MATRIX\n\S+) \S+", r"\g<1> 1e6", "K_e: expected a symmetric matrix"),
    "numbers": (".fem", r"\*\* RECORD GROUP 10", "1\n** RECORD GROUP 10", r"record 9: expected \d+"),
    "huge": (".fem", r"(RECORD GROUP 14.*\n)\S+", r"\g<1>1e200", "modal_mass, less S_bar and I_bar: expected no"),
}  # fmt: skip


@pytest.mark.parametrize(("suffix", "old", "new", "told"), CHANGES.values(), ids=CHANGES)
def test_messages(given, tmp_path, suffix, old, new, told):
    text = given["cantilever", suffix]
    changed = re.sub(old, new, text, count=1)
    assert changed != text
    path = tmp_path / f"arm{suffix}"
    path.write_text(changed)
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}: .*{told}"):
        import_body(path, tmp_path / "arm.h5")
    assert not (tmp_path / "arm.h5").exists()


DATASETS = (
    "mass", "second_moment", "invariants/I_bar", "interfaces/tip/rotation", "stations/position", "mesh/points",
    "modes/frequency", "geometric_stiffness/omega_zz", "length",
)  # fmt: skip


@pytest.mark.parametrize("dataset", DATASETS)
@pytest.mark.parametrize(("value", "found"), [(1e300, "1e+300"), (1 + 2j, "complex ones"), ("text", "text")])
def test_numbers_of_modal_bodies(tmp_path, dataset, value, found):
    """By name, and in no words of NumPy's."""
    link = beam_link(0.6, circle(0.02), 4, name="arm", modes={"count": 2})
    path = tmp_path / "arm.h5"
    path.write_bytes(ffrobot.make_link(link).path.read_bytes())
    with h5py.File(path, "r+") as file:
        del file.attrs["checksum"]  # as another program would write it
        values = np.asarray(file[dataset][()])
        del file[dataset]
        if isinstance(value, str):
            file.create_dataset(dataset, data=np.full(values.shape, value, object), dtype=h5py.string_dtype())
        else:
            values = values.astype(np.result_type(values, value))
            values[(0,) * values.ndim] = value
            file[dataset] = values
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError, match=rf"^{re.escape(str(path))}: {dataset}: expected .*{re.escape(found)}"):
            read_modal_body(path)
