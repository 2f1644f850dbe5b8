"""Error against run time: what each float format, and each policy of updates, gives and costs."""
