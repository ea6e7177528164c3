"""Studies run: cases on the processors of one machine or many, their table, their optimum.

To be read in this order:

    job       a case to run in a folder, what a worker does with it, and its outcome
    engine    the workers: jobs go to them, outcomes come back
    ledger    table, files and progress of a study that runs
    checks    which cases cannot run, found before anything runs
    cost      what its cases cost, told before they run
    trials    what an optimisation tries next, and when it gives up a trial
    study     all cases of a study, trials until the best is found, `softsim.Study`
"""
