-- Results of one SESAME campaign run.
--
-- Times are seconds of simulation time since the start of a run (columns ending in _s), unless the table says wall time.
-- Values of metrics and parameters are in the unit that stands beside their name. Numbers that need 64 unsigned bits
-- (seeds) are decimal text, since SQLite's integers are signed.
-- The views answer common questions: results, front, findings, confirmations, verdicts, series.
-- If a test was run again, its verdicts and findings are those of its fresh runs.

-- The campaign: one row.
CREATE TABLE campaign (
    id              INTEGER PRIMARY KEY CHECK (id = 1),
    space           TEXT NOT NULL,
    name            TEXT NOT NULL,
    source          TEXT NOT NULL,  -- file name of the .sesame file
    generator       TEXT NOT NULL,  -- program and version that generated the runner
    runtime         TEXT NOT NULL,  -- version of the runtime that ran it
    seed            TEXT NOT NULL,  -- the one seed that decided everything
    evaluations     INTEGER NOT NULL, -- tests the search was to evaluate
    end_after_s     REAL NOT NULL,  -- simulation time at which a test ends
    plan            TEXT NOT NULL,  -- everything the runner knew about the campaign, JSON
    stop            TEXT,           -- why the run ended; NULL while it is unfinished
    task            TEXT            -- what the run does instead of the campaign (known, repeat, shrink), JSON; NULL for the campaign
) STRICT;

CREATE TABLE metrics (
    id              INTEGER PRIMARY KEY,
    name            TEXT NOT NULL,
    unit            TEXT,           -- NULL for a plain number
    direction       TEXT CHECK (direction IN ('maximise', 'minimise')), -- which way is of interest to a tester
    objective       INTEGER,        -- position among the campaign's objectives, from 0; NULL for none
    default_value   REAL            -- value of a run in which it was never set
) STRICT;

-- A requirement is violated by a value below low or above high (or equal to it, where that end is excluded).
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
    name            TEXT NOT NULL UNIQUE, -- T and the number
    origin          TEXT NOT NULL CHECK (origin IN ('reference', 'known', 'search')), -- reference: the reference run;
                                    -- known: a regression test
    known_test      TEXT,           -- name of the regression test in the .sesame file
    generation      INTEGER,
    simulator_seed  TEXT NOT NULL,
    outcome         TEXT NOT NULL CHECK (outcome IN ('completed', 'no_effect', 'unknown', 'crash', 'timeout',
                                    'launch_failed', 'disconnect', 'wrong_clock')),
                                    -- no_effect: no operation had an effect;
                                    -- unknown: imported from a program that did not count effects;
                                    -- launch_failed, disconnect, wrong_clock: the environment's fault, no findings
    outcome_detail  TEXT,           -- what is known of the cause
    time_limit_s    REAL,           -- of a timeout, in seconds of wall time
    end_s           REAL NOT NULL,  -- when the run ended
    messages        INTEGER NOT NULL, -- handled by the relay
    duplicate_of    INTEGER REFERENCES tests -- the equal test whose result stands for this one, which was not simulated
) STRICT;

-- The names of tests in the file they were imported from; empty for a campaign that was run.
CREATE TABLE original_names (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    name            TEXT NOT NULL
) STRICT;

