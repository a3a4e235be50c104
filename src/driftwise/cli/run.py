"""`driftwise run`: which job a table takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

from driftwise.cli.automatic import AutomaticJob
from driftwise.cli.estimate import EstimateJob
from driftwise.cli.grey_box import GreyBoxJob
from driftwise.cli.job import RecordJob
from driftwise.cli.observe import ObserveJob
from driftwise.cli.own_matrices import MatricesJob
from driftwise.cli.run_options import RunOptions
from driftwise.engine.errors import CommandError


class RunJob(RunOptions):
    """Estimate a system from a recorded table.

    Reads FILE chunk by chunk (any length, constant memory), estimates state and parameters at every sample,
    and prints what the plant is and how far it can be trusted. Empty cells are missing samples, not errors.
    What is not named is found out: columns, clock, model, what changed. A constant offset is estimated with the rest
    unless --offset says otherwise.

    Examples: driftwise run plant.csv --report report.html;
    driftwise run plant.csv --output temperature --input heater;
    driftwise run plant.csv --model arx:2,2,1;
    driftwise run plant.csv -o temperature -i heater --model arx:2,2,1 --jumps parameters:10000;
    driftwise run motor.csv -o angle -i voltage -t t --plant motor.toml --report report.html;
    driftwise run cell.csv --plant battery
    """

    def run(self) -> None:
        """Run the job that the options ask for."""
        if self.plant is not None:
            kind: Callable[..., RecordJob] = _plant_job(self.plant)
        elif self.model == "auto" or not self.changed:
            kind = AutomaticJob
        else:
            kind = EstimateJob
        if self.season is not None and kind is not AutomaticJob:
            raise CommandError("--season: seasons are looked for where the model is found out; name no model or plant.")
        kind(**{field.name: getattr(self, field.name) for field in fields(self)}).run()


def _plant_job(plant: str) -> Callable[..., RecordJob]:
    """Return the job of a plant: formulas, of the library too; the user's own matrices; or one that is known."""
    from driftwise.models.formulas import library
    from driftwise.tables.plantfile import sections

    path = Path(plant)
    is_no_file = path.suffix == "" and not path.exists()  # a name of the library, or meant to be one
    found = {"formulas"} if plant in library() or is_no_file else sections(plant)
    return GreyBoxJob if "formulas" in found else MatricesJob if "matrices" in found else ObserveJob
