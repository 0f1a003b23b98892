-- The runtime monitors of the space. Tables of monitors are only there if the campaign has any.
CREATE TABLE monitors (
    id              INTEGER PRIMARY KEY,
    name            TEXT NOT NULL,
    topic           TEXT            -- where it publishes its state, as the space calls the topic; NULL of an external monitor
) STRICT;

-- What monitors can guarantee, the strongest first, and their safe states.
CREATE TABLE monitor_states (
    monitor         INTEGER NOT NULL REFERENCES monitors,
    position        INTEGER NOT NULL, -- the safe state is the last one
    name            TEXT NOT NULL,
    integrity       INTEGER NOT NULL, -- 0 of the safe state
    PRIMARY KEY (monitor, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE monitor_evidence (
    monitor         INTEGER NOT NULL REFERENCES monitors,
    position        INTEGER NOT NULL,
    name            TEXT NOT NULL,
    PRIMARY KEY (monitor, position)
) STRICT, WITHOUT ROWID;

-- The decisions of monitors in a test: a state holds until the next decision. They explain scores and follow from the run,
-- so they are not part of the digest. The view decisions has names. A duplicate's are those of its original.
CREATE TABLE monitor_decisions (
    test            INTEGER NOT NULL REFERENCES tests,
    monitor         INTEGER NOT NULL REFERENCES monitors,
    position        INTEGER NOT NULL, -- in the order of time, from 0, which is the decision at time zero
    time_s          REAL NOT NULL,
    state           INTEGER NOT NULL, -- position of the state
    PRIMARY KEY (test, monitor, position)
) STRICT, WITHOUT ROWID;

-- Changes of evidence in a test, likewise. Evidence is unknown before its first change. The view evidence has names.
CREATE TABLE evidence_changes (
    test            INTEGER NOT NULL REFERENCES tests,
    monitor         INTEGER NOT NULL REFERENCES monitors,
    position        INTEGER NOT NULL, -- among those of the monitor, in the order of time, from 0
    time_s          REAL NOT NULL,
    evidence        INTEGER NOT NULL, -- position of the evidence
    holds           INTEGER,        -- 1: true, 0: false; NULL: unknown
    cause           TEXT NOT NULL CHECK (cause IN ('message', 'held', 'stale')), -- held: the condition had held for long
                                    -- enough; stale: its topics had been silent for too long
    path            TEXT,           -- of a message, the name of its topic on the wire
    message         INTEGER,        -- and its number among those published there, from 0
    PRIMARY KEY (test, monitor, position)
) STRICT, WITHOUT ROWID;

-- How many later decisions and changes of evidence of a test are left out, because there were too many.
CREATE TABLE monitor_omissions (
    test            INTEGER NOT NULL REFERENCES tests,
    monitor         INTEGER NOT NULL REFERENCES monitors,
    omitted         INTEGER NOT NULL,
    PRIMARY KEY (test, monitor)
) STRICT, WITHOUT ROWID;

-- The decisions of monitors with names: when a monitor came to a state.
CREATE VIEW decisions AS
    SELECT t.number AS test, t.name AS test_name, m.name AS monitor, d.position AS position, d.time_s AS time_s,
           s.name AS state, s.integrity AS integrity
      FROM tests t JOIN monitor_decisions d ON d.test = coalesce(t.duplicate_of, t.number)
      JOIN monitors m ON m.id = d.monitor JOIN monitor_states s ON s.monitor = d.monitor AND s.position = d.state;

-- Changes of evidence with names, and what caused them.
CREATE VIEW evidence AS
    SELECT t.number AS test, t.name AS test_name, m.name AS monitor, c.position AS position, c.time_s AS time_s,
           e.name AS evidence, c.holds AS holds, c.cause AS cause, c.path AS path, c.message AS message
      FROM tests t JOIN evidence_changes c ON c.test = coalesce(t.duplicate_of, t.number)
      JOIN monitors m ON m.id = c.monitor JOIN monitor_evidence e ON e.monitor = c.monitor AND e.position = c.evidence;
