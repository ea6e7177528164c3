"""What materials do over frequency."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from softsim.cli.explaining import explained
from softsim.cli.options import Overrides


def spectrum(
    materials: Annotated[
        list[str],
        typer.Argument(help="Materials of the library, or scene files.", show_default=False),
    ],
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option(help="Figure; default: NAME_spectrum.png here.")
    ] = None,
) -> None:
    """Draw storage modulus and loss factor over frequency, a spectrum beside the branches that
    stand for it, and say how well they do.
    """
    with explained() as console:
        from softsim.commands.spectrum import named_spectra
        from softsim.report.spectra import draw_spectra, spectra_rows

        found = named_spectra(materials, overrides or [])
        figure = out or Path(f"{Path(materials[0]).stem}_spectrum.png")
        draw_spectra(found, figure)
        for each in found:
            console.print(each.name, style="bold", highlight=False)
            table = Table(show_header=False, box=None)
            for row in spectra_rows(each):
                table.add_row(*row)
            console.print(table)
        console.print(f"figure  {figure}", highlight=False)
