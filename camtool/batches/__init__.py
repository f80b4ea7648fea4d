"""Many drawings at once: find them, skip those that are up to date, and make the others in worker
processes.

    inputs.find_tasks     folders, patterns, files → a Task for each drawing, no two to one output
    lock.lock_folder      one batch at a time in an output folder
    manifest.Manifest     the files of an output folder, and what they were made from
    pool.LocalPool        processes of this computer; when one dies, the others continue
    cluster.ClusterPool   the same on a Dask cluster
    run.run_batch         tasks → outcomes: makes and writes the drawings that are not up to date

The caller supplies a `BatchWork`, which makes the outputs of one drawing; this package knows no
machine. Packages are loaded when they are needed: a batch that is up to date starts no processes.
"""
