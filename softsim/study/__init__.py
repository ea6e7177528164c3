"""Studies: a scene, what varies in it, what is collected of each run and drawn.

To be read in this order:

    schema       what a study file says
    cases        a case: a scene file and settings in it; its scene, its key, its status
    values       values of a factor: numbers in a unit, intervals
    factors      what varies, and what each value sets in the scene
    design       which values go together, and the scene that they make
    repeats      cases run several times, perturbed at random
    axes         columns and figures
    measures     columns read from summaries, and which of them is sought
    bisection    the boundary where a measure crosses a share: what to run next, what is known
    check        the scenes of a study are tried before anything runs
    loading      all of this from a file, or from Python: `load_study`, `LoadedStudy`
    preview      the study in a few rows of text

Nothing here imports Taichi; `softsim.sweep` runs studies.
"""
