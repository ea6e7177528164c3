"""The thesis's statements against this simulator: one script a figure, one page with all verdicts.

    python -m validation [--quick] [--only NAME]... [--digitised DIR] [--json FILE] [--out DIR]

`thesis` has its numbers, `cases` runs scenes, `verdicts` judges, `page` tells.
"""
