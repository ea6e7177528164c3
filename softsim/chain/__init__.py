"""Robot as a chain of masses on springs: the analytical model of Leafbot (Nguyen's thesis, 5.1).

Modules in reading order, after the schema of a chain's file in scene/chain.py:

    vectors      vectors in the plane or in space
    lattice      nodes and links: one line in the plane, or two side by side in space; headings
    backbone     links of constant length: bending moments, constraints, force of the wave
    ground       limbs as springs, damping and friction
    motor        forces of eccentric masses
    chain        all of these together: accelerations and energies
    loading      a chain from a file or by name
    refusals     checks of a scene
    building     construction of a chain from its scene
    integrators  time integration
    motion       motion of a chain: energies, measures
    track        path of a chain with two motors
    running      from the file to the folder of results

x runs forward along the ground, y to the left, z up, zero where the limbs just touch. A chain in
the plane has x and z; only its lattice depends on the number of dimensions. Nodes are numbered from
the front, those of the left line first. The package does not import Taichi.
"""
