"""Figures and page of a study, from its folder alone: `findings`, `curve`, `plots` and `boundary`
say what is shown, `figures` and `page` show it.
"""
