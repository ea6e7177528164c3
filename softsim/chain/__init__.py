"""A robot as a chain of masses on springs: the analytical model of Leafbot (Nguyen's thesis, 5.1).

To be read in this order:

    schema       what a chain's file says
    vectors      of the plane or of space
    lattice      which nodes links join: of one line in the plane, of two side by side in space;
                 where nodes look
    backbone     links of constant length that bend: bending moments, constraints, the wave's pull
    ground       limbs as springs that push, and what damps and rubs
    motor        the forces of eccentric masses
    chain        all of these together: accelerations and energies
    loading      a chain from a file or by name
    refusals     what a file may not say
    building     what a file says, as a chain
    integrators  steps through time
    motion       what a run finds: energies, measures
    track        where two motors steer to
    running      from the file to the folder of results

x runs forward along the ground, y to the left, z up, zero where the limbs just touch. A chain in
the plane has x and z; nothing but its lattice knows in how many dimensions it moves. Nodes are
counted from the front, those of the left line first. Nothing here imports Taichi.
"""
