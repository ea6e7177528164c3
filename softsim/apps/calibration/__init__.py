"""Calibration of a plane section, so that it represents a body in space.

Quasi-static experiments on both give the parameters of the section. A ring of n spikes that is
pressed against a pipe by d exerts the force sum(k d cos^2) = k d n/2: in the section each of the
two strips stands for n/4 spikes. With equal force on each spike the walls carry n of them around
the body in space and n/2 in the section, half as much.

Modules in reading order:

    experiments  scenes of the experiments, their evaluation, figure and tables
    running      the experiments in sequence
    command      `softsim calibrate-section`
"""
