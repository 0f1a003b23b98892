-- What nodes published on each wire that spoke in a test, before any operation touched it. A duplicate's traffic is that of
-- its original. It explains what came of the test and is not part of the digest.
CREATE TABLE traffic (
    test            INTEGER NOT NULL REFERENCES tests,
    wire            INTEGER NOT NULL, -- position of the path among those of all topics
    topic           TEXT NOT NULL,
    path            TEXT NOT NULL,
    messages        INTEGER NOT NULL,
    first_s         REAL NOT NULL,  -- time of the first message
    last_s          REAL NOT NULL,  -- time of the last one
    gap_start_s     REAL NOT NULL,  -- the longest time without a message between them
    gap_end_s       REAL NOT NULL,
    median_gap_s    REAL NOT NULL,  -- the median of the times between successive instants with messages
    PRIMARY KEY (test, wire)
) STRICT, WITHOUT ROWID;

-- Operations of the campaign whose topic had no message inside of their `within` in a reference run.
CREATE TABLE unreached (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the plan
    name            TEXT NOT NULL,
    nearest_s       REAL,           -- time of the message that is nearest to its `within`; NULL: there was none
    PRIMARY KEY (test, operation)
) STRICT, WITHOUT ROWID;
