"""Figures and page of a study, from its folder alone.

`findings` holds the results and the boundaries of a bisection; `plots` draws them as PNG files and
in the page.
"""
