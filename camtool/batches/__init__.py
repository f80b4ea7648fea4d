"""Many drawings: which ones, what is up to date, and processes that make the rest.

    inputs.find_tasks     folders, patterns, files → a Task for each drawing, no two to one output
    lock.alone_in         one batch at a time in an output folder
    manifest.Manifest     what an output folder holds, and of what it was made
    pool.LocalPool        processes of this computer: one may die, and the others go on
    cluster.ClusterPool   the same on a Dask cluster
    run.run_batch         tasks → outcomes: writes what is made, skips what is up to date

What is made of one drawing is a `Work` that the caller brings; nothing here knows of machines.
Nothing is loaded before it is needed: a batch that is up to date needs no processes.
"""
