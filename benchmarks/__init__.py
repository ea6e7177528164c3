"""How fast softsim is: `python -m benchmarks`. Not part of the installed package.

A rate counts updates of elements a second: elements times increments over time. The ceiling is the
rate of reference.cpp at the same mesh and time step: the same elements, law, Maxwell branches, bulk
viscosity and what they dissipate, without contact, loads and rigid bodies, whose nodes are held.
tests/benchmarks holds its positions and energies against softsim's.

    --only         what is measured
    pfr            scenes/pfr_36mm.yaml of triangles, with all it has, one thread, at its start
    space          scenes/pfr_36mm_3d.yaml likewise, on one thread and on two
    pair           two runs of pfr at once, their sum over one alone
    triangles      a bare plate on two threads: no branches, no contact; memory of an element
    quadrilaterals likewise
    tetrahedra     a bare bar likewise
    hexahedra      likewise
    flex           the bar of tetrahedra on one thread, over the same bar as a flex of MuJoCo at an
                   explicit and at an implicit step; left out unless MuJoCo 4 or later is installed
                   (`pip install mujoco`)
    start          `softsim run` from its first instruction to the first increment
    run            `softsim run scenes/pfr_36mm.yaml`, with files and figures
    study          a sweep's cases by one command, over as many single runs
    overhead       a sweep's own time a case, the runs left out
    environments   steps of 1, 8 and 64 gymnasium environments of scenes/first_look.yaml at once
    gpu            many scenarios and large meshes; the ceiling is what memory bandwidth allows

Ratios hold where nothing else runs; threads need a free core each.
"""
