"""Applications of the engine, each a package of its own.

    chain        analytical model of Leafbot, `softsim chain`
    reach        reach of a robot with a tether, `softsim reach`
    calibration  plane section that represents a body in space, `softsim calibrate-section`

Each has its command in command.py and its figures in report.py. The engine does not import them:
softsim/applications.py lists what they add to the command line, to studies and to reports.
"""
