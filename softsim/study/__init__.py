"""Studies: a scene, what varies in it, what is collected of each run and drawn.

To be read in this order:

    schema       what a study file says
    cases        a case: a scene file and settings in it; its scene, its key, its status
    axes         columns and figures
    factors      what varies: the values of a factor, and what each sets in the scene
    design       which values go together, and repeats that are perturbed at random
    composition  the scene that they make, and that it is one, before anything runs
    measures     columns read from summaries, and which of them is sought
    bisection    the boundary where a measure crosses a share: what to run next, what is known
    loading      all of this from a file, or from Python: `load_study`, `LoadedStudy`
    description  all of this in a few rows of text

Nothing here imports Taichi; `softsim.sweep` runs studies.
"""
