"""Studies: a scene, the factors that vary in it, the measures of each run, and figures.

To be read in this order:

    schema     the keys of a study file, columns and figures
    cases      a case: a scene file and settings in it; its scene, its key, its status
    factors    factors: their values, and the settings of the scene for each value
    design     combinations of values, and repeats that are perturbed at random; the scene of a
               combination, and its check before anything runs
    measures   columns read from summaries, and the objective among them
    bisection  the boundary where a measure crosses a threshold: next runs, present state
    loading    all of this from a file, or from Python: `load_study`, `LoadedStudy`; as text;
               the study of `softsim assess --repeats`

Nothing here imports Taichi; `softsim.sweep` runs studies.
"""
