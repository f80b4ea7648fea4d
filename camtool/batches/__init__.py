"""Many drawings: which ones, what is up to date, and processes that make the rest.

    inputs.find_tasks     folders, patterns, files → a Task for each drawing, no two to one output
    lock.alone_in         one batch at a time in an output folder
    manifest.Manifest     what an output folder holds, and of what it was made
    pool.LocalPool        processes of this computer; when one dies, the others go on
    cluster.ClusterPool   the same on a Dask cluster
    run.run_batch         tasks → outcomes: makes and writes the drawings that are not up to date

The caller brings a `Work`, which makes the outputs of one drawing; nothing here knows of machines.
Nothing is loaded before it is needed: a batch that is up to date starts no processes.
"""
