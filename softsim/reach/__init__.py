"""How far a robot gets, trailing its tether: `softsim reach`.

To be read in this order:

    tension    what the tether pulls with, along the ways through a layout
    pull       what a robot can pull: where trials are to go, and the bracket that they leave
    trials     the scenes of trials, and what one of them says
    answer     metres, from both
    plan       what a layout asks for
    running    trials on the workers
    writing    the answer in the folder
"""