CREATE TABLE parents (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    parent          INTEGER NOT NULL, -- number of the parent test
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

-- The operations of a test: what was planned, and what it did. Counts are NULL where the run could not report them.
CREATE TABLE operations (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- in the test, from 0
    operation       TEXT NOT NULL,
    start_s         REAL,           -- planned; NULL where a condition starts it, and for an operation before the start or after the end
    end_s           REAL,           -- planned, excluded; NULL likewise
    start_condition TEXT,           -- what starts it, in the words of the language; NULL where time does
    end_condition   TEXT,           -- what ends it, likewise; NULL where it has a length
    length_s        REAL,           -- how long each activation by condition is; NULL where a condition ends it
    times           INTEGER,        -- how often at most it is activated by condition; NULL where time starts it
    operation_seed  TEXT NOT NULL,  -- of its random draws, in this test
    seen            INTEGER,        -- messages that reached it while it was active
    changed         INTEGER,
    dropped         INTEGER,
    delayed         INTEGER,        -- held back while it was active
    queued          INTEGER,        -- came while it was not active, and waited behind those it still held
    injected        INTEGER,
    side_effects    INTEGER,
    unheard         INTEGER,        -- changed, dropped, held back or injected where no node subscribes: not an effect, and in no other count
    first_touch_s   REAL,           -- time of its first effect
    last_touch_s    REAL,           -- time of its last effect
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

-- What a test chose for the parameters of an operation: value, or low and high of a sub-range.
CREATE TABLE choices (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL,
    parameter       TEXT NOT NULL,
    unit            TEXT,           -- NULL for probabilities and plain numbers
    value           REAL,
    low             REAL,
    high            REAL,
    x               REAL,           -- a point has x, y and z
    y               REAL,
    z               REAL,
    text            TEXT,           -- a text, or the path of a file
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;

-- When an operation was seen to be active, clipped to the run.
CREATE TABLE intervals (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,  -- excluded
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;

-- When an operation was not active and still held messages back, clipped to the run. With its intervals this is what
-- fuzzing_time() adds up.
CREATE TABLE tails (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,  -- excluded
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;

-- Names on the wire that operations of the campaign act on and that had no receiver in a run: the simulator did not
-- subscribe to them, and no outbound metric reads them.
CREATE TABLE unheard (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- in the order of declaration
    path            TEXT NOT NULL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE metric_values (
    test            INTEGER NOT NULL REFERENCES tests,
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL,           -- NULL: neither set nor defaulted
    is_set          INTEGER NOT NULL, -- 0: the value is the default
    reach_low       REAL,           -- the least value that it could have had at the planned end, if the run broke off or a topic
                                    -- fell silent; otherwise the value itself. NULL: there is no least
    reach_high      REAL,           -- the greatest; NULL: there is no greatest
    not_finite_s    REAL,           -- when it first read a number that was not finite; NULL: never
    PRIMARY KEY (test, metric)
) STRICT, WITHOUT ROWID;

-- Time series, in pieces of up to 64 points: a value holds from a point until the next one. The views series and
-- change_points have a row per point. A duplicate's series are those of its original.
CREATE TABLE series_pieces (
    test            INTEGER NOT NULL REFERENCES tests,
    metric          INTEGER NOT NULL REFERENCES metrics,
    position        INTEGER NOT NULL, -- of the piece's first point in the series, from 0
    points          INTEGER NOT NULL, -- how many
    start_ns        INTEGER,        -- time of the first one, in nanoseconds; NULL where times are doubles
    tick_ns         INTEGER,        -- the length of a tick, in nanoseconds; NULL likewise
    times           BLOB NOT NULL,  -- per point its ticks since the first one, as whole numbers of equal width, big-endian;
                                    -- empty where they are 0, 1, 2, and so on. NULL ticks: its time in seconds, as a double, likewise
    numbers         BLOB NOT NULL,  -- per point its value, as a double of 8 bytes, big-endian
    PRIMARY KEY (test, metric, position)
) STRICT, WITHOUT ROWID;

-- Runs of tests again, each with a fresh seed of the simulator and everything else equal, to confirm findings. They do not
-- count as tests: no search asked for them.
CREATE TABLE repetitions (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- among the repetitions of its test, from 1
    simulator_seed  TEXT NOT NULL,
    outcome         TEXT NOT NULL CHECK (outcome IN ('completed', 'no_effect', 'crash', 'timeout',
                                    'launch_failed', 'disconnect', 'wrong_clock')),
    outcome_detail  TEXT,           -- what is known of the cause
    time_limit_s    REAL,           -- of a timeout, in seconds of wall time
    end_s           REAL NOT NULL,  -- when the run ended
    messages        INTEGER NOT NULL, -- handled by the relay
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE repetition_values (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- of the repetition
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL,           -- NULL: neither set nor defaulted
    is_set          INTEGER NOT NULL, -- 0: the value is the default
    reach_low       REAL,           -- the least value that it could have had at the planned end, if the run broke off or a topic
                                    -- fell silent; otherwise the value itself. NULL: there is no least
    reach_high      REAL,           -- the greatest; NULL: there is no greatest
    not_finite_s    REAL,           -- when it first read a number that was not finite; NULL: never
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
    test            INTEGER NOT NULL, -- number of the test
    PRIMARY KEY (result_set, position)
) STRICT, WITHOUT ROWID;

-- How much of the space was covered after each generation, for a campaign that counts coverage.
CREATE TABLE coverage (
    generation      INTEGER PRIMARY KEY,
    evaluations     INTEGER NOT NULL, -- tests evaluated by then
    covered         INTEGER NOT NULL, -- cells that enough tests have hit
    cells           INTEGER NOT NULL,
    feasible        INTEGER NOT NULL  -- cells that a test can reach, as far as is known, or has hit
) STRICT;

-- The quality of the front after each generation, and how the tests ended by then.
CREATE TABLE indicators (
    generation      INTEGER PRIMARY KEY,
    evaluations     INTEGER NOT NULL, -- tests evaluated by then
    unique_tests    INTEGER NOT NULL, -- of these, not exact duplicates of an earlier one
    no_effect       INTEGER NOT NULL, -- of these, in which no operation had an effect
    crashes         INTEGER NOT NULL,
    timeouts        INTEGER NOT NULL,
    front           INTEGER NOT NULL, -- tests on the front
    hypervolume     REAL,           -- of the front up to the reference point; NULL without objectives, before anything was
                                    -- measured, and where the front is unbounded
    estimated       INTEGER NOT NULL CHECK (estimated IN (0, 1)), -- 1: an exact hypervolume would have taken too long
    standard_error  REAL            -- of an estimated hypervolume
) STRICT;

-- The point that hypervolumes are measured from: for each objective the worst value of the reference run and of the tests
-- up to the first generation with a measured one, plus half of the range of these values. It never moves.
CREATE TABLE reference_point (
    objective       INTEGER PRIMARY KEY, -- position among the campaign's objectives, from 0
    metric          INTEGER NOT NULL REFERENCES metrics,
    value           REAL NOT NULL   -- in the metric's unit
) STRICT;

-- Events that a user should know about. A warning belongs to the content; a session note (interrupted, resumed, a worker
-- restarted) belongs to the session.
CREATE TABLE events (
    id              INTEGER PRIMARY KEY,
    kind            TEXT NOT NULL CHECK (kind IN ('warning', 'session')),
    test            INTEGER,        -- NULL: of the campaign
    position        INTEGER NOT NULL, -- among the events of its test
    text            TEXT NOT NULL
) STRICT;

CREATE INDEX events_by_test ON events (test, position);

-- Wall time, processes and hosts: nothing below is part of the digest.
CREATE TABLE sessions (
    id              INTEGER PRIMARY KEY,
    started_at      REAL NOT NULL,  -- wall time, seconds since 1970 UTC
    ended_at        REAL,           -- the same; NULL: still running, or killed
    host            TEXT,
    pid             INTEGER NOT NULL,
    workers         INTEGER NOT NULL
) STRICT;

CREATE TABLE wall_times (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    run_s           REAL NOT NULL   -- wall time of the run as its worker saw it
) STRICT;

-- Per test and requirement the verdict of its first run, the one that selected it: violated if no value that the metric could
-- have had at the planned end is inside the bound; satisfied if the run ended as planned, everything that the metric read was
-- finite, and all of these values are inside the bound; otherwise inconclusive.
CREATE VIEW first_verdicts AS
    SELECT t.number AS test, t.name AS test_name, r.name AS requirement, r.text AS requirement_text, v.value AS value,
           CASE
               WHEN v.reach_high < r.low OR v.reach_low > r.high OR (r.low_excluded AND v.reach_high = r.low)
                    OR (r.high_excluded AND v.reach_low = r.high) THEN 'violated'
               WHEN v.value IS NULL OR v.not_finite_s IS NOT NULL OR t.outcome NOT IN ('completed', 'no_effect', 'unknown')
                    THEN 'inconclusive'
               WHEN (r.low IS NULL OR v.reach_low > r.low OR (v.reach_low = r.low AND NOT r.low_excluded))
                    AND (r.high IS NULL OR v.reach_high < r.high OR (v.reach_high = r.high AND NOT r.high_excluded))
                    THEN 'satisfied'
               ELSE 'inconclusive'
           END AS verdict
      FROM tests t CROSS JOIN requirements r LEFT JOIN metric_values v ON v.test = t.number AND v.metric = r.metric;

-- The same per repetition and requirement.
CREATE VIEW repetition_verdicts AS
    SELECT n.test AS test, n.position AS position, r.name AS requirement, v.value AS value,
           CASE
               WHEN v.reach_high < r.low OR v.reach_low > r.high OR (r.low_excluded AND v.reach_high = r.low)
                    OR (r.high_excluded AND v.reach_low = r.high) THEN 'violated'
               WHEN v.value IS NULL OR v.not_finite_s IS NOT NULL OR n.outcome NOT IN ('completed', 'no_effect')
                    THEN 'inconclusive'
               WHEN (r.low IS NULL OR v.reach_low > r.low OR (v.reach_low = r.low AND NOT r.low_excluded))
                    AND (r.high IS NULL OR v.reach_high < r.high OR (v.reach_high = r.high AND NOT r.high_excluded))
                    THEN 'satisfied'
               ELSE 'inconclusive'
           END AS verdict
      FROM repetitions n CROSS JOIN requirements r
           LEFT JOIN repetition_values v ON v.test = n.test AND v.position = n.position AND v.metric = r.metric;

-- Per test and requirement the verdict of the test. If it was run again, it violates the requirement if a repetition does, and
-- satisfies it if some repetition satisfies it and none violates it; if all repetitions are inconclusive, only a violation by
-- its first run stands. The value is that of its first run.
CREATE VIEW verdicts AS
    SELECT f.test AS test, f.test_name AS test_name, f.requirement AS requirement, f.requirement_text AS requirement_text,
           f.value AS value,
           CASE
               WHEN EXISTS (SELECT 1 FROM repetition_verdicts n WHERE n.test = coalesce(t.duplicate_of, t.number)
                               AND n.requirement = f.requirement AND n.verdict = 'violated') THEN 'violated'
               WHEN EXISTS (SELECT 1 FROM repetition_verdicts n WHERE n.test = coalesce(t.duplicate_of, t.number)
                               AND n.requirement = f.requirement AND n.verdict = 'satisfied') THEN 'satisfied'
               WHEN f.verdict = 'satisfied'
                    AND EXISTS (SELECT 1 FROM repetitions n WHERE n.test = coalesce(t.duplicate_of, t.number)) THEN 'inconclusive'
               ELSE f.verdict
           END AS verdict
      FROM first_verdicts f JOIN tests t ON t.number = f.test JOIN requirements r ON r.name = f.requirement
     ORDER BY t.number, r.id;

-- Findings: violated requirements, crashes, timeouts, and metrics that read numbers that are not finite (NaN, infinity), with
-- the time of the first one as their value. Duplicates are left out, and so are findings of a first run that no repetition
-- shows.
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

-- Requirements that a test which was run again violates, in its first run or in a repetition: the verdict of its first run,
-- how many repetitions violate it, how many are conclusive, and how many there are.
CREATE VIEW confirmations AS
    SELECT f.test AS test, f.test_name AS test_name, f.requirement AS requirement, f.verdict AS first,
           count(*) FILTER (WHERE n.verdict = 'violated') AS confirmed,
           count(*) FILTER (WHERE n.verdict <> 'inconclusive') AS conclusive, count(*) AS repetitions
      FROM repetition_verdicts n JOIN first_verdicts f ON f.test = n.test AND f.requirement = n.requirement
           JOIN requirements r ON r.name = f.requirement
     GROUP BY f.test, r.id
    HAVING f.verdict = 'violated' OR count(*) FILTER (WHERE n.verdict = 'violated') > 0
     ORDER BY f.test, r.id;
