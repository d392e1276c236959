"""Weather in, results out: records of towers and reanalyses as forcing, and output as the field's own datasets."""
