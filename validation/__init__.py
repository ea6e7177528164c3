"""The simulator against the thesis and against published measurements: scripts and two pages.

    python -m validation [--quick] [--only NAME]... [--digitised DIR] [--json FILE] [--out DIR]

`statements` lists what the thesis states, `thesis` holds its numbers, `cases` runs scenes,
`verdicts` compares, `page` writes the pages, `published` holds the scripts on measurements of
others.
"""
