"""A robot as a chain of masses on springs: the analytical model of Leafbot (Nguyen's thesis, 5.1).

To be read in this order:

    schema       what a chain's file says
    backbone     links of constant length that bend: bending moments, constraints, the wave's pull
    ground       limbs as springs that push, and what damps and rubs
    motor        the force of an eccentric mass
    chain        all of these together: accelerations and energies
    loading      a chain from a file or by name
    refusals     what a file may not say
    building     what a file says, as a chain
    integrators  steps through time
    motion       what a run finds: energies, measures
    running      from the file to the folder of results

A vector in the plane is a complex number, x + i z: x forward along the ground, z up from it, both
zero where the limbs just touch. The dot product of a and b is Re(conj(a) b), a quarter turn is a
factor i. Nodes are counted from the head. Nothing here imports Taichi.
"""
