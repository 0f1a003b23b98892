-- The hazards that a monitor was to foresee: when requirements were lost in a test. The view hazards has names.
CREATE TABLE monitor_hazards (
    test            INTEGER NOT NULL REFERENCES tests,
    monitor         INTEGER NOT NULL REFERENCES monitors,
    requirement     INTEGER NOT NULL REFERENCES requirements,
    time_s          REAL NOT NULL,
    lead_s          REAL,           -- for how long the monitor had been in its safe state, 0: detected; NULL if it was not: missed
    PRIMARY KEY (test, monitor, requirement)
) STRICT, WITHOUT ROWID;

-- Those of the repetitions of a test, which count in place of those of its first run.
CREATE TABLE repetition_hazards (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- of the repetition
    monitor         INTEGER NOT NULL REFERENCES monitors,
    requirement     INTEGER NOT NULL REFERENCES requirements,
    time_s          REAL NOT NULL,
    lead_s          REAL,           -- as in monitor_hazards
    PRIMARY KEY (test, position, monitor, requirement)
) STRICT, WITHOUT ROWID;

-- Hazards with names: whether a monitor had foreseen the violation of a requirement. A test that was run again has
-- those of its repetitions; any other has those of its only run, where repetition is NULL.
CREATE VIEW hazards AS
    SELECT t.number AS test, t.name AS test_name, h.position AS repetition, m.name AS monitor, r.name AS requirement,
           h.time_s AS time_s, coalesce(h.lead_s > 0, 0) AS foreseen, coalesce(h.lead_s = 0, 0) AS detected,
           h.lead_s AS lead_s
      FROM tests t
      JOIN (SELECT test, NULL AS position, monitor, requirement, time_s, lead_s FROM monitor_hazards f
             WHERE NOT EXISTS (SELECT 1 FROM repetitions n WHERE n.test = f.test)
            UNION ALL
            SELECT test, position, monitor, requirement, time_s, lead_s FROM repetition_hazards) h
        ON h.test = coalesce(t.duplicate_of, t.number)
      JOIN monitors m ON m.id = h.monitor JOIN requirements r ON r.id = h.requirement;
