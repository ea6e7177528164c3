"""A section calibrated by a body in space: curves, numbers, and the lines for its scene."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.calibration.mapping import FORCE_SHARE, Mapping
from softsim.calibration.result import Calibration
from softsim.report.style import BLUE, INK, ORANGE, drawing


def draw_calibration(found: Calibration, path: Path) -> None:
    """Wall force, pressure on the section and rows in contact over the pressure in space, as PNG.

    The section is drawn at the pressures that the fitted line gives it.
    Raises OutputError if the disk refuses.
    """
    reference, m = found.reference, found.mapping
    seen = reference.pressure <= m.pressure[-1]
    inflated = m.line(reference.pressure[seen])
    covered = (inflated >= found.section.pressure[0]) & (inflated <= found.section.highest)
    over = reference.pressure[seen][covered] * 1e-3
    with drawing(path, height=6.2) as figure:
        force, mapping, rows = figure.subplots(3, sharex=True, height_ratios=[3, 3, 1.6])
        force.plot(
            reference.pressure * 1e-3, FORCE_SHARE * reference.force, color=BLUE,
            label=f"reference, {FORCE_SHARE:g} of it",
        )  # fmt: skip
        force.plot(
            over, found.section.force_at(inflated[covered]), "--", color=ORANGE,
            label="section, at factor x (p - offset)",
        )  # fmt: skip
        force.set_ylabel("force on the wall [N]")
        force.legend(loc="upper left")
        _draw_mapping(mapping, m)
        rows.step(
            reference.pressure * 1e-3, reference.rows, where="mid", color=BLUE, label="reference"
        )
        rows.step(
            over, found.section.rows_at(inflated[covered]), "--", where="mid", color=ORANGE,
            label="section",
        )  # fmt: skip
        rows.set_ylabel("rows in contact")
        rows.yaxis.get_major_locator().set_params(integer=True)
        rows.set_ylim(bottom=0.0)
        rows.set_xlabel("pressure in space p [kPa]")
        rows.set_xlim(0.0, reference.highest * 1e-3)
        figure.align_ylabels()


def _draw_mapping(axes: Axes, m: Mapping) -> None:
    axes.plot(
        m.pressure * 1e-3, m.section_pressure * 1e-3, color=INK, label="equal force on a spike"
    )
    axes.plot(
        m.pressure * 1e-3, m.line(m.pressure) * 1e-3, "--", color=ORANGE,
        label=f"q = {m.factor:.3g} (p - {m.offset * 1e-3:.3g} kPa)",
    )  # fmt: skip
    axes.set_ylabel("pressure on the section q [kPa]")
    axes.legend(loc="upper left")


def calibration_rows(found: Calibration) -> list[tuple[str, str]]:
    """The numbers of a calibration as (name, text)."""
    m = found.mapping
    each = found.thickness / found.spikes_per_strip
    kinetic = [100 * c.largest_kinetic_share for c in (found.reference, found.section)]
    rows = [
        (
            "touch",
            f"{_kpa(found.reference.touch)} in space, {_kpa(found.section.touch)} on the section",
        ),
        ("matched up to", f"{_kpa(m.pressure[-1])}, {_kpa(m.section_pressure[-1])} on the section"),
        ("factor", f"{m.factor:.4g}"),
        ("offset", _kpa(m.offset)),
        ("worst error", f"{_kpa(m.largest_deviation)} on the section"),
        (
            "kinetic energy",
            f"at most {kinetic[0]:.2g} % of the internal in space, {kinetic[1]:.2g} % in the "
            "section",
        ),
        (
            "thickness",
            f"{found.thickness * 1e3:.4g} mm a strip, which stands for n/4 = "
            f"{found.spikes_per_strip:g} spikes of {each * 1e3:.3g} mm",
        ),
    ]
    for s, direction in zip(found.stiffnesses, ("across the pipe", "along it"), strict=False):
        rows.append(
            (
                f"stiffness {direction}",
                f"{s.reference.value:.4g} N/m at {_kpa(found.pushed_at[0])} in space, "
                f"{s.section.value:.4g} N/m at {_kpa(found.pushed_at[1])} on the section, "
                f"ratio {s.ratio:.3g}",
            )
        )
    if found.equivalent_thickness is not None:
        rows.append(
            ("equivalent thickness", f"{found.equivalent_thickness * 1e3:.4g} mm, equally stiff")
        )
    return rows


def sample_rows(found: Calibration) -> tuple[list[str], list[list[str]]]:
    """Headings and lines of the comparison at some pressures."""
    samples = found.samples()
    headings = ["p [kPa]", "q matched [kPa]", "q line [kPa]", "N in space [N]", "N section [N]",
                "rows in space", "rows section"]  # fmt: skip
    scales = (1e-3, 1e-3, 1e-3, 1.0, 1.0, 1.0, 1.0)
    formats = (".2f", ".2f", ".2f", ".3f", ".3f", ".0f", ".0f")
    columns = [
        [format(value * scale, form) for value in values]
        for values, scale, form in zip(samples.values(), scales, formats, strict=True)
    ]
    return headings, [list(line) for line in np.array(columns).T.tolist()]


def scene_lines(found: Calibration, pressure: str, body: str) -> str:
    """What the section's scene has to say (YAML): as it is, or of the equivalent thickness."""
    blocks = [_block(pressure, body, found.mapping, found.thickness, "the section as it is")]
    if found.thick_mapping is not None and found.equivalent_thickness is not None:
        thick = (found.thick_mapping, found.equivalent_thickness)
        blocks.append(_block(pressure, body, *thick, "or: as stiff across the pipe too"))
    return "\n\n".join(blocks)


def _block(pressure: str, body: str, m: Mapping, thickness: float, remark: str) -> str:
    return (
        f"# {remark}\n"
        f"bodies:\n  {body}:\n    thickness: {thickness * 1e3:.4g} mm\n"
        f"loads:\n  {pressure}:\n    factor: {m.factor:.4g}\n    offset: {_kpa(m.offset)}"
    )


def _kpa(pressure: float) -> str:
    return f"{pressure * 1e-3:.4g} kPa"
