"""Figures and page of a study, from its folder alone.

`findings`, `curve`, `plots` and `boundary` define the content; `figures` and `page` draw it.
"""
