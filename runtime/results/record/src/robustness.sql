-- Robustness over time: that of the formula inside the outermost always or eventually of a metric's formula, thinned.
-- Pieces are as in series_pieces; the last point ends the signal and repeats the value before. It explains the metric's value
-- and is not part of the digest. The view robustness has a row per point.
CREATE TABLE robustness_pieces (
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
