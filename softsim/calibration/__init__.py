"""What a plane section has to be given so that it stands for a body in space: quasi-static
experiments on both, and the numbers that follow.

A ring of n spikes that is pressed against a pipe by d meets it with the force sum(k d cos^2) =
k d n/2: in the section each of the two strips stands for n/4 spikes. With equal force on a spike
the walls feel n of them around the body in space and n/2 in the section, half as much.
"""
