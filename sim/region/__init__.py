"""Many sites at once: the table of a region's sites, their simulation on all cores or a cluster, and its store."""
