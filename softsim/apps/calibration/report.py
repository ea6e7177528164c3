"""Results of a section calibration: curves, numbers, and the lines for the scene."""

from pathlib import Path

from softsim.apps.calibration.result import FORCE_SHARE, Calibration, PressureMapping
from softsim.report.diagram import FLAT, STEPS, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.png import draw
from softsim.report.style import BLUE, INK, ORANGE
from softsim.report.table import Table, cell


def draw_calibration(found: Calibration, path: Path) -> None:
    """Draw `calibration_diagram` as PNG. Raises OutputError if the file cannot be written."""
    draw(path, calibration_diagram(found))


def calibration_diagram(found: Calibration) -> Diagram:
    """Return the diagram of wall force, section pressure and rows in contact over the pressure.

    The section is plotted at the pressures of the fitted line.
    """
    reference, section, m = found.reference, found.section, found.mapping
    seen = reference.pressure <= m.pressure[-1]
    inflated = m.line(reference.pressure[seen])
    covered = (inflated >= section.pressure[0]) & (inflated <= section.highest)
    p, over = reference.pressure * 1e-3, reference.pressure[seen][covered] * 1e-3
    force, rows = section.force_at(inflated[covered]), section.rows_at(inflated[covered])
    line = f"q = {m.factor:.3g} (p - {m.offset * 1e-3:.3g} kPa)"
    forces = [
        PlotSeries(
            f"reference, {FORCE_SHARE:g} of the force", p, FORCE_SHARE * reference.force, BLUE
        ),
        PlotSeries("section, at factor x (p - offset)", over, force, ORANGE, "--"),
    ]
    pressures = [
        PlotSeries("equal force per spike", m.pressure * 1e-3, m.section_pressure * 1e-3, INK),
        PlotSeries(line, m.pressure * 1e-3, m.line(m.pressure) * 1e-3, ORANGE, "--"),
    ]
    touching = [
        PlotSeries("reference", p, reference.rows, BLUE, STEPS),
        PlotSeries("section", over, rows, ORANGE, STEPS),
    ]
    panels = [
        Panel(PlotAxis(Scale("wall force [N]"), forces)),
        Panel(PlotAxis(Scale("pressure of the section q [kPa]"), pressures)),
        Panel(
            PlotAxis(Scale("rows in contact", whole=True, from_zero=True), touching), height=FLAT
        ),
    ]
    return Diagram("Calibration", Scale("pressure of the reference p [kPa]"), panels)


def calibration_rows(found: Calibration) -> list[tuple[str, str]]:
    """Return the numbers of a calibration as (name, text)."""
    m = found.mapping
    each = found.thickness / found.spikes_per_strip
    kinetic = [100 * c.largest_kinetic_share for c in (found.reference, found.section)]
    rows = [
        (
            "first contact",
            f"{_kpa(found.reference.touch)} (reference), {_kpa(found.section.touch)} (section)",
        ),
        (
            "matched up to",
            f"{_kpa(m.pressure[-1])} (reference), {_kpa(m.section_pressure[-1])} (section)",
        ),
        ("factor", f"{m.factor:.4g}"),
        ("offset", _kpa(m.offset)),
        ("largest error", f"{_kpa(m.largest_deviation)} of the section pressure"),
        (
            "kinetic energy",
            f"at most {kinetic[0]:.2g} % of the internal energy (reference), {kinetic[1]:.2g} % "
            "(section)",
        ),
        (
            "thickness",
            f"{found.thickness * 1e3:.4g} mm per strip, which represents n/4 = "
            f"{found.spikes_per_strip:g} spikes of {each * 1e3:.3g} mm",
        ),
    ]
    for s, direction in zip(found.stiffnesses, ("transverse", "along the pipe"), strict=False):
        rows.append(
            (
                f"stiffness, {direction}",
                f"{s.reference.value:.4g} N/m at {_kpa(found.pushed_at[0])} (reference), "
                f"{s.section.value:.4g} N/m at {_kpa(found.pushed_at[1])} (section), ratio "
                f"{s.ratio:.3g}",
            )
        )
    if found.equivalent_thickness is not None:
        rows.append(
            (
                "equivalent thickness",
                f"{found.equivalent_thickness * 1e3:.4g} mm, for equal transverse stiffness",
            )
        )
    return rows


def sample_table(found: Calibration) -> Table:
    """Return the table of the comparison at some pressures."""
    headings = ["p [kPa]", "q, matched [kPa]", "q, linear fit [kPa]", "force, reference [N]",
                "force, section [N]", "rows, reference", "rows, section"]  # fmt: skip
    columns = [
        [cell(value * scale, form) for value in values]
        for values, (scale, form) in zip(
            found.samples().values(),
            [*[(1e-3, ".2f")] * 3, *[(1.0, ".3f")] * 2, *[(1.0, ".0f")] * 2],
            strict=True,
        )
    ]
    return Table(list(zip(*columns, strict=True)), headings)


def scene_lines(found: Calibration, pressure: str, body: str) -> str:
    """Return the YAML lines for the section's scene, with its own or the equivalent thickness."""
    blocks = [_block(pressure, body, found.mapping, found.thickness, "section as in the scene")]
    if found.thick_mapping is not None and found.equivalent_thickness is not None:
        thick = (found.thick_mapping, found.equivalent_thickness)
        blocks.append(
            _block(pressure, body, *thick, "alternative: equal transverse stiffness as well")
        )
    return "\n\n".join(blocks)


def _block(pressure: str, body: str, m: PressureMapping, thickness: float, remark: str) -> str:
    return (
        f"# {remark}\n"
        f"bodies:\n  {body}:\n    thickness: {thickness * 1e3:.4g} mm\n"
        f"loads:\n  {pressure}:\n    factor: {m.factor:.4g}\n    offset: {_kpa(m.offset)}"
    )


def _kpa(pressure: float) -> str:
    return f"{pressure * 1e-3:.4g} kPa"
