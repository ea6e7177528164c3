"""Execution of studies: cases on the processors of one machine or many, table and optimum.

To be read in this order:

    job           a case to run in a folder, its execution by a worker, and its outcome; table,
                  files and progress of a running study
    engine        the workers, which receive jobs and return outcomes
    optimisation  choice of the next trials by an estimator, with early stopping, or by derivatives
                  of the measures
    study         all cases of a study, trials until the best is found, `softsim.Study`
"""
