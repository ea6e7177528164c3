"""Execution of studies: cases on the processors of one machine or many, table and optimum.

To be read in this order:

    job       a case to run in a folder, its execution by a worker, and its outcome; table, files
              and progress of a running study
    engine    the workers, which receive jobs and return outcomes
    trials    choice of the next trials of an optimisation by an estimator, and their early stopping
    descent   the same by derivatives of the measures; it starts without what `trials` imports
    study     all cases of a study, trials until the best is found, `softsim.Study`
"""
