-- The tables and views of schema 6, by which results of that release are recognised. Schema 7 changed words:
-- `void` to `no_effect`, `kept` to `satisfied`, `unsaid` to `inconclusive`, `said` to `conclusive`, `draw_seed` to
-- `operation_seed`.

CREATE TABLE campaign (
    id              INTEGER PRIMARY KEY CHECK (id = 1),
    space           TEXT NOT NULL,
    name            TEXT NOT NULL,
    source          TEXT NOT NULL,
    generator       TEXT NOT NULL,
    runtime         TEXT NOT NULL,
    seed            TEXT NOT NULL,
    evaluations     INTEGER NOT NULL,
    end_after_s     REAL NOT NULL,
    plan            TEXT NOT NULL,
    stop            TEXT
) STRICT;

CREATE TABLE metrics (
    id              INTEGER PRIMARY KEY,
    name            TEXT NOT NULL,
    unit            TEXT,
    direction       TEXT CHECK (direction IN ('maximise', 'minimise')),
    objective       INTEGER,
    default_value   REAL
) STRICT;

CREATE TABLE requirements (
    id              INTEGER PRIMARY KEY,
    name            TEXT NOT NULL,
    text            TEXT NOT NULL,
    metric          INTEGER NOT NULL REFERENCES metrics,
    low             REAL,
    low_excluded    INTEGER NOT NULL,
    high            REAL,
    high_excluded   INTEGER NOT NULL
) STRICT;

CREATE TABLE tests (
    number          INTEGER PRIMARY KEY,
    name            TEXT NOT NULL UNIQUE,
    origin          TEXT NOT NULL CHECK (origin IN ('reference', 'known', 'search')),
    known_test      TEXT,
    generation      INTEGER,
    simulator_seed  TEXT NOT NULL,
    outcome         TEXT NOT NULL CHECK (outcome IN ('completed', 'void', 'unknown', 'crash', 'timeout')),
    outcome_detail  TEXT,
    time_limit_s    REAL,
    end_s           REAL NOT NULL,
    messages        INTEGER NOT NULL,
    duplicate_of    INTEGER REFERENCES tests
) STRICT;

CREATE TABLE original_names (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    name            TEXT NOT NULL
) STRICT;

