"""Long work, whatever it computes: executors, finished parts on disk, progress.

`executors` runs chunks in this thread, threads, processes or a cluster with the same bits from each; `store` keeps
finished chunks, the only record from which an interrupted run goes on; `progress` shows how far it is.
Start reading at `executors.run_chunks`.
"""
