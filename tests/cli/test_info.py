"""`ffrobot info` says unit and meaning of every dataset there is."""

import re
from dataclasses import fields

import h5py
import pytest
from datasets import datasets

from ffrobot.actuation.control.metrics import Metrics
from ffrobot.actuation.control.placement import Evaluation
from ffrobot.actuation.feasibility import PatchFeasibility, Remedies, Unsupplied
from ffrobot.actuation.motors import MotorFeasibility
from ffrobot.actuation.patches.composite import StructureEffect
from ffrobot.common.hdf5 import in_memory
from ffrobot.common.meanings import MODAL_BODY, RESULTS, meaning, names_of, write_record
from ffrobot.fe_models.modal_body import Interface, MeasuredValues, OutlinedPatches, PictureMesh, Stations, StressPoint
from ffrobot.mbs.quantities.settling import Settling
from ffrobot.mbs.quantities.stress import SectionLoads
from ffrobot.mbs.quantities.supply import Energies
from ffrobot.present.info import describe

# inverse and forward motion, patches, linear models, compliant gears, motion in 3D
CASES = ("two_link_patched", "two_link_linear", "compliant_arm", "slider_crank_3d")


@pytest.mark.parametrize("case", CASES)
def test_every_dataset_of_results_has_a_meaning(solved, case):
    done = solved(case)
    unknown = [f"{name}/{item}" for name in done.file for item in datasets(done.file[name])
               if not meaning(item, RESULTS)]  # fmt: skip
    assert unknown == []
    text = describe(done.folder / "scene.results.h5")
    assert "rad/s" in text
    assert "of the body's" in text


def test_every_dataset_of_a_modal_body_has_a_meaning(ffrobot, solid_arm, tmp_path):
    body = tmp_path / "body.h5"
    ffrobot.ok("link", solid_arm / "arm.toml", "-o", body)
    with h5py.File(body) as file:
        assert [name for name in datasets(file) if not meaning(name, MODAL_BODY)] == []
    text = describe(body)
    assert "under the reference condition" in text
    assert "of a unit load" in text
    # what the file was made with: by default dolfinx and SLEPc, as README and theory say
    assert re.search(r"\nassembly: dolfinx \d+(\.\d+)+\S*, UFL \d+(\.\d+)+\S*\n", text)
    assert re.search(r"\neigensolver: SLEPc \d+(\.\d+)+, Krylov–Schur with shift-and-invert\n", text)


WHOLE = (
    Energies, Evaluation, Interface, MeasuredValues, Metrics, MotorFeasibility, OutlinedPatches, PatchFeasibility,
    PictureMesh, Remedies, SectionLoads, Settling, Stations, StressPoint, StructureEffect, Unsupplied,
)  # fmt: skip
OTHERWISE = {"find_remedies", "coupling"}  # fields that are written by hand, or not at all


@pytest.mark.parametrize("record", WHOLE, ids=lambda record: record.__name__)
def test_the_table_names_each_field_of_a_record(record):
    known = {name.removeprefix("@") for name in names_of(record.__name__)}
    assert {field.name for field in fields(record)} - OTHERWISE - known == set()


def test_records_are_written_by_the_table():
    values = {name.removeprefix("@"): float(k) for k, name in enumerate(names_of("Settling"))}
    with in_memory() as file:
        write_record(file, Settling(**values))
        assert dict(file.attrs) == values
        write_record(file.create_group("gone"), Unsupplied(("arm",), with_patches=False))
        assert "families" not in file["gone"].attrs  # of no body
    assert values["tolerance"] == 5.0