CREATE TABLE parents (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    parent          INTEGER NOT NULL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE operations (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    operation       TEXT NOT NULL,
    start_s         REAL,
    end_s           REAL,
    start_condition TEXT,
    end_condition   TEXT,
    length_s        REAL,
    times           INTEGER,
    draw_seed       TEXT NOT NULL,
    seen            INTEGER,
    changed         INTEGER,
    dropped         INTEGER,
    delayed         INTEGER,
    queued          INTEGER,
    injected        INTEGER,
    side_effects    INTEGER,
    unheard         INTEGER,
    first_touch_s   REAL,
    last_touch_s    REAL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE choices (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL,
    position        INTEGER NOT NULL,
    parameter       TEXT NOT NULL,
    unit            TEXT,
    value           REAL,
    low             REAL,
    high            REAL,
    x               REAL,
    y               REAL,
    z               REAL,
    text            TEXT,
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE intervals (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL,
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE tails (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL,
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE unheard (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    path            TEXT NOT NULL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE metric_values (
    test            INTEGER NOT NULL REFERENCES tests,
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL,
    is_set          INTEGER NOT NULL,
    reach_low       REAL,
    reach_high      REAL,
    not_finite_s    REAL,
    PRIMARY KEY (test, metric)
) STRICT, WITHOUT ROWID;

CREATE TABLE series_pieces (
    test            INTEGER NOT NULL REFERENCES tests,
    metric          INTEGER NOT NULL REFERENCES metrics,
    position        INTEGER NOT NULL,
    points          INTEGER NOT NULL,
    start_ns        INTEGER,
    tick_ns         INTEGER,
    times           BLOB NOT NULL,
    numbers         BLOB NOT NULL,
    PRIMARY KEY (test, metric, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE repetitions (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    simulator_seed  TEXT NOT NULL,
    outcome         TEXT NOT NULL CHECK (outcome IN ('completed', 'void', 'crash', 'timeout')),
    outcome_detail  TEXT,
    time_limit_s    REAL,
    end_s           REAL NOT NULL,
    messages        INTEGER NOT NULL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE repetition_values (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL,
    is_set          INTEGER NOT NULL,
    reach_low       REAL,
    reach_high      REAL,
    not_finite_s    REAL,
    PRIMARY KEY (test, position, metric)
) STRICT, WITHOUT ROWID;

CREATE TABLE result_sets (
    name            TEXT PRIMARY KEY,
    generation      INTEGER,
    status          TEXT NOT NULL CHECK (status IN ('intermediate', 'final'))
) STRICT;

CREATE TABLE result_set_members (
    result_set      TEXT NOT NULL REFERENCES result_sets,
    position        INTEGER NOT NULL,
    test            INTEGER NOT NULL,
    PRIMARY KEY (result_set, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE coverage (
    generation      INTEGER PRIMARY KEY,
    evaluations     INTEGER NOT NULL,
    covered         INTEGER NOT NULL,
    cells           INTEGER NOT NULL,
    feasible        INTEGER NOT NULL
) STRICT;

CREATE TABLE indicators (
    generation      INTEGER PRIMARY KEY,
    evaluations     INTEGER NOT NULL,
    unique_tests    INTEGER NOT NULL,
    void            INTEGER NOT NULL,
    crashes         INTEGER NOT NULL,
    timeouts        INTEGER NOT NULL,
    front           INTEGER NOT NULL,
    hypervolume     REAL,
    estimated       INTEGER NOT NULL CHECK (estimated IN (0, 1)),
    standard_error  REAL
) STRICT;

CREATE TABLE reference_point (
    objective       INTEGER PRIMARY KEY,
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL NOT NULL
) STRICT;

CREATE TABLE events (
    id              INTEGER PRIMARY KEY,
    kind            TEXT NOT NULL CHECK (kind IN ('warning', 'session')),
    test            INTEGER,
    position        INTEGER NOT NULL,
    text            TEXT NOT NULL
) STRICT;

CREATE INDEX events_by_test ON events (test, position);

CREATE TABLE sessions (
    id              INTEGER PRIMARY KEY,
    started_at      REAL NOT NULL,
    ended_at        REAL,
    host            TEXT,
    pid             INTEGER NOT NULL,
    workers         INTEGER NOT NULL
) STRICT;

CREATE TABLE wall_times (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    run_s           REAL NOT NULL
) STRICT;

CREATE VIEW first_verdicts AS
    SELECT t.number AS test, t.name AS test_name, r.name AS requirement, r.text AS requirement_text, v.value AS value,
           CASE
               WHEN v.reach_high < r.low OR v.reach_low > r.high OR (r.low_excluded AND v.reach_high = r.low)
                    OR (r.high_excluded AND v.reach_low = r.high) THEN 'violated'
               WHEN v.value IS NULL OR v.not_finite_s IS NOT NULL OR t.outcome NOT IN ('completed', 'void', 'unknown')
                    THEN 'unsaid'
               WHEN v.value < r.low OR v.value > r.high OR (r.low_excluded AND v.value = r.low)
                    OR (r.high_excluded AND v.value = r.high) THEN 'unsaid'
               ELSE 'kept'
           END AS verdict
      FROM tests t CROSS JOIN requirements r LEFT JOIN metric_values v ON v.test = t.number AND v.metric = r.metric;

CREATE VIEW repetition_verdicts AS
    SELECT n.test AS test, n.position AS position, r.name AS requirement, v.value AS value,
           CASE
               WHEN v.reach_high < r.low OR v.reach_low > r.high OR (r.low_excluded AND v.reach_high = r.low)
                    OR (r.high_excluded AND v.reach_low = r.high) THEN 'violated'
               WHEN v.value IS NULL OR v.not_finite_s IS NOT NULL OR n.outcome NOT IN ('completed', 'void')
                    THEN 'unsaid'
               WHEN v.value < r.low OR v.value > r.high OR (r.low_excluded AND v.value = r.low)
                    OR (r.high_excluded AND v.value = r.high) THEN 'unsaid'
               ELSE 'kept'
           END AS verdict
      FROM repetitions n CROSS JOIN requirements r
           LEFT JOIN repetition_values v ON v.test = n.test AND v.position = n.position AND v.metric = r.metric;

CREATE VIEW verdicts AS
    SELECT f.test AS test, f.test_name AS test_name, f.requirement AS requirement, f.requirement_text AS requirement_text,
           f.value AS value,
           CASE
               WHEN EXISTS (SELECT 1 FROM repetition_verdicts n WHERE n.test = coalesce(t.duplicate_of, t.number)
                               AND n.requirement = f.requirement AND n.verdict = 'violated') THEN 'violated'
               WHEN EXISTS (SELECT 1 FROM repetition_verdicts n WHERE n.test = coalesce(t.duplicate_of, t.number)
                               AND n.requirement = f.requirement AND n.verdict = 'kept') THEN 'kept'
               WHEN f.verdict = 'kept'
                    AND EXISTS (SELECT 1 FROM repetitions n WHERE n.test = coalesce(t.duplicate_of, t.number)) THEN 'unsaid'
               ELSE f.verdict
           END AS verdict
      FROM first_verdicts f JOIN tests t ON t.number = f.test JOIN requirements r ON r.name = f.requirement
     ORDER BY t.number, r.id;

CREATE VIEW findings AS
    SELECT v.test, v.test_name, 'violation' AS finding, v.requirement, v.value, v.requirement_text AS detail
      FROM verdicts v JOIN tests t ON t.number = v.test
     WHERE v.verdict = 'violated' AND t.duplicate_of IS NULL
    UNION ALL
    SELECT t.number, t.name, t.outcome, NULL, NULL, t.outcome_detail
      FROM tests t
     WHERE t.outcome IN ('crash', 'timeout') AND t.duplicate_of IS NULL
       AND (NOT EXISTS (SELECT 1 FROM repetitions n WHERE n.test = t.number)
            OR EXISTS (SELECT 1 FROM repetitions n WHERE n.test = t.number AND n.outcome = t.outcome))
    UNION ALL
    SELECT t.number, t.name, n.outcome, NULL, NULL, n.outcome_detail
      FROM repetitions n JOIN tests t ON t.number = n.test
     WHERE n.outcome IN ('crash', 'timeout') AND n.outcome <> t.outcome AND t.duplicate_of IS NULL
       AND n.position = (SELECT min(m.position) FROM repetitions m WHERE m.test = n.test AND m.outcome = n.outcome)
    UNION ALL
    SELECT t.number, t.name, 'not_finite', NULL, v.not_finite_s, 'read by ' || m.name
      FROM metric_values v JOIN tests t ON t.number = v.test JOIN metrics m ON m.id = v.metric
     WHERE v.not_finite_s IS NOT NULL AND t.duplicate_of IS NULL
     ORDER BY 1, 3, 4;

CREATE VIEW confirmations AS
    SELECT f.test AS test, f.test_name AS test_name, f.requirement AS requirement, f.verdict AS first,
           count(*) FILTER (WHERE n.verdict = 'violated') AS confirmed,
           count(*) FILTER (WHERE n.verdict <> 'unsaid') AS said, count(*) AS repetitions
      FROM repetition_verdicts n JOIN first_verdicts f ON f.test = n.test AND f.requirement = n.requirement
           JOIN requirements r ON r.name = f.requirement
     GROUP BY f.test, r.id
    HAVING f.verdict = 'violated' OR count(*) FILTER (WHERE n.verdict = 'violated') > 0
     ORDER BY f.test, r.id;
