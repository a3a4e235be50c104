"""`driftwise run`: which job a table takes."""

from __future__ import annotations

from dataclasses import fields

from driftwise.cli.automatic import AutomaticJob
from driftwise.cli.estimate import EstimateJob
from driftwise.cli.grey_box import GreyBoxJob
from driftwise.cli.observe import ObserveJob
from driftwise.cli.own_matrices import MatricesJob
from driftwise.cli.run_options import RunOptions
from driftwise.models.formulas import is_formulas


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
            from driftwise.tables.matricesfile import is_matrices

            kind: type[RunOptions] = MatricesJob if is_matrices(self.plant) else ObserveJob
            kind = GreyBoxJob if is_formulas(self.plant) else kind
        elif self.model == "auto" or not self.changed:
            kind = AutomaticJob
        else:
            kind = EstimateJob
        kind(**{field.name: getattr(self, field.name) for field in fields(self)}).run()
