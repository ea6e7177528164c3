"""Reach of a robot with a tether in a layout of pipes: `softsim reach`.

Modules in reading order:

    tension    tension of the tether along the paths through a layout
    pull       pulling force of a robot: drags of the trials, and the bracket that results
    trials     scenes of trials, and the result of one
    answer     distances, from tension and pulling force
    plan       paths of a layout and the trials that they need
    running    trials on the workers
    writing    result files in the folder
"""
