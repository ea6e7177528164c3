"""Robot as a chain of masses on springs: the analytical model of Leafbot (Nguyen's thesis, 5.1).

Modules in reading order:

    scene      keys of a chain's file; a chain from a file or by name
    mechanics  lattice in the plane or in space, links, forces, accelerations and energies
    motion     time integration, energies, measures, path of a chain with two motors
    running    checks of a scene, construction, the folder of results, cases of studies
    report     figure and numbers
    command    `softsim chain`

x runs forward along the ground, y to the left, z up, zero where the limbs just touch. A chain in
the plane has x and z; only its lattice depends on the number of dimensions. Nodes are numbered from
the front, those of the left line first. The package does not import Taichi.
"""
