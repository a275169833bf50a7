"""Property tests are repeatable: the same examples on every machine, none stored."""
from hypothesis import settings

settings.register_profile('repeatable', derandomize=True, deadline=None, database=None,
                          max_examples=50)
settings.load_profile('repeatable')
