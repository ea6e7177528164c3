"""Reach of a robot with a tether in a layout of pipes: `softsim reach`.

Modules in reading order:

    trials    scenes of trials, the result of one, and the bracket of the pulling force
    distance  tension of the tether, and the distance that follows from it and the pulling force
    running   plan of a layout, trials on the workers, reach.json
    report    figure and numbers
    command   `softsim reach`
"""
