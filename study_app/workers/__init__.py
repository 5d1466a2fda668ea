"""Work in other processes: a worker process for a window, and executors for many independent cases."""
