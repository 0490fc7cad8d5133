"""Access to results by analysis: its histories as arrays and tables, its linear models, its verdict."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import h5py

from ..common.arrays import Array
from ..common.errors import InputError, quoted
from ..common.hdf5 import blaming
from ..common.libraries import extras
from .datasets import Datasets

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from ..actuation.control.linear_model import LinearModel, SampledController, StateSpace
    from .verdict import Verdict


class AnalysisAccess(Datasets):
    """Access to a results file by analysis: histories, tables, linear models, verdict."""

    @property
    def analyses(self) -> list[str]:
        """Names of the analyses in the file, in the order of the scene."""
        return [entry["name"] for entry in self.scene["analysis"] if entry["name"] in self._file]

    @property
    def verdict(self) -> Verdict:
        """Answer of each analysis: feasibility, peaks and RMS of motors, deflection, stress, warnings and advice.

        `print(results.verdict)` prints the text of `ffrobot solve --verbose`; `results.verdict["inverse"]` is one
        analysis.
        """
        from .judging import judge

        with blaming(self.path):
            return judge(self._file, self.analyses, self.scene)

    @property
    def warnings(self) -> dict[str, list[str]]:
        """Reasons why results may be wrong or misleading, by analysis."""
        return self._texts("warnings")

    @property
    def notes(self) -> dict[str, list[str]]:
        """Properties of correct results, by analysis."""
        return self._texts("notes")

    def _texts(self, kind: str) -> dict[str, list[str]]:
        texts_of = {name: self.attributes(name).get(kind, ()) for name in self.analyses}
        return {name: [str(text) for text in texts] for name, texts in texts_of.items() if len(texts)}

    def histories(self, analysis: str) -> list[str]:
        """Names of the histories of an analysis: datasets over its outputs."""
        known: dict[str, list[str]] = self.__dict__.setdefault("_histories", {})  # a walk through a file takes ms
        if analysis not in known:
            names, outputs = known.setdefault(analysis, []), len(self.time(analysis))

            def collect(name: str, item: h5py.Dataset | h5py.Group) -> None:
                if isinstance(item, h5py.Dataset) and item.shape[:1] == (outputs,) and not name.startswith("resume/"):
                    names.append(name)

            self._file[analysis].visititems(collect)
        return list(known[analysis])

    def columns(self, analysis: str) -> dict[str, Array]:
        """All histories of an analysis, one (T,) array each.

        The name is the dataset's inside the analysis, with the column where it has several:
        `points/link2.tip/position[0]`.
        """
        by_label: dict[str, Array] = {}
        for name in self.histories(analysis):
            values = self[f"{analysis}/{name}"]
            columns = values.reshape(len(values), -1)
            labels = [name] if values.ndim == 1 else [f"{name}[{k}]" for k in range(columns.shape[1])]
            by_label.update(zip(labels, columns.T, strict=True))
        return by_label

    def frame(self, analysis: str) -> DataFrame:
        """Histories of an analysis as a pandas DataFrame, indexed by time (s)."""
        with extras():
            from pandas import DataFrame

        return DataFrame(self.columns(analysis)).set_index("time")

    def to_xarray(self, analysis: str) -> Dataset:
        """All histories of an analysis as a Dataset of xarray, named as in the file: dimensions, units, coordinates.

        Dimension `time` (s), for `control/` of closed-loop runs `control/time`; further dimensions have the
        axes, modes, patches or components as coordinates. Attributes: `units`, `long_name`; of the Dataset those of the
        analysis. Raises `SolveError` where xarray is not installed.
        """
        with extras():
            from .labelled import labelled

            return labelled(self, analysis, self.histories(analysis))

    def linear(self, analysis: str) -> tuple[LinearModel, ...]:
        """Linear models of an analysis, one for each of its times. Raises `InputError` if there is none."""
        if not self.has(f"{analysis}/linear"):
            raise InputError(
                f"{self.path}: expected a linear analysis ({quoted(self._with('linear'))})", f'"{analysis}"'
            )
        from .linear import read_linear

        return read_linear(self._file, analysis)

    def controller(self, analysis: str) -> SampledController:
        """Return controllers of a closed-loop run at its start, with the observer, as one linear system of samples.

        Raises `InputError` where the analysis has none: no loop, or controllers that are not linear.
        """
        return self.controllers(analysis)[0]

    def controllers(self, analysis: str) -> tuple[SampledController, ...]:
        """Return controllers as `controller` does, one for each instant of a scheduled observer, with the same states.

        Straight lines between their matrices approximate those of the run. Raises `InputError` likewise.
        """
        if not self.has(f"{analysis}/control/controller"):
            known = quoted(self._with("control/controller"))
            raise InputError(f"{self.path}: expected a closed loop of linear controllers ({known})", f'"{analysis}"')
        from .linear import read_controllers

        return read_controllers(self._file, analysis)

    def state_spaces(self, analysis: str) -> tuple[StateSpace, ...]:
        """Return linear models of an analysis, or the controller of a run. Raises `InputError` without either."""
        is_loop = self.has(f"{analysis}/control")
        return self.controllers(analysis) if is_loop else self.linear(analysis)

    def linear_analysis(self, analysis: str | None) -> str:
        """Return `analysis`, or the first one with linear models. Raises `InputError` if there is none."""
        known = self._with("linear")
        if analysis is None and not known:
            loops = self._with("control/controller")
            hint = f"; the name of closed-loop control ({quoted(loops)}) selects its controllers" if loops else ""
            raise InputError(f'{self.path}: expected an analysis of kind = "linear"', f"none{hint}")
        return analysis or known[0]

    def export_linear(self, analysis: str | None, path: Path) -> str:
        """Write linear models (default: of the first analysis with any), or a loop's controller, to .npz or .mat.

        Returns the name of the analysis.
        """
        from .linear import save_models

        save_models(self.state_spaces(name := self.linear_analysis(analysis)), path)
        return name

    def _with(self, group: str) -> list[str]:
        """Names of the analyses with such a group."""
        return [name for name in self.analyses if self.has(f"{name}/{group}")]
