"""What `gecar discover` is compared with, on the same cases: simpler searches, and its own chain with parts removed.

Unlike the truth world beside it, this folder uses `gecar`: recordings, replays and fits are the same for all.
"""
