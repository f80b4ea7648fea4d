"""The operations: a folder or file for each kind, found by its entry point.

Each gives one record, the `OperationKind` (see `camtool.planning.kinds`), and the functions that
the record names. Nothing of camtool imports from here; docs/write-an-operation.md adds one."""
