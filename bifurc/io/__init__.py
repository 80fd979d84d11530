"""Results on disk: one npz file of plain arrays with a JSON header, renamed into place, never pickled.

`records` writes and reads them, and checks what they hold; `archive` unpacks no more of a file than its header lists.
"""
from .records import (
    FORMAT,
    VERSION,
    FileFormatError,
    Part,
    begun,
    fitted,
    header,
    made,
    other_than_file,
    part,
    read,
    replaceable,
    write,
)

__all__ = ["FORMAT", "VERSION", "FileFormatError", "Part", "begun", "fitted", "header", "made", "other_than_file", "part", "read",
           "replaceable", "write"]
