"""A second bench, which shares no code with the tool: recordings of another physics, for the tool to be judged by.

It knows `recordings` for the form of the files, and nothing of `twin`.
"""
