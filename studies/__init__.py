"""Studies: what accuracy, tables and absent effects cost in time; a table and a picture from one run."""
