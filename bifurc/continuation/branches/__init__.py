"""Branches as results: rows, special points, how they ended, and checks that do not trust the way they were made.

`branch` and `special` are what users hold; `audit` checks the rows, `stability_changes` finds where stability changes where
multipliers are not needed in every step, `records` are the files.  Start reading at `branch`.
"""
