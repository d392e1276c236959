"""The paper's tables, one a module: COLUMNS (name -> heading) and `make(results)`, ours beside the paper's."""
