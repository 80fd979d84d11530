"""Studies: what accuracy costs, what generation would win, what an absent effect costs; tables and pictures from one run."""
