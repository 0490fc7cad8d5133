"""Many runs of one scene with keys varied: plan, folders of the runs, processes, table."""
