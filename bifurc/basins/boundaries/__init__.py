"""What separates basins: `edges` finds the edge state (saddle) between two of them.

`unstable` and `stable` grow its unstable and stable sets; `time_reversal` is the system seen backwards, which the stable
set needs.  Start reading at `edges`.
"""
