"""Forward selection of causes: screened by the score test, fitted in a race, added one by one."""

from twin.diagnose.selection.score_test import Score, score_causes
from twin.diagnose.selection.search import Report, Search, search_causes
