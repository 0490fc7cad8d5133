"""The link file as records: what stage 1 reads, checked key by key."""
