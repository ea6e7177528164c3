"""Results of a calibration."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.calibration.curves import WallCurve
from softsim.calibration.mapping import Mapping
from softsim.calibration.specimen import SpecimenStiffness


@dataclass(frozen=True)
class Stiffnesses:
    """Stiffnesses of reference and section along one axis."""

    axis: str
    reference: SpecimenStiffness
    section: SpecimenStiffness

    @property
    def ratio(self) -> float:
        """Stiffness of the reference over that of the section [-]."""
        return self.reference.value / self.section.value


@dataclass(frozen=True)
class Calibration:
    """Parameters with which a plane section represents a body in space.

    mapping: at the section's `thickness` [m]. pushed_at: pressures [Pa] on the reference and on the
    section at which the frame was pushed. stiffnesses: measured in the push, transverse to the pipe
    first; empty if the reference has no frame to push. thick_mapping: the mapping at
    `equivalent_thickness`. spikes: number around a row. remarks: warnings on incomplete results.
    """

    reference: WallCurve
    section: WallCurve
    mapping: Mapping
    thickness: float
    spikes: int
    pushed_at: tuple[float, float]
    stiffnesses: tuple[Stiffnesses, ...] = ()
    thick_mapping: Mapping | None = None
    remarks: tuple[str, ...] = ()

    @property
    def equivalent_thickness(self) -> float | None:
        """Thickness [m] at which the section has the transverse stiffness of the reference."""
        return self.thickness * self.stiffnesses[0].ratio if self.stiffnesses else None

    @property
    def spikes_per_strip(self) -> float:
        """Spikes that a strip of the section stands for: n/4, see `softsim.calibration`."""
        return self.spikes / 4.0

    def samples(self, count: int = 9) -> dict[str, np.ndarray]:
        """Return a table over pressures from touch to the highest matched one, (count,) each.

        pressure and section_pressure (matched), line (the fitted section pressure) [Pa];
        reference_force and section_force [N] at these; reference_rows, section_rows.
        """
        m = self.mapping
        pressure = np.linspace(m.pressure[0], m.pressure[-1], count)
        on_section = np.interp(pressure, m.pressure, m.section_pressure)
        line = m.line(pressure)
        return {
            "pressure": pressure,
            "section_pressure": on_section,
            "line": line,
            "reference_force": self.reference.force_at(pressure),
            "section_force": self.section.force_at(line),
            "reference_rows": self.reference.rows_at(pressure),
            "section_rows": self.section.rows_at(line),
        }

    def as_json(self) -> dict[str, Any]:
        """Return all results as plain numbers and lists, SI units."""
        found: dict[str, Any] = {
            "factor": self.mapping.factor,
            "offset": self.mapping.offset,
            "largest_deviation": self.mapping.largest_deviation,
            "touch": self.reference.touch,
            "section_touch": self.section.touch,
            "highest_matched": float(self.mapping.pressure[-1]),
            "reference_kinetic_share": self.reference.largest_kinetic_share,
            "section_kinetic_share": self.section.largest_kinetic_share,
            "thickness": self.thickness,
            "spikes": self.spikes,
            "equivalent_thickness": self.equivalent_thickness,
            "pushed_at": list(self.pushed_at),
            "stiffness": {
                s.axis: {
                    "reference": vars(s.reference),
                    "section": vars(s.section),
                    "ratio": s.ratio,
                }
                for s in self.stiffnesses
            },
            "samples": {name: values.tolist() for name, values in self.samples().items()},
            "remarks": list(self.remarks),
        }
        if self.thick_mapping is not None:
            found["at_equivalent_thickness"] = {
                "factor": self.thick_mapping.factor,
                "offset": self.thick_mapping.offset,
                "largest_deviation": self.thick_mapping.largest_deviation,
            }
        for name, curve in (("reference", self.reference), ("section", self.section)):
            found[f"{name}_curve"] = {key: values.tolist() for key, values in vars(curve).items()}
        return found
