"""Studies run: cases on the processors of one machine or many, their table, their optimum.

To be read in this order:

    job            a case to run in a folder, and its outcome, as the folder keeps it
    work           what a worker does with jobs
    worker_pool    the workers
    engine         jobs go to workers, outcomes come back
    ledger         table, files and progress of a study that runs
    sweep          all cases of a study
    trials         what an optimisation tries next, and when it gives up a trial
    optimisation   trials until the best is found
    study          `softsim.Study`
"""
