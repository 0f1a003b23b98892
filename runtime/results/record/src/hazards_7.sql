-- The hazards that a monitor was to foresee: the first violations of requirements in a test. The view hazards has names.
CREATE TABLE monitor_hazards (
    test            INTEGER NOT NULL REFERENCES tests,
    monitor         INTEGER NOT NULL REFERENCES monitors,
    requirement     INTEGER NOT NULL REFERENCES requirements,
    time_s          REAL NOT NULL,
    lead_s          REAL,           -- for how long the monitor had been in its safe state; NULL if it was not: missed
    PRIMARY KEY (test, monitor, requirement)
) STRICT, WITHOUT ROWID;

-- Hazards with names: whether a monitor had foreseen the violation of a requirement.
CREATE VIEW hazards AS
    SELECT t.number AS test, t.name AS test_name, m.name AS monitor, r.name AS requirement, h.time_s AS time_s,
           h.lead_s IS NOT NULL AS foreseen, h.lead_s AS lead_s
      FROM tests t JOIN monitor_hazards h ON h.test = coalesce(t.duplicate_of, t.number)
      JOIN monitors m ON m.id = h.monitor JOIN requirements r ON r.id = h.requirement;
