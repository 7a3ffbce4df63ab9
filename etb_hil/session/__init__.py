"""What a run recorded and what is concluded from it: the folder, its events, the judging, the store, comparisons."""
